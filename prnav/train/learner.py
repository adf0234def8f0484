"""Gradient steps on a rollout, whatever the loss.

A mini-batch is made of the units that the policy's memory says can be learnt alone: whole environments, or single
steps with the frames before them. It is gathered when its turn comes, so that no more of a rollout is copied than one
of them. On a CPU each is cut into one part per thread. Every part runs forward and backward on
its own core, and the parts' gradients are added in a fixed order: two cores then learn almost twice as fast (an LSTM
step is too small a product to be split inside), and the same number of threads gives the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from prnav.aliases import JSON, JSONObject
from prnav.policy import ActionDistribution, Cutter, MemoryState, Policy
from prnav.train.distributed import Workers
from prnav.train.machine import one_core_threads
from prnav.train.ppo import Losses
from prnav.train.rollout import Rollout

Loss = Callable[[ActionDistribution, Tensor, Mapping[str, Tensor]], Losses]
"""(distribution of M rows, values (M,), batch of arrays (M, ...)) -> loss and its parts."""


@dataclass(frozen=True)
class BatchPart:
    """BatchPart of a rollout, ready for the policy: M targets, U frames that are encoded for them."""

    observations: dict[str, Tensor]
    """Of the frames, name -> (U, ...)."""
    previous_actions: Tensor
    """Of the frames, (U, ...)."""
    starts: Tensor
    """Of the frames, (U,)."""
    state: MemoryState
    """The memory's before the rollout, of the environments that need it."""
    plan: object
    """The memory's, from frames to targets."""
    arrays: dict[str, Tensor]
    """Of the targets, name -> (M, ...)."""
    weight: float
    """Share of the mini-batch."""

    @property
    def size(self) -> int:
        """M."""
        return self.arrays["starts"].numel()


Units = NDArray[np.int64]


class Learner:
    """Adam on a policy's parameters."""

    def __init__(self, policy: Policy, seed: int, threads: int, epsilon: float, workers: Workers | None = None) -> None:
        self.policy = policy
        self.workers = workers or Workers()
        self.parameters = list(policy.parameters())
        self.optimizer = torch.optim.Adam(self.parameters, eps=epsilon)
        self.generator = np.random.Generator(np.random.PCG64(seed))
        self.threads = threads
        self._pool = one_core_threads(threads, "learner") if threads > 1 else None

    def update(
        self,
        rollout: Rollout,
        loss: Loss,
        epochs: int,
        mini_batches: int,
        learning_rate: float,
        max_grad_norm: float,
    ) -> dict[str, float]:
        """``epochs`` passes over a rollout; means of the loss's parts over all gradient steps."""
        for group in self.optimizer.param_groups:
            group["lr"] = learning_rate
        history: list[dict[str, Tensor]] = []
        cutter = self.policy.cutter(rollout["starts"])
        parts: list[BatchPart] = []
        for _ in range(epochs):
            for units in self._split(cutter.units, mini_batches):
                if mini_batches > 1 or not parts:
                    parts = self._gather(rollout, cutter, units)
                history.append(self._step(parts, loss, max_grad_norm))
        return {name: float(torch.stack([row[name] for row in history]).mean()) for name in history[0]}

    def _split(self, units: int, mini_batches: int) -> list[Units]:
        """Units of each mini-batch; they are drawn anew each time where there are several."""
        numbers = np.arange(units)
        if mini_batches > 1:
            numbers = self.generator.permutation(numbers)
        return np.array_split(numbers, min(mini_batches, units))

    def _gather(self, rollout: Rollout, cutter: Cutter, units: Units) -> list[BatchPart]:
        """A mini-batch, one part for each thread."""
        shares = [share for share in np.array_split(units, self.threads) if len(share)]
        return [_part(rollout, cutter, self.policy, share, len(share) / len(units)) for share in shares]

    def _step(self, parts: list[BatchPart], loss: Loss, max_grad_norm: float) -> dict[str, Tensor]:
        def gradients(part: BatchPart) -> tuple[tuple[Tensor, ...], dict[str, Tensor]]:
            distribution, values = self.policy.evaluate(
                part.observations, part.previous_actions, part.starts, part.state, part.plan
            )
            total, losses = loss(distribution, values, part.arrays)
            return torch.autograd.grad(part.weight * total, self.parameters), losses

        results = list(self._pool.map(gradients, parts)) if self._pool else [gradients(part) for part in parts]
        summed = [sum(row[1:], row[0]) for row in zip(*(result[0] for result in results), strict=True)]
        size = sum(part.size for part in parts)
        for parameter, gradient in zip(self.parameters, self.workers.average(summed, size), strict=True):
            parameter.grad = gradient
        norm = torch.nn.utils.clip_grad_norm_(self.parameters, max_grad_norm)
        self.optimizer.step()
        means = {
            name: sum((part.weight * losses[name] for part, (_, losses) in zip(parts, results, strict=True)), norm * 0)
            for name in results[0][1]
        }
        return {**means, "grad_norm": norm}

    def state_dict(self) -> JSONObject:
        """Everything but the policy that the next update depends on."""
        return {"optimizer": self.optimizer.state_dict(), "generator": self.generator.bit_generator.state}

    def load_state_dict(self, state: Mapping[str, JSON]) -> None:
        """Continue from :meth:`state_dict`."""
        optimizer = dict(state["optimizer"])
        optimizer["state"] = {
            int(index): {name: torch.as_tensor(value) for name, value in slots.items()}
            for index, slots in optimizer["state"].items()
        }
        for index, slots in optimizer["state"].items():
            for name, value in slots.items():
                if value.ndim and value.shape != self.parameters[index].shape:
                    raise ValueError(f"the optimizer's {name} {index} is of shape {tuple(value.shape)}")
        self.optimizer.load_state_dict(optimizer)
        self.generator.bit_generator.state = state["generator"]


def _part(rollout: Rollout, cutter: Cutter, policy: Policy, units: Units, weight: float) -> BatchPart:
    cut = cutter.cut(units)
    frames, targets, environments = (
        torch.from_numpy(rows).to(rollout.device) for rows in (cut.frames, cut.targets, cut.environments)
    )
    return BatchPart(
        observations={name: _rows(value, frames) for name, value in rollout.observations.items()},
        previous_actions=_rows(rollout["previous_actions"], frames),
        starts=_rows(rollout["starts"], frames),
        state=policy.core.select(rollout.state, environments),
        plan=cut.plan,
        arrays={name: _rows(array, targets) for name, array in rollout.arrays.items()},
        weight=weight,
    )


def _rows(values: Tensor, rows: Tensor) -> Tensor:
    """Rows t * N + n of values (T, N, ...)."""
    return values.flatten(0, 1).index_select(0, rows)
