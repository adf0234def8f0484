"""PointGoalNav: go to a place that is told by distance and bearing, and stop there.

The paper, appendix "PointGoal Navigation Setting".
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.single_env import NavigationEnv
from prnav.domains.navigation.env.vector_env import NavigationVectorEnv
from prnav.domains.navigation.rules import Bools, Floats, TaskKind, Verdict
from prnav.domains.navigation.spec import NavigationTask


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


def judge(rules: PointGoalConfig, stopped: Bools, before: Floats, after: Floats) -> Verdict:
    """Judge a step that began at geodesic distances ``before`` (N,) [m] and ended at ``after``."""
    success = succeeded(stopped, after, rules)
    return Verdict(success, reward(stopped, success, before, after, rules), stopped)


@dataclass(frozen=True)
class PointGoalEnvConfig(NavigationConfig):
    """Settings of a PointGoalNav environment."""

    kind: ClassVar[TaskKind] = TaskKind("pointgoal", has_stop=True, shows_goal=True, judge=judge)
    rules: PointGoalConfig = field(default_factory=PointGoalConfig)


class PointGoalNavEnv(NavigationEnv):
    """One PointGoalNav agent.

    Actions are 0 stop, 1 forward 0.25 m, 2 left and 3 right by 30 degrees. An episode is terminated by stop and
    truncated after 500 steps.
    """

    config_type = PointGoalEnvConfig


class PointGoalNavVectorEnv(NavigationVectorEnv):
    """N PointGoalNav agents: ``gymnasium.make_vec("prnav/PointGoalNav-v0")``."""

    config_type = PointGoalEnvConfig


SPEC = NavigationTask(PointGoalEnvConfig, preset="quickstart")
