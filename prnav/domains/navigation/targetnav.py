"""TargetNav: find a green sphere that hangs over the goal, without being told where it is.

The paper, appendix "Target Navigation Setting". There is no stop action: coming near ends the episode.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.single_env import NavigationEnv
from prnav.domains.navigation.env.vector_env import NavigationVectorEnv
from prnav.domains.navigation.rules import Bools, Floats, TaskKind, Verdict
from prnav.domains.navigation.spec import NavigationTask


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


def judge(rules: TargetNavConfig, stopped: Bools, before: Floats, after: Floats) -> Verdict:
    """Judge a step that began at geodesic distances ``before`` (N,) [m] and ended at ``after``; nobody can stop."""
    success = succeeded(after, rules)
    return Verdict(success, reward(success, before, after, rules), success)


@dataclass(frozen=True)
class TargetNavEnvConfig(NavigationConfig):
    """Settings of a TargetNav environment. Its training homes are ten of the built-in ones, as the paper's are."""

    renamed_keys: ClassVar[Mapping[str, str]] = {**NavigationConfig.renamed_keys, "targetnav": "rules"}
    kind: ClassVar[TaskKind] = TaskKind("targetnav", has_stop=False, shows_goal=False, judge=judge, spheres=spheres)
    ten_homes: ClassVar[bool] = True
    rules: TargetNavConfig = field(default_factory=TargetNavConfig)


class TargetNavEnv(NavigationEnv):
    """One TargetNav agent.

    Actions are 0 forward 0.25 m, 1 left and 2 right by 30 degrees; there is no stop, and no goal among the
    observations. An episode is terminated where the agent is within 0.8 m of the green sphere, and truncated after
    1,500 steps.
    """

    config_type = TargetNavEnvConfig


class TargetNavVectorEnv(NavigationVectorEnv):
    """N TargetNav agents: ``gymnasium.make_vec("prnav/TargetNav-v0")``."""

    config_type = TargetNavEnvConfig


SPEC = NavigationTask(TargetNavEnvConfig, preset="quickstart-targetnav", score="success")
