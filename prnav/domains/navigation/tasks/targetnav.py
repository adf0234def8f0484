"""TargetNav's rules as functions of arrays (paper, appendix "Target Navigation Setting").

A green sphere hangs over the goal; the agent is not told where. There is no stop action: coming near ends the episode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class TargetNavConfig:
    """The paper's numbers.

    The sphere is found when the agent ends a step within ``success_distance`` of the goal under it. "Within" is the
    geodesic distance, as in PointGoalNav: an agent on the other side of a wall, or on another floor, is not there.
    """

    success_distance: float = 0.8
    """[m]"""
    max_steps: int = 1500
    success_reward: float = 2.5
    """Paid on the step that ends at the sphere, on top of what the step itself earns."""
    slack: float = 0.003
    """Cost of each step, c^slack in the paper."""
    radius: float = 0.5
    """Of the sphere [m]."""
    height: float = 1.5
    """Of the sphere's centre above the goal on the floor [m]."""
    visible: bool = True
    """False takes the sphere out of sight and leaves all else as it is: does the agent go by what it sees?"""

    def __post_init__(self) -> None:
        for name in ("success_distance", "radius"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name)}; it must be above 0 m")
        if self.max_steps < 1:
            raise ValueError(f"max_steps is {self.max_steps}; it must be at least 1")


def succeeded(distance: Floats, config: TargetNavConfig) -> Bools:
    """Whether agents (N,) are at the sphere, given geodesic distances to the goal under it [m]."""
    return distance <= config.success_distance


def reward(success: Bools, before: Floats, after: Floats, config: TargetNavConfig) -> Floats:
    """Reward of a step, (N,): ``d_t - d_{t+1} - slack``, and 2.5 more on the step that finds the sphere.

    Args:
        success: whether the episode succeeded with this step.
        before: geodesic distance to the goal before the step [m].
        after: the same after it.
        config: the numbers.
    """
    return before - after - config.slack + config.success_reward * success


def spheres(goals: ArrayLike, config: TargetNavConfig) -> Floats:
    """Centres and radii [m] of the spheres over goals (N, 3), (N, 4); radius 0 where they are invisible."""
    goals = np.asarray(goals, np.float64)
    radii = np.full((len(goals), 1), config.radius if config.visible else 0.0)
    return np.concatenate([goals + [0.0, config.height, 0.0], radii], axis=1)
