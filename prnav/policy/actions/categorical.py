"""One of A actions. Letters in shapes: B batch (any leading axes)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from prnav.aliases import Array
from prnav.contracts import DiscreteActions
from prnav.policy.actions.head import ActionHead, Exploration, small_network

EMBEDDING_WIDTH = 16
"""Width of the embedding of the previous action."""


@dataclass(frozen=True, eq=False)
class Categorical:
    """Distributions over A actions."""

    logits: Tensor
    """Unnormalised log probabilities, (B, A)."""

    @property
    def parameters(self) -> Tensor:
        """The logits."""
        return self.logits

    def sample(self, noise: Tensor) -> Tensor:
        """Actions (B,) by uniform numbers (B, A): Gumbel's trick."""
        return (self.logits - torch.log(-torch.log(noise))).argmax(dim=-1)

    def draw(self, uniforms: NDArray[np.float64]) -> Tensor:
        """Actions (B,) by uniform numbers (B, 1); one of probability zero is never drawn."""
        logits = self.logits.double().cpu().numpy()
        weights = np.exp(logits - logits.max(axis=-1, keepdims=True))
        cumulative = np.cumsum(weights / weights.sum(axis=-1, keepdims=True), axis=-1)
        threshold = uniforms * cumulative[..., -1:]
        return torch.from_numpy(np.argmax(cumulative > threshold, axis=-1).astype(np.int64))

    def mode(self) -> Tensor:
        """The likeliest actions, (B,)."""
        return self.logits.argmax(dim=-1)

    def log_prob(self, actions: Tensor) -> Tensor:
        """Log probability of ``actions`` (B,), (B,)."""
        return functional.log_softmax(self.logits, dim=-1).gather(-1, actions[..., None])[..., 0]

    def entropy(self) -> Tensor:
        """Entropy [nats], (B,)."""
        log_probs = functional.log_softmax(self.logits, dim=-1)
        return -(log_probs.exp() * log_probs).sum(dim=-1)

    def imitation_loss(self, expert: Tensor) -> Tensor:
        """Cross-entropy of the expert's actions (B,)."""
        return functional.cross_entropy(self.logits.flatten(0, -2), expert.flatten())

    def agreement(self, expert: Tensor) -> Tensor:
        """Share of rows whose likeliest action is the expert's (B,)."""
        return (self.mode() == expert).float().mean()

    def diagnostics(self) -> dict[str, Tensor]:
        """None: the entropy says it all."""
        return {}


class ActionEmbedding(nn.Embedding):
    """Embedding of the previous action, with one more row that stands for "no action yet"."""

    def __init__(self, actions: int) -> None:
        super().__init__(actions + 1, EMBEDDING_WIDTH)

    def forward(self, actions: Tensor, starts: Tensor) -> Tensor:  # type: ignore[override]
        """Features (B, 16) of actions (B,), which are ignored at the first step of an episode."""
        return super().forward(torch.where(starts, self.num_embeddings - 1, actions))


class CategoricalHead(ActionHead):
    """The head of :class:`DiscreteActions`."""

    previous_width = EMBEDDING_WIDTH
    draw_width = 1
    shape = ()
    dtype = torch.int64
    unlabelled = -1

    def __init__(self, spec: DiscreteActions) -> None:
        self.spec = spec
        self.size = self.noise_width = spec.n

    def actor(self, inputs: int, hidden: int) -> nn.Module:
        """Network (B, inputs) -> logits (B, A), nearly uniform at first."""
        return small_network(inputs, hidden, self.size, gain=0.01)

    def previous(self) -> nn.Module:
        """A learned embedding."""
        return ActionEmbedding(self.size)

    def distribution(self, parameters: Tensor) -> Categorical:
        """The distribution with logits (B, A)."""
        return Categorical(parameters)

    def for_environment(self, actions: Tensor) -> Array:
        """The actions (B,) int64."""
        return actions.cpu().numpy()

    def exploration(self, share: float) -> Exploration:
        """An entropy below that share of the uniform distribution's."""
        least = share * math.log(max(2, self.size))
        return Exploration("entropy", least, "the policy's entropy has been below {least:.3f} nats")
