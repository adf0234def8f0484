"""Reference agents by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from prnav.domains.navigation.touch import BlindAgent, WallFollowerAgent
from prnav.errors import ConfigError
from prnav.evaluate.agents import Agent, ForwardAgent, GoalFollowerAgent, RandomAgent, ShortestPathAgent

REFERENCE_AGENTS: tuple[str, ...] = ("shortest-path", "random", "forward", "goal-follower", "wall-follower", "blind")

NEEDS_GOAL: tuple[str, ...] = ("goal-follower",)
"""Agents that can do nothing in a task that shows no goal."""


def reference_agent(
    name: str,
    expert: Callable[[], NDArray[np.int64]],
    *,
    task: str = "pointgoal",
    num_slots: int = 1,
    forward_step: float = 0.25,
    stop_distance: float = 0.2,
) -> Agent:
    """Agent of that name from :data:`REFERENCE_AGENTS`; ``expert`` is used by the shortest-path agent alone.

    Raises:
        ConfigError: the task does not tell what this agent needs.
    """
    if task == "targetnav" and name in NEEDS_GOAL:
        valid = ", ".join(agent for agent in REFERENCE_AGENTS if agent not in NEEDS_GOAL)
        raise ConfigError(f"agent {name!r} needs a goal, and targetnav shows none; valid there: {valid}")
    match name:
        case "shortest-path":
            return ShortestPathAgent(expert)
        case "random":
            return RandomAgent(stop_distance)
        case "forward":
            return ForwardAgent(stop_distance)
        case "goal-follower":
            return GoalFollowerAgent(stop_distance)
        case "wall-follower":
            return WallFollowerAgent(num_slots, forward_step, stop_distance)
        case "blind":
            return BlindAgent(num_slots, forward_step, stop_distance)
    raise ConfigError(f"agent {name!r} is not known; valid: {', '.join(REFERENCE_AGENTS)}")
