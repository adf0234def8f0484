"""Warm start from an oracle: DAgger (Ross et al. 2011) through the policy.

Each step is taken by the oracle with a probability that falls over the phase, else by the policy; the oracle labels
every state that is visited, and the policy learns its labels by its action head's loss (cross-entropy, or the
squared error of the mean). The critic learns the returns of the
same rollouts: when the phase ends they are almost the policy's own, so that PPO takes over with a critic that knows
what the policy is worth, and does not unlearn it. This goes beyond the paper and is off by default.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from prnav.checks import require_at_least, require_positive, require_share
from prnav.policy import ActionDistribution
from prnav.train.ppo import Batch, Losses, value_loss


@dataclass(frozen=True)
class ImitationConfig:
    """The warm start's length and pace."""

    steps: int = 0
    """Steps of the run that are spent on it, counted in the run's total; 0 is off."""
    epochs: int = 1
    mini_batches: int = 2
    learning_rate: float = 1e-3
    expert_start: float = 1.0
    """Share of steps taken by the oracle when the phase begins."""
    expert_end: float = 0.0
    """Share of steps taken by the oracle when it ends; it falls linearly."""
    value_coefficient: float = 0.5
    max_grad_norm: float = 1.0

    def __post_init__(self) -> None:
        if self.steps < 0:
            raise ValueError(f"steps is {self.steps}; it must be 0 (no warm start) or more")
        require_at_least(self, 1, "epochs", "mini_batches")
        require_share(self, "expert_start", "expert_end")
        require_positive(self, "learning_rate", "max_grad_norm")
        if self.value_coefficient < 0.0:
            raise ValueError(f"value_coefficient is {self.value_coefficient}; it must be 0 or more")


def expert_share(config: ImitationConfig, step: int) -> float:
    """Share of steps that the oracle takes after ``step`` steps of the run."""
    progress = min(1.0, step / max(1, config.steps))
    return config.expert_start + (config.expert_end - config.expert_start) * progress


def imitation_loss(distribution: ActionDistribution, values: Tensor, batch: Batch, config: ImitationConfig) -> Losses:
    """Loss of a batch and its parts.

    Args:
        distribution: Of the policy as it is now, M of them.
        values: Of the critic as it is now, (M,).
        batch: "expert" (the oracle's actions, (M, ...)), "values" and "returns" of the rollout, each (M,).
        config: Coefficients.
    """
    imitation = distribution.imitation_loss(batch["expert"])
    value = value_loss(values, batch["values"], batch["returns"])
    with torch.no_grad():
        parts = {
            "imitation_loss": imitation,
            "value_loss": value,
            "entropy": distribution.entropy().mean(),
            "agreement": distribution.agreement(batch["expert"]),
            **distribution.diagnostics(),
        }
    return imitation + config.value_coefficient * value, {name: part.detach() for name, part in parts.items()}
