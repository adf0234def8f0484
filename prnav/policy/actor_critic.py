"""The actor-critic: encoder, memory, an actor for the kind of actions, and a critic.

Letters in shapes: T steps, N environments, M rows whose losses are taken, U rows that are encoded for them. An action's
own axes are written "...": none for discrete actions, (D,) for vectors. The policy holds no state of its own: memory
states go in and come out, and the caller brings the random numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from prnav.contracts import ActionSpec, ObservationSpecs
from prnav.policy.actions import ActionDistribution, action_head
from prnav.policy.actions.head import small_network
from prnav.policy.config import ENCODERS, MEMORIES, PolicyConfig
from prnav.policy.memory import Cutter, Inputs, Memory, MemoryState
from prnav.policy.observed import Observations
from prnav.registry import resolve

FIXES = ("gps", "compass")
"""Observations that tell how far an agent has moved."""


class PolicyStep(NamedTuple):
    """What a policy says at one step."""

    distribution: ActionDistribution
    """Of the actions, N of them."""
    values: Tensor
    """Expected discounted return from here on, (N,)."""
    state: MemoryState
    """The memory's state after this step."""


class Policy(nn.Module):
    """Policy over dictionary observations: encoder x memory x action head."""

    def __init__(self, config: PolicyConfig, observation_specs: ObservationSpecs, action_spec: ActionSpec) -> None:
        super().__init__()
        self.config = config
        self.observation_specs = dict(observation_specs)
        self.head = action_head(action_spec)
        self.encoder: nn.Module = resolve(ENCODERS, config.encoder)(config, observation_specs)
        self.encoder_type: torch.dtype | None = None
        """Type of the encoder's products, such as bfloat16; None is that of its weights."""
        self.action_embedding = self.head.previous() if config.previous_action else None
        self.has_fixes = set(FIXES) <= set(observation_specs)
        features = config.width + (self.head.previous_width if config.previous_action else 0)
        self.core: Memory = resolve(MEMORIES, config.memory)(features, config, self.has_fixes)
        self.actor = self.head.actor(self.core.outputs, config.head_hidden)
        self.critic = small_network(self.core.outputs, config.head_hidden, 1, gain=1.0)

    @property
    def action_spec(self) -> ActionSpec:
        """What the policy's agents can do."""
        return self.head.spec

    @property
    def device(self) -> torch.device:
        """Where the weights lie."""
        return next(self.parameters()).device

    def initial_state(self, environments: int) -> MemoryState:
        """The memory's state of N environments before the first step."""
        return self.core.initial_state(environments)

    def initial_actions(self, environments: int) -> Tensor:
        """Stands for the previous actions (N, ...) before the first step."""
        return self.head.none_yet(environments, device=self.device)

    def step(
        self, observations: Observations, previous_actions: Tensor, starts: Tensor, state: MemoryState
    ) -> PolicyStep:
        """One step of N environments.

        Args:
            observations: name -> (N, ...).
            previous_actions: Action taken before this step, (N, ...); ignored where ``starts``.
            starts: True at the first step of an episode, (N,) bool: what the memory holds is forgotten there.
            state: The memory's state.
        """
        inputs = self._inputs(observations, previous_actions, starts)
        outputs, after = self.core.step(inputs, state, starts)
        return PolicyStep(self.head.distribution(self.actor(outputs)), self.critic(outputs)[:, 0], after)

    def evaluate(
        self, observations: Observations, previous_actions: Tensor, starts: Tensor, state: MemoryState, plan: object
    ) -> tuple[ActionDistribution, Tensor]:
        """Distributions and values (M,) of the targets of a cut (:class:`prnav.policy.memory.Cut`).

        Args:
            observations: Of its frames, name -> (U, ...).
            previous_actions: Of its frames, (U, ...).
            starts: Of its frames, (U,) bool.
            state: Of its environments, before the rollout.
            plan: Its plan.
        """
        inputs = self._inputs(observations, previous_actions, starts)
        outputs = self.core.sequence(inputs, state, starts, plan)
        return self.head.distribution(self.actor(outputs)), self.critic(outputs)[:, 0]

    def cutter(self, starts: Tensor) -> Cutter:
        """What cuts a rollout with these ``starts`` (T, N) into mini-batches."""
        return self.core.cutter(starts.cpu().numpy(), self.device)

    def sequence(
        self, observations: Observations, previous_actions: Tensor, starts: Tensor, state: MemoryState
    ) -> tuple[ActionDistribution, Tensor]:
        """A whole rollout at once; equals :meth:`step` done T times.

        Args:
            observations: name -> (T, N, ...).
            previous_actions: (T, N, ...).
            starts: (T, N) bool.
            state: The memory's state before the first step.

        Returns:
            Distributions and values, both (T, N).
        """
        cutter = self.cutter(starts)
        cut = cutter.cut(np.arange(cutter.units))
        rows = {name: value.flatten(0, 1) for name, value in observations.items()}
        state = self.core.select(state, torch.from_numpy(cut.environments).to(self.device))
        distribution, values = self.evaluate(rows, previous_actions.flatten(0, 1), starts.flatten(), state, cut.plan)
        parameters = distribution.parameters.view(*starts.shape, -1)
        return self.head.distribution(parameters), values.view(starts.shape)

    def _inputs(self, observations: Observations, previous_actions: Tensor, starts: Tensor) -> Inputs:
        """What the memory is given of rows (B, ...)."""
        features = self._encode(observations or {"nothing": starts.new_zeros(len(starts), 0)})
        if self.action_embedding is not None:
            features = torch.cat([features, self.action_embedding(previous_actions, starts)], dim=-1)
        fixes = torch.cat([observations[name] for name in FIXES], dim=-1) if self.has_fixes else None
        return Inputs(features, fixes)

    def _encode(self, observations: Observations) -> Tensor:
        """Encoding (B, D) in float32."""
        if self.encoder_type is None:
            encoding: Tensor = self.encoder(observations)
            return encoding
        with torch.autocast(self.device.type, dtype=self.encoder_type):
            encoding = self.encoder(observations)
            return encoding.float()


def build_policy(
    config: PolicyConfig, observation_specs: ObservationSpecs, action_spec: ActionSpec, seed: int = 0
) -> Policy:
    """A policy with weights drawn from ``seed``, for agents that are shown and can do what the specs say.

    Raises:
        ConfigError: the encoder needs an observation that is not there.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return Policy(config, observation_specs, action_spec)
