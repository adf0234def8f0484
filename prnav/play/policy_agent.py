"""A trained policy as an agent.

Forward passes always have the same batch shape: slots are dealt to blocks of :data:`BLOCK` rows, the last one filled
up. A row's answer then does not depend on how many slots there are, which is what makes an episode's result its own.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from prnav.contracts.agents import Turn
from prnav.errors import CheckpointError
from prnav.play.noise import noise_rows
from prnav.policy import RecurrentPolicy, sample_actions

BLOCK = 32
"""Rows of a forward pass."""

ActionChoice = Literal["greedy", "sampled"]


class PolicyAgent:
    """Acts by a policy with memory, greedily or by sampling with the episode's own random numbers."""

    def __init__(
        self,
        policy: RecurrentPolicy,
        name: str,
        actions: ActionChoice,
        num_slots: int,
        device: torch.device | str | None = None,
    ) -> None:
        """Agent for ``num_slots`` slots.

        Args:
            policy: what acts.
            name: in records and tables.
            actions: how it chooses.
            num_slots: N.
            device: where it runs; the policy is moved there. None leaves it where it is.
        """
        self.name = name
        self.actions = actions
        self.device = next(policy.parameters()).device if device is None else torch.device(device)
        self.policy = policy.to(self.device)
        if self.device.type == "cpu":
            torch.set_num_threads(1)  # blocks are too small to share, and sums must not depend on the machine's cores
        blocks = -(-num_slots // BLOCK)
        self._states = [policy.initial_state(BLOCK) for _ in range(blocks)]
        self._previous = np.zeros(num_slots, dtype=np.int64)

    @torch.inference_mode()
    def act(self, turn: Turn) -> NDArray[Any]:
        """Actions as the policy's action spec has them.

        Raises:
            CheckpointError: the policy's answer is not finite.
        """
        count = len(turn.starts)
        noise = noise_rows(turn.keys, turn.steps, self.policy.actions)
        actions = np.zeros_like(self._previous)
        for block in range(len(self._states)):
            part = slice(block * BLOCK, min((block + 1) * BLOCK, count))
            if turn.active[part].any():
                actions[part] = self._act(turn, block, part, noise[part])
        self._previous = actions
        return actions

    def _act(self, turn: Turn, block: int, part: slice, noise: NDArray[np.float32]) -> NDArray[Any]:
        observations = {key: self._block(turn.observations[key][part]) for key in self.policy.shapes}
        previous, starts = self._block(self._previous[part]), self._block(turn.starts[part])
        step = self.policy.step(observations, previous, starts, self._states[block])
        self._states[block] = step.state
        rows = part.stop - part.start
        lost = turn.active[part] & ~np.isfinite(step.logits[:rows].cpu().numpy()).all(axis=1)
        if lost.any():
            raise CheckpointError(
                f"policy {self.name}: its action probabilities are not finite at step "
                f"{int(turn.steps[part][lost].min())} of an episode; the weights are damaged: take an earlier "
                f"checkpoint, or train again with a lower learning rate"
            )
        drawn = None if self.actions == "greedy" else self._block(noise, fill=0.5)
        return sample_actions(step.logits, drawn)[:rows].cpu().numpy()

    def _block(self, values: NDArray[Any], fill: float = 0.0) -> torch.Tensor:
        """The rows (n, ...) followed by ``fill`` up to BLOCK, on the device."""
        filled = np.full((BLOCK, *values.shape[1:]), fill, dtype=values.dtype)
        filled[: len(values)] = values
        return torch.from_numpy(filled).to(self.device)
