"""The recurrent actor-critic: encoder, LSTM, a categorical actor and a critic.

Letters in shapes: T steps, N environments, A actions, H hidden units, L layers of the state. The policy holds no state
of its own: recurrent states go in and come out, and the caller brings the random numbers. L counts the LSTM's layers,
and with ``displacement`` one more, whose first units keep the last GPS and compass.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from prnav.policy.camera_encoders import ALL_ENCODERS
from prnav.policy.config import PolicyConfig
from prnav.policy.encoders import Observations, Shapes, orthogonal
from prnav.policy.features import displacement_features
from prnav.policy.recurrence import RecurrentCore, Segments, segment

ACTION_WIDTH = 16
"""Width of the embedding of the previous action."""

FIXES = {"gps", "compass"}
"""Observations that tell how far an agent has moved."""


class PolicyStep(NamedTuple):
    """What a policy says at one step."""

    logits: Tensor
    """Unnormalised log probabilities of the actions, (N, A)."""
    values: Tensor
    """Expected discounted return from here on, (N,)."""
    state: Tensor
    """Recurrent state after this step, (2, L, N, H)."""


class RecurrentPolicy(nn.Module):
    """Policy over dictionary observations with discrete actions."""

    def __init__(self, config: PolicyConfig, shapes: Shapes, actions: int) -> None:
        super().__init__()
        self.config = config
        self.shapes = dict(shapes)
        self.actions = actions
        self.encoder = ALL_ENCODERS[config.encoder](config, shapes)
        self.encoder_type: torch.dtype | None = None
        """Type of the encoder's products, such as bfloat16; None is that of its weights."""
        extra = ACTION_WIDTH if config.previous_action else 0
        self.displacement = config.displacement and FIXES <= set(shapes)
        extra += 2 if self.displacement else 0
        # row A stands for "no action yet", at the first step of an episode
        self.action_embedding = nn.Embedding(actions + 1, ACTION_WIDTH) if config.previous_action else None
        inputs = config.width + extra
        self.core = RecurrentCore(inputs, config.lstm_hidden, config.lstm_layers)
        outputs = config.lstm_hidden + (inputs if config.skip else 0)
        self.actor = _head(outputs, config.head_hidden, actions, gain=0.01)
        self.critic = _head(outputs, config.head_hidden, 1, gain=1.0)

    def initial_state(self, environments: int) -> Tensor:
        """Recurrent state (2, L, N, H) before the first step."""
        state = self.core.initial_state(environments)
        return torch.cat([state, torch.zeros_like(state[:, :1])], dim=1) if self.displacement else state

    def step(self, observations: Observations, previous_actions: Tensor, starts: Tensor, state: Tensor) -> PolicyStep:
        """One step of N environments.

        Args:
            observations: key -> (N, ...).
            previous_actions: Action taken before this step, (N,) int64; ignored where ``starts``.
            starts: True at the first step of an episode, (N,) bool: the state is forgotten there.
            state: Recurrent state (2, L, N, H).
        """
        rows = {key: value[None] for key, value in observations.items()}
        features = self._features(rows, previous_actions[None], starts[None], state)
        outputs, after = self.core.step(features, state[:, : self.config.lstm_layers], starts)
        outputs = self._head_inputs(outputs, features)
        if self.displacement:
            fix = functional.pad(_fixes(observations), (0, self.config.lstm_hidden - 3))
            after = torch.cat([after, torch.stack([fix, torch.zeros_like(fix)])[:, None]], dim=1)
        return PolicyStep(self.actor(outputs), self.critic(outputs)[:, 0], after)

    def sequence(
        self,
        observations: Observations,
        previous_actions: Tensor,
        starts: Tensor,
        state: Tensor,
        segments: Segments | None = None,
    ) -> tuple[Tensor, Tensor]:
        """A whole rollout at once; equals :meth:`step` done T times.

        Args:
            observations: key -> (T, N, ...).
            previous_actions: (T, N) int64.
            starts: (T, N) bool.
            state: Recurrent state before the first step, (2, L, N, H).
            segments: ``segment(starts)``, for callers that run one rollout many times.

        Returns:
            Logits (T, N, A) and values (T, N).
        """
        segments = segments or segment(starts.cpu().numpy(), starts.device)
        features = self._features(observations, previous_actions, starts, state)
        outputs = self._head_inputs(
            self.core.sequence(features, state[:, : self.config.lstm_layers], segments), features
        )
        return self.actor(outputs).view(*starts.shape, -1), self.critic(outputs).view(starts.shape)

    def _features(self, observations: Observations, previous_actions: Tensor, starts: Tensor, state: Tensor) -> Tensor:
        """Inputs of the core (T * N, F) from rows (T, N, ...) and the state before the first."""
        flat = {key: value.flatten(0, 1) for key, value in observations.items()}
        parts = [self._encode(flat)]
        if self.action_embedding is not None:
            actions = torch.where(starts, self.actions, previous_actions)
            parts.append(self.action_embedding(actions.flatten()))
        if self.displacement:
            fixes = _fixes(observations)
            last = torch.cat([state[0, -1:, :, :3], fixes[:-1]])
            moved = displacement_features(fixes, last) * (~starts)[..., None].to(fixes.dtype)
            parts.append(moved.flatten(0, 1))
        return torch.cat(parts, dim=-1)

    def _encode(self, observations: Observations) -> Tensor:
        """Encoding (B, D) in float32."""
        if self.encoder_type is None:
            return self.encoder(observations)
        with torch.autocast(next(self.parameters()).device.type, dtype=self.encoder_type):
            encoding: Tensor = self.encoder(observations)
            return encoding.float()

    def _head_inputs(self, outputs: Tensor, features: Tensor) -> Tensor:
        return torch.cat([outputs, features], dim=-1) if self.config.skip else outputs


def _fixes(observations: Observations) -> Tensor:
    return torch.cat([observations["gps"], observations["compass"]], dim=-1)


def _head(inputs: int, hidden: int, outputs: int, gain: float) -> nn.Module:
    if not hidden:
        return orthogonal(nn.Linear(inputs, outputs), gain)
    return nn.Sequential(orthogonal(nn.Linear(inputs, hidden)), nn.ReLU(), orthogonal(nn.Linear(hidden, outputs), gain))


def build_policy(
    config: PolicyConfig, shapes: Mapping[str, tuple[int, ...]], actions: int, seed: int = 0
) -> RecurrentPolicy:
    """A policy with weights drawn from ``seed``, for observations of these shapes (no batch axis) and so many actions.

    Raises:
        ConfigError: the encoder needs an observation that is not there.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return RecurrentPolicy(config, shapes, actions)


def sample_actions(logits: Tensor, uniforms: Tensor | None) -> Tensor:
    """Actions (...,) from logits (..., A): sampled with ``uniforms`` in (0, 1) of the same shape, or the likeliest.

    The noise comes from the caller (Gumbel's trick), so that an agent's actions depend on its own numbers alone.
    """
    if uniforms is None:
        return logits.argmax(dim=-1)
    return (logits - torch.log(-torch.log(uniforms))).argmax(dim=-1)


def log_probabilities(logits: Tensor, actions: Tensor) -> Tensor:
    """Log probability (...,) of ``actions`` (...,) under logits (..., A)."""
    return functional.log_softmax(logits, dim=-1).gather(-1, actions[..., None])[..., 0]


def entropies(logits: Tensor) -> Tensor:
    """Entropy [nats] (...,) of the distributions with logits (..., A)."""
    log_probs = functional.log_softmax(logits, dim=-1)
    return -(log_probs.exp() * log_probs).sum(dim=-1)
