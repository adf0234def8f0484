r"""A vector of D real numbers between bounds, by a diagonal Gaussian.

The mean is the actor's, and the logarithm of the standard deviation a learned vector of its own, the same in all
states, as in PPO's standard implementations (Schulman et al. 2017, section 6.1; Huang et al. 2022, "The 37
Implementation Details of Proximal Policy Optimization"). Both are learned in units of the box: 0 is the middle between
the bounds, 1 half the way between them, so that a new policy has its mean in the middle and a standard deviation of
half the range, whatever the bounds. Where they are -1 and 1, as in the DeepMind Control Suite, nothing is scaled.

What is sampled, stored and given a density is the unbounded action. It is clipped at the environment's door
(:meth:`GaussianHead.for_environment`) and where the policy is shown its previous action; the density knows nothing of
the clipping, which leaves the policy's gradient unbiased, since the environment is a function of the unbounded action
too.

Letters in shapes: B batch (any leading axes).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from prnav.aliases import Array
from prnav.contracts import BoxActions
from prnav.policy.actions.head import SMALLEST_UNIFORM, ActionHead, Exploration, small_network

CLOSE = 0.1
"""Share of half the range within which a mean agrees with an expert's action, in each coordinate."""


def standard_normal(uniforms: Tensor) -> Tensor:
    """Standard normal numbers from uniform ones in [0, 1], of their shape and type.

    By the inverse of the distribution function in float64, since float32 cannot tell numbers near 1 apart; within 5.2
    standard deviations.
    """
    kept = uniforms.double().clamp(SMALLEST_UNIFORM, 1.0 - SMALLEST_UNIFORM)
    normal: Tensor = torch.special.ndtri(kept)
    return normal.to(uniforms.dtype)


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Diagonal Gaussians over vectors of D numbers."""

    parameters: Tensor
    """Mean, then logarithm of the standard deviation, in units of the box, (B, 2 D)."""
    middle: Tensor
    """Middle between the bounds, (D,)."""
    half: Tensor
    """Half the way between them, (D,)."""

    @property
    def mean(self) -> Tensor:
        """Of the actions, (B, D)."""
        return self.middle + self.half * self.parameters.chunk(2, dim=-1)[0]

    @property
    def log_std(self) -> Tensor:
        """Logarithm of the actions' standard deviation, (B, D)."""
        return self.parameters.chunk(2, dim=-1)[1] + self.half.log()

    def sample(self, noise: Tensor) -> Tensor:
        """Actions (B, D), unbounded, by uniform numbers (B, D)."""
        return self.mean + self.log_std.exp() * standard_normal(noise)

    def draw(self, uniforms: NDArray[np.float64]) -> Tensor:
        """Actions (B, D), unbounded, by uniform numbers (B, D)."""
        normal = standard_normal(torch.from_numpy(uniforms))
        return (self.mean.double().cpu() + self.log_std.double().cpu().exp() * normal).to(self.parameters.dtype)

    def mode(self) -> Tensor:
        """The mean, (B, D)."""
        return self.mean

    def log_prob(self, actions: Tensor) -> Tensor:
        """Log density [nats] of unbounded ``actions`` (B, D), (B,)."""
        log_std = self.log_std
        scaled = (actions - self.mean) * torch.exp(-log_std)
        return -(0.5 * scaled.square() + log_std + 0.5 * math.log(2.0 * math.pi)).sum(dim=-1)

    def entropy(self) -> Tensor:
        """Differential entropy [nats] of the unbounded actions, (B,); negative for narrow ones."""
        return (self.log_std + 0.5 * math.log(2.0 * math.pi * math.e)).sum(dim=-1)

    def imitation_loss(self, expert: Tensor) -> Tensor:
        """Half the squared error of the mean against the expert's actions (B, D), in units of the box.

        That is the negative log density, but for a constant, at a standard deviation of half the range: it leaves the
        learned one alone. The density at the learned one would shrink it until nothing is left to explore with.
        """
        return 0.5 * self._error(expert).square().sum(dim=-1).mean()

    def agreement(self, expert: Tensor) -> Tensor:
        """Share of rows whose mean is within a tenth of half the range of the expert's action (B, D) throughout."""
        return (self._error(expert).abs() < CLOSE).all(dim=-1).float().mean()

    def diagnostics(self) -> dict[str, Tensor]:
        """The smallest standard deviation of a coordinate, as a share of half its range."""
        return {"action_std": self.parameters.chunk(2, dim=-1)[1].exp().flatten(0, -2).mean(dim=0).min()}

    def _error(self, expert: Tensor) -> Tensor:
        return self.parameters.chunk(2, dim=-1)[0] - (expert - self.middle) / self.half


class GaussianActor(nn.Module):
    """Network of the mean, and the logarithm of the standard deviation, which no state changes."""

    def __init__(self, inputs: int, hidden: int, size: int) -> None:
        super().__init__()
        self.mean = small_network(inputs, hidden, size, gain=0.01)
        self.log_std = nn.Parameter(torch.zeros(size))

    def forward(self, inputs: Tensor) -> Tensor:
        """Parameters (B, 2 D) of :class:`Gaussian`."""
        mean = self.mean(inputs)
        return torch.cat([mean, self.log_std.to(mean.dtype).expand_as(mean)], dim=-1)


class PreviousVector(nn.Module):
    """The previous action as the environment took it, in units of the box; zeros at the start of an episode."""

    centre: Tensor
    scale: Tensor

    def __init__(self, middle: Tensor, half: Tensor) -> None:
        super().__init__()
        self.register_buffer("centre", middle, persistent=False)
        self.register_buffer("scale", half, persistent=False)

    def forward(self, actions: Tensor, starts: Tensor) -> Tensor:
        """Features (B, D) in [-1, 1] of actions (B, D)."""
        return ((actions - self.centre) / self.scale).clamp(-1.0, 1.0).masked_fill(starts[..., None], 0.0)


class GaussianHead(ActionHead):
    """The head of :class:`BoxActions`."""

    dtype = torch.float32
    unlabelled = math.nan

    def __init__(self, spec: BoxActions) -> None:
        self.spec = spec
        self.size = self.noise_width = self.draw_width = self.previous_width = spec.size
        self.shape = (spec.size,)
        low, high = (torch.tensor(bound, dtype=torch.float64) for bound in (spec.low, spec.high))
        self.middle, self.half = 0.5 * (low + high), 0.5 * (high - low)

    def actor(self, inputs: int, hidden: int) -> nn.Module:
        """Network (B, inputs) -> (B, 2 D); its mean is near the middle at first."""
        return GaussianActor(inputs, hidden, self.size)

    def previous(self) -> nn.Module:
        """The vector itself."""
        return PreviousVector(self.middle.float(), self.half.float())

    def distribution(self, parameters: Tensor) -> Gaussian:
        """The distribution with mean and logarithm of the standard deviation (B, 2 D)."""
        return Gaussian(parameters, self.middle.to(parameters), self.half.to(parameters))

    def for_environment(self, actions: Tensor) -> Array:
        """The actions (B, D) float32, clipped to the bounds."""
        assert isinstance(self.spec, BoxActions)
        low, high = np.asarray(self.spec.low, np.float32), np.asarray(self.spec.high, np.float32)
        taken: NDArray[np.float32] = np.clip(actions.float().cpu().numpy(), low, high)
        return taken

    def exploration(self, share: float) -> Exploration:
        """A standard deviation below that share of half the range. Entropies of narrow Gaussians are no alarm."""
        text = "an action's standard deviation has been below {least:.3f} of half its range"
        return Exploration("action_std", share, text)
