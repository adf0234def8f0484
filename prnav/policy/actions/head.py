"""What every kind of action must say about itself, so that no one else asks which kind it is.

Letters in shapes: B batch (any leading axes), P parameters of a distribution, W numbers that a sample takes, and an
action's own axes, written "...": none for discrete actions, (D,) for vectors.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from prnav.aliases import Array
from prnav.contracts import ActionSpec

SMALLEST_UNIFORM = 1e-7
"""Uniform numbers are drawn from [SMALLEST_UNIFORM, 1 - SMALLEST_UNIFORM], where no transform of them is infinite."""


class ActionDistribution(Protocol):
    """Distributions over actions, one per row."""

    @property
    def parameters(self) -> Tensor:
        """What the actor said, (B, P); not finite where the policy is broken."""
        ...

    def sample(self, noise: Tensor) -> Tensor:
        """Actions (B, ...) by uniform numbers in (0, 1) (B, W), W being the head's ``noise_width``.

        The noise comes from the caller, so that an agent's actions depend on its own numbers alone.
        """
        ...

    def draw(self, uniforms: NDArray[np.float64]) -> Tensor:
        """Actions (B, ...) by inverse transform in float64, on the host.

        The same distribution as :meth:`sample` by as few numbers as can be, for evaluation, where each number is a hash
        of the episode and the step.

        Args:
            uniforms: Numbers in [0, 1), (B, W), W being the head's ``draw_width``.
        """
        ...

    def mode(self) -> Tensor:
        """The likeliest actions, (B, ...)."""
        ...

    def log_prob(self, actions: Tensor) -> Tensor:
        """Log probability or log density [nats] of ``actions`` (B, ...), (B,)."""
        ...

    def entropy(self) -> Tensor:
        """Entropy [nats], (B,): differential, and perhaps negative, where actions are real."""
        ...

    def imitation_loss(self, expert: Tensor) -> Tensor:
        """Mean loss of imitating the expert's actions (B, ...), scalar."""
        ...

    def agreement(self, expert: Tensor) -> Tensor:
        """Share of rows whose mode is the expert's action (B, ...), scalar."""
        ...

    def diagnostics(self) -> dict[str, Tensor]:
        """What is worth watching beside the entropy, by name, scalars."""
        ...


@dataclass(frozen=True)
class Exploration:
    """By which a policy that no longer tries anything new is recognised."""

    metric: str
    """Name of a loss or diagnostic."""
    least: float
    """Below it for long, something is wrong."""
    complaint: str
    """What is then said of the policy; ``{least}`` stands for the bound."""


class ActionHead(ABC):
    """One kind of action: its distribution, its noise, how it is stored, shown to the policy and handed over."""

    spec: ActionSpec
    size: int
    """A or D: how many actions there are to choose from, or numbers in one."""
    noise_width: int
    """W: uniform numbers that a sample takes."""
    draw_width: int
    """Uniform numbers that a draw by inverse transform takes."""
    previous_width: int
    """Features that the previous action makes."""
    shape: tuple[int, ...]
    """Of one stored action."""
    dtype: torch.dtype
    """Of stored actions."""
    unlabelled: float
    """Stands for an expert's action that was not asked for."""

    @abstractmethod
    def actor(self, inputs: int, hidden: int) -> nn.Module:
        """Network (B, inputs) -> (B, P), near the same answer for all inputs at first.

        Args:
            inputs: Width of what it is given.
            hidden: Units of its hidden layer; 0 makes it linear.
        """

    @abstractmethod
    def previous(self) -> nn.Module:
        """Network (previous actions (B, ...), starts (B,) bool) -> features (B, ``previous_width``)."""

    @abstractmethod
    def distribution(self, parameters: Tensor) -> ActionDistribution:
        """The distribution with the actor's output (B, P)."""

    @abstractmethod
    def for_environment(self, actions: Tensor) -> Array:
        """Actions as the environment takes them, on the host: int64 (B,), or float32 (B, D) clipped to the bounds."""

    @abstractmethod
    def exploration(self, share: float) -> Exploration:
        """The sign of a policy that tries nothing new.

        Args:
            share: Of what a policy that knows nothing has, below which it does not explore.
        """

    def none_yet(self, *batch: int, device: torch.device | str = "cpu") -> Tensor:
        """Previous actions (B, ...) where there were none."""
        return torch.zeros(*batch, *self.shape, dtype=self.dtype, device=device)


def orthogonal(layer: nn.Linear, gain: float = math.sqrt(2.0)) -> nn.Linear:
    """``layer`` with an orthogonal weight of the given gain and no bias."""
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


def small_network(inputs: int, hidden: int, outputs: int, gain: float) -> nn.Module:
    """A linear map, or with ``hidden`` units an MLP of one hidden layer; ``gain`` is that of the last layer."""
    if not hidden:
        return orthogonal(nn.Linear(inputs, outputs), gain)
    return nn.Sequential(orthogonal(nn.Linear(inputs, hidden)), nn.ReLU(), orthogonal(nn.Linear(hidden, outputs), gain))
