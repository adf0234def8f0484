"""PointGoalNav's rules as functions of arrays (paper, appendix "PointGoal Navigation Setting")."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class PointGoalConfig:
    """The paper's numbers.

    A goal counts as reached when the agent stops within ``success_distance`` of it. "Within" is the geodesic distance,
    as in Habitat, so that stopping behind a wall from the goal is no success.
    """

    success_distance: float = 0.2
    """[m]"""
    max_steps: int = 500
    success_reward: float = 2.5
    slack: float = 0.003
    """Cost of each step, c^slack in the paper."""

    def __post_init__(self) -> None:
        if not self.success_distance > 0:
            raise ValueError(f"success_distance is {self.success_distance}; it must be above 0 m")
        if self.max_steps < 1:
            raise ValueError(f"max_steps is {self.max_steps}; it must be at least 1")


def succeeded(stopped: Bools, distance: Floats, config: PointGoalConfig) -> Bools:
    """Whether agents (N,) that ``stopped`` did so within reach of their goals, given geodesic distances [m]."""
    return stopped & (distance <= config.success_distance)


def reward(stopped: Bools, success: Bools, before: Floats, after: Floats, config: PointGoalConfig) -> Floats:
    """Reward of a step, (N,): ``2.5 * success`` for stop, else ``d_t - d_{t+1} - slack``.

    Args:
        stopped: whether the action was stop.
        success: whether the episode succeeded with it.
        before: geodesic distance to the goal before the step [m].
        after: the same after it.
        config: the numbers.
    """
    progress = np.where(stopped, 0.0, before - after)
    return np.where(stopped, config.success_reward * success, progress - config.slack)
