"""A trained policy as an agent.

Forward passes always have the same batch shape: slots are dealt to blocks of :data:`BLOCK` rows, the last one filled
up. A row's answer then does not depend on how many slots there are, which is what makes an episode's result its own.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import torch

from prnav.aliases import Array
from prnav.contracts.agents import Turn
from prnav.errors import CheckpointError
from prnav.play.noise import uniforms_of_width
from prnav.policy import ActionDistribution, Policy

BLOCK = 32
"""Rows of a forward pass."""

ActionChoice = Literal["greedy", "sampled"]


class PolicyAgent:
    """Acts by a policy with memory, greedily or by sampling with the episode's own random numbers."""

    def __init__(
        self,
        policy: Policy,
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
        self.device = policy.device if device is None else torch.device(device)
        self.policy = policy.to(self.device)
        if self.device.type == "cpu":
            torch.set_num_threads(1)  # blocks are too small to share, and sums must not depend on the machine's cores
        blocks = -(-num_slots // BLOCK)
        self._states = [policy.initial_state(BLOCK) for _ in range(blocks)]
        self._previous = policy.initial_actions(num_slots).cpu().numpy()

    def act(self, turn: Turn) -> Array:
        """Actions (N,), or (N, D), as the policy's action spec has them.

        Raises:
            CheckpointError: the policy's answer is not finite.
        """
        distribution = self._distribution(turn)
        lost = turn.active & ~np.isfinite(distribution.parameters.numpy()).all(axis=1)
        if lost.any():
            step = int(turn.steps[lost].min())
            raise CheckpointError(
                f"policy {self.name}: its action probabilities are not finite at step {step} of an episode; "
                "the weights are damaged: take an earlier checkpoint, or train again with a lower learning rate"
            )
        head = self.policy.head
        if self.actions == "greedy":
            actions = distribution.mode()
        else:
            actions = distribution.draw(uniforms_of_width(turn.keys, turn.steps, head.draw_width))
        self._previous = actions.numpy()
        return head.for_environment(actions)

    @torch.inference_mode()
    def _distribution(self, turn: Turn) -> ActionDistribution:
        """Of the actions, N of them, on the host; forgets what came before in slots that start."""
        count = len(turn.starts)
        rows: list[torch.Tensor | None] = []
        for block, state in enumerate(self._states):
            part = slice(block * BLOCK, min((block + 1) * BLOCK, count))
            if not turn.active[part].any():
                rows.append(None)
                continue
            observations = {key: self._block(turn.observations[key][part]) for key in self.policy.observation_specs}
            step = self.policy.step(
                observations, self._block(self._previous[part]), self._block(turn.starts[part]), state
            )
            self._states[block] = step.state
            rows.append(step.distribution.parameters.cpu())
        idle = torch.zeros_like(next(row for row in rows if row is not None))
        parameters = torch.cat([idle if row is None else row for row in rows])[:count]
        return self.policy.head.distribution(parameters)

    def _block(self, values: Array) -> torch.Tensor:
        """The rows (n, ...) followed by zeros up to BLOCK, on the device."""
        filled = np.zeros((BLOCK, *values.shape[1:]), dtype=values.dtype)
        filled[: len(values)] = values
        return torch.from_numpy(filled).to(self.device)
