"""Gradient steps on a rollout, whatever the loss.

On a CPU each mini-batch is cut over its environments into one part per thread. Every part runs forward and backward on
its own core, and the parts' gradients are added in a fixed order: two cores then learn almost twice as fast (an LSTM
step is too small a product to be split inside), and the same number of threads gives the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from prnav.policy import RecurrentPolicy, Segments, segment
from prnav.train.distributed import Workers
from prnav.train.ppo import Losses
from prnav.train.rollout import Rollout

Loss = Callable[[Tensor, Tensor, Mapping[str, Tensor]], Losses]
"""(logits (T, N, A), values (T, N), batch) -> loss and its parts."""


@dataclass(frozen=True)
class Part:
    """Some environments of a rollout, ready for the policy."""

    observations: dict[str, Tensor]
    arrays: dict[str, Tensor]
    state: Tensor
    segments: Segments
    weight: float
    """Share of the mini-batch."""

    @property
    def size(self) -> int:
        """Steps in it."""
        return self.arrays["starts"].numel()


class Learner:
    """Adam on a policy's parameters."""

    def __init__(
        self, policy: RecurrentPolicy, seed: int, threads: int, epsilon: float, workers: Workers | None = None
    ) -> None:
        self.policy = policy
        self.workers = workers or Workers()
        self.parameters = list(policy.parameters())
        self.optimizer = torch.optim.Adam(self.parameters, eps=epsilon)
        self.generator = np.random.Generator(np.random.PCG64(seed))
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="learner") if threads > 1 else None

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
        groups: list[list[Part]] = []
        for _ in range(epochs):
            if mini_batches > 1 or not groups:
                groups = self._split(rollout, mini_batches)
            for parts in groups:
                losses = self._step(parts, loss, max_grad_norm)
                history.append(losses)
        return {name: float(torch.stack([row[name] for row in history]).mean()) for name in history[0]}

    def _split(self, rollout: Rollout, mini_batches: int) -> list[list[Part]]:
        """Parts of each mini-batch; environments are drawn anew where there are several mini-batches."""
        environments = np.arange(rollout.environments)
        if mini_batches > 1:
            environments = self.generator.permutation(environments)
        groups = np.array_split(environments, min(mini_batches, rollout.environments))
        return [
            [_part(rollout, part, len(part) / len(group)) for part in np.array_split(group, self.threads) if len(part)]
            for group in groups
        ]

    def _step(self, parts: list[Part], loss: Loss, max_grad_norm: float) -> dict[str, Tensor]:
        def gradients(part: Part) -> tuple[tuple[Tensor, ...], dict[str, Tensor]]:
            logits, values = self.policy.sequence(
                part.observations, part.arrays["previous_actions"], part.arrays["starts"], part.state, part.segments
            )
            total, losses = loss(logits, values, part.arrays)
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

    def state_dict(self) -> dict[str, Any]:
        """Everything but the policy that the next update depends on."""
        return {"optimizer": self.optimizer.state_dict(), "generator": self.generator.bit_generator.state}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on from :meth:`state_dict`."""
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


def _part(rollout: Rollout, environments: NDArray[np.int64], weight: float) -> Part:
    columns = torch.from_numpy(environments).to(rollout.device)
    arrays = {name: array.index_select(1, columns) for name, array in rollout.arrays.items()}
    return Part(
        observations={key: value.index_select(1, columns) for key, value in rollout.observations.items()},
        arrays=arrays,
        state=rollout.state[:, :, columns],
        segments=segment(arrays["starts"].cpu().numpy(), rollout.device),
        weight=weight,
    )
