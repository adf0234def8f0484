"""The design policy: a diagonal Gaussian over designs, and its policy gradient. Pure NumPy, no environment.

Source: the paper, sections "Design Policy" and "Design Optimization" (appendix): mean 0 and standard deviation 0.2 in
the normalised space, one design action per episode, the return being the episode's SoftSPL. Letters in shapes: B
episodes, n free coordinates of a design, C covariates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, JSONObject
from prnav.checks import require_positive

Float64 = NDArray[np.float64]

_BETA_1, _BETA_2, _EPSILON = 0.9, 0.999, 1e-8


@dataclass(frozen=True)
class DesignPolicyConfig:
    """The Gaussian and how it learns. The paper gives mean and standard deviation; on the rest it is silent."""

    std: float = 0.2
    """Standard deviation of each coordinate at the start, in normalised units."""
    learn_std: bool = True
    """Whether the standard deviations are learnt too (phi = (mu, sigma) in the paper)."""
    std_min: float = 0.05
    std_max: float = 0.4
    estimator: Literal["ppo", "reinforce"] = "ppo"
    """"ppo": several clipped steps on a batch of episodes; "reinforce": one step along the score function."""
    epochs: int = 4
    """Gradient steps on a batch ("ppo")."""
    learning_rate: float = 0.02
    """Of Adam, in normalised units: about how far a coordinate of the mean moves in one gradient step."""
    std_learning_rate: float = 0.01
    """Of the logarithm of the standard deviations."""
    clip: float = 0.2
    baseline: Literal["mean", "covariates"] = "covariates"
    """What is subtracted from an episode's score: the batch's mean, or what a linear fit on the episode's covariates
    (its distance) expects. Both leave the gradient's mean alone; the second has less noise."""

    def __post_init__(self) -> None:
        require_positive(self, "std", "std_min", "std_max", "learning_rate", "std_learning_rate", "clip")
        if not self.std_min <= self.std <= self.std_max:
            raise ValueError(
                f"std is {self.std}; it must lie within std_min ({self.std_min}) and std_max ({self.std_max})"
            )
        if self.epochs < 1:
            raise ValueError(f"epochs is {self.epochs}; it must be at least 1")


def log_probability(values: Float64, mean: Float64, log_std: Float64) -> Float64:
    """Log density of designs (B, n) under a Gaussian with mean (n,) and log standard deviations (n,): (B,)."""
    scaled = (values - mean) * np.exp(-log_std)
    density: Float64 = -0.5 * (scaled**2).sum(axis=-1) - log_std.sum() - 0.5 * len(mean) * np.log(2.0 * np.pi)
    return density


def advantages(scores: Float64, covariates: Float64 | None = None) -> Float64:
    """Scores (B,) less what is expected of their episodes, scaled to variance 1 (0 where they do not differ).

    Args:
        scores: one per episode.
        covariates: (B, C) facts of the episodes that do not depend on the design; None expects the mean.
    """
    columns = [np.ones((len(scores), 1))]
    if covariates is not None and len(scores) > 2 * (covariates.shape[1] + 1):
        columns.append(covariates)
    matrix = np.concatenate(columns, axis=1)
    expected = matrix @ np.linalg.lstsq(matrix, scores, rcond=None)[0]
    rest = scores - expected
    spread = float(rest.std())
    return rest / spread if spread > 1e-9 else np.zeros_like(rest)


