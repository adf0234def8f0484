"""A trained policy as an agent.

Forward passes always have the same batch shape: slots are dealt to blocks of :data:`BLOCK` rows, the last one filled
up. A row's answer then does not depend on how many slots there are, which is what makes an episode's result its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from prnav.cache import hash_arrays
from prnav.errors import CheckpointError
from prnav.evaluate.agents import Turn
from prnav.evaluate.sampling import sample_categorical, uniforms
from prnav.policy import RecurrentPolicy
from prnav.train.config import TrainConfig
from prnav.train.run_folder import RunFolder
from prnav.train.trainer import load_policy

BLOCK = 32
"""Rows of a forward pass."""

ActionChoice = Literal["greedy", "sampled"]


@dataclass(frozen=True, eq=False)
class TrainedRun:
    """The policy of a run and what it was trained on."""

    name: str
    config: TrainConfig
    policy: RecurrentPolicy
    facts: dict[str, Any]
    """Where the weights come from: steps trained, hash of the weights, encoder."""


def load_run(directory: str | Path, warn: Callable[[str], None]) -> TrainedRun:
    """Policy of a run's last readable checkpoint; ``warn`` is told of broken ones.

    Raises:
        CheckpointError: there is no such run, no checkpoint, or one that does not fit the run's config.
        ConfigError: the run's config cannot be read.
    """
    path = Path(directory)
    if not path.is_dir():
        raise CheckpointError(f"run {directory}: there is no such folder; give one that prnav-train made (--run DIR)")
    folder = RunFolder(path)
    config = folder.load_config()
    policy, counters = load_policy(folder, warn)
    weights = {name: value.detach().cpu().numpy() for name, value in policy.state_dict().items()}
    facts = {"encoder": config.policy.encoder, "steps": counters["step"], "weights": hash_arrays(weights)[:16]}
    return TrainedRun(path.resolve().name, config, policy, facts)


class PolicyAgent:
    """Acts by a recurrent policy, greedily or by sampling with the episode's own random numbers."""

    def __init__(
        self,
        policy: RecurrentPolicy,
        name: str,
        actions: ActionChoice,
        num_slots: int,
        device: torch.device | str = "cpu",
    ) -> None:
        """Agent for ``num_slots`` slots whose policy is moved to ``device``."""
        self.name = name
        self.actions = actions
        self.device = torch.device(device)
        self.policy = policy.to(self.device).eval()
        if self.device.type == "cpu":
            torch.set_num_threads(1)  # blocks are too small to share, and sums must not depend on the machine's cores
        blocks = -(-num_slots // BLOCK)
        self._states = [policy.initial_state(BLOCK).to(self.device) for _ in range(blocks)]
        self._previous = np.zeros(num_slots, dtype=np.int64)

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,).

        Raises:
            CheckpointError: the policy's answer is not finite.
        """
        probabilities = self._probabilities(turn)
        lost = turn.active & ~np.isfinite(probabilities).all(axis=1)
        if lost.any():
            step = int(turn.steps[lost].min())
            raise CheckpointError(
                f"policy {self.name}: its action probabilities are not finite at step {step} of an episode; "
                "the weights are damaged: take an earlier checkpoint, or train again with a lower learning rate"
            )
        if self.actions == "greedy":
            actions = np.argmax(probabilities, axis=1).astype(np.int64)
        else:
            actions = sample_categorical(probabilities, uniforms(turn.keys, turn.steps))
        self._previous = actions
        return actions

    @torch.inference_mode()
    def _probabilities(self, turn: Turn) -> NDArray[np.float64]:
        """Action probabilities (N, A) in float64; forgets what came before in slots that start."""
        count = len(turn.starts)
        rows = []
        for block, state in enumerate(self._states):
            part = slice(block * BLOCK, min((block + 1) * BLOCK, count))
            observations = {key: self._block(turn.observations[key][part]) for key in self.policy.shapes}
            step = self.policy.step(
                observations, self._block(self._previous[part]), self._block(turn.starts[part]), state
            )
            self._states[block] = step.state
            rows.append(step.logits[: part.stop - part.start].double().cpu().numpy())
        logits = np.concatenate(rows)
        weights = np.exp(logits - logits.max(axis=1, keepdims=True))
        return weights / weights.sum(axis=1, keepdims=True)

    def _block(self, values: NDArray[Any]) -> torch.Tensor:
        """The rows (n, ...) followed by zeros up to BLOCK, on the device."""
        filled = np.zeros((BLOCK, *values.shape[1:]), dtype=values.dtype)
        filled[: len(values)] = values
        return torch.from_numpy(filled).to(self.device)