def policy_gradient(
    values: Float64,
    advantage: Float64,
    old_log_probs: Float64,
    mean: Float64,
    log_std: Float64,
    clip: float | None,
) -> tuple[Float64, Float64]:
    """Gradient of the surrogate objective with respect to mean (n,) and log standard deviations (n,); ascend it.

    The objective is mean(min(r A, clip(r) A)), r the ratio of densities now and when the designs were drawn; without
    ``clip`` it is mean(r A), whose gradient at r = 1 is REINFORCE's.

    Args:
        values: designs that were played, (B, n).
        advantage: (B,), from :func:`advantages`.
        old_log_probs: of the designs when they were drawn, (B,).
        mean: of the policy now.
        log_std: of the policy now.
        clip: PPO's epsilon, or None.
    """
    ratio = np.exp(np.clip(log_probability(values, mean, log_std) - old_log_probs, -20.0, 20.0))
    weight = ratio * advantage
    if clip is not None:
        active = np.where(advantage >= 0.0, ratio <= 1.0 + clip, ratio >= 1.0 - clip)
        weight = np.where(active, weight, 0.0)
    scaled = (values - mean) * np.exp(-log_std)
    count = max(1, len(values))
    return weight @ (scaled * np.exp(-log_std)) / count, weight @ (scaled**2 - 1.0) / count


class DesignPolicy:
    """A Gaussian over the n free coordinates of a design; its mean is the design that is found."""

    def __init__(self, config: DesignPolicyConfig, size: int) -> None:
        self.config = config
        self.mean = np.zeros(size)
        self.log_std = np.full(size, np.log(config.std))
        self._moments = np.zeros((2, 2 * size))
        self._steps = 0

    @property
    def std(self) -> Float64:
        """Standard deviations, (n,)."""
        std: Float64 = np.exp(self.log_std)
        return std

    def sample(self, noise: Float64) -> tuple[Float64, Float64]:
        """Designs (B, n) from standard normal numbers (B, n), and their log densities (B,)."""
        values = self.mean + self.std * noise
        return values, log_probability(values, self.mean, self.log_std)

    def update(
        self, values: Float64, scores: Float64, old_log_probs: Float64, covariates: Float64 | None = None
    ) -> dict[str, float]:
        """Learn from B played designs (B, n) and their scores (B,); what to log. Nothing happens without episodes."""
        config = self.config
        before = self.mean.copy()
        if len(scores) > 1:
            advantage = advantages(scores, covariates if config.baseline == "covariates" else None)
            clip, epochs = (config.clip, config.epochs) if config.estimator == "ppo" else (None, 1)
            for _ in range(epochs):
                gradients = policy_gradient(values, advantage, old_log_probs, self.mean, self.log_std, clip)
                self._ascend(np.concatenate(gradients))
        return {
            "design_episodes": float(len(scores)),
            "design_score": float(scores.mean()) if len(scores) else 0.0,
            "design_step": float(np.linalg.norm(self.mean - before)),
            "design_moved": float(np.linalg.norm(self.mean)),
            "design_std": float(self.std.mean()) if len(self.log_std) else 0.0,
        }

    def _ascend(self, gradient: Float64) -> None:
        """One step of Adam (Kingma and Ba 2015) up the gradient."""
        size, config = len(self.mean), self.config
        self._steps += 1
        self._moments[0] = _BETA_1 * self._moments[0] + (1.0 - _BETA_1) * gradient
        self._moments[1] = _BETA_2 * self._moments[1] + (1.0 - _BETA_2) * gradient**2
        first = self._moments[0] / (1.0 - _BETA_1**self._steps)
        second = self._moments[1] / (1.0 - _BETA_2**self._steps)
        step = first / (np.sqrt(second) + _EPSILON)
        self.mean = self.mean + config.learning_rate * step[:size]
        if config.learn_std:
            low, high = np.log(config.std_min), np.log(config.std_max)
            self.log_std = np.clip(self.log_std + config.std_learning_rate * step[size:], low, high)

    def state_dict(self) -> JSONObject:
        """All that the policy's future depends on."""
        return {"mean": self.mean, "log_std": self.log_std, "moments": self._moments, "steps": self._steps}

    def load_state_dict(self, state: Mapping[str, JSON]) -> None:
        """Resume from :meth:`state_dict`."""
        self.mean, self.log_std = np.array(state["mean"]), np.array(state["log_std"])
        self._moments, self._steps = np.array(state["moments"]), int(state["steps"])
