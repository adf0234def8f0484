"""Reference agents: what any trained one is measured against, numbering actions as the simulator does.

All are functions of observations; none learns. The random, forward and goal-following agents are those of the Habitat
paper (Savva et al. 2019, section 4.1): each stops when its GPS puts it within the success distance of the goal, so
their scores measure moving, not stopping. The agents that feel their way (:mod:`prnav.domains.navigation.touch`) see
nothing either.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.contracts import Agent, Turn
from prnav.play import uniforms

STOP, FORWARD, LEFT, RIGHT = 0, 1, 2, 3


@dataclass(frozen=True)
class RandomNavigator:
    """Forward, left or right with equal chance; stops within ``stop_distance`` of the goal."""

    stop_distance: float = 0.2
    name: str = "random"
    actions: str = "sampled"

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,), drawn from (seed, episode, step) alone."""
        drawn = 1 + np.floor(3.0 * uniforms(turn.keys, turn.steps)).astype(np.int64)
        return np.where(arrived(turn, self.stop_distance), STOP, drawn)


@dataclass(frozen=True)
class ForwardAgent:
    """Always forward; stops within ``stop_distance`` of the goal."""

    stop_distance: float = 0.2
    name: str = "forward"
    actions: str = "rule"

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,)."""
        return np.where(arrived(turn, self.stop_distance), STOP, FORWARD)


@dataclass(frozen=True)
class GoalFollowerAgent:
    """Turns towards the goal when it lies more than ``max_bearing`` off, else goes forward; blind to walls."""

    stop_distance: float = 0.2
    max_bearing: float = np.pi / 12
    """Largest bearing at which it goes forward [rad]; 15 degrees, half a turn."""
    name: str = "goal-follower"
    actions: str = "rule"

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,)."""
        move = towards_goal(turn, self.max_bearing)
        return np.where(arrived(turn, self.stop_distance), STOP, move)


@dataclass(frozen=True)
class ShortestPathAgent:
    """The oracle: follows the shortest path as well as turns of a fixed angle allow. Asks the environment itself."""

    expert: Callable[[], NDArray[np.int64]]
    """Gives the oracle's action in every slot, as the simulator numbers them, shape (N,)."""
    name: str = "shortest-path"
    actions: str = "rule"

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,)."""
        return np.asarray(self.expert(), dtype=np.int64)


def arrived(turn: Turn, stop_distance: float) -> NDArray[np.bool_]:
    """Who should stop, (N,): nobody in a task that shows no goal, since it has no stop either."""
    if "pointgoal" not in turn.observations:
        return np.zeros(len(turn.active), np.bool_)
    return turn.observations["pointgoal"][:, 0] < stop_distance


def towards_goal(turn: Turn, max_bearing: float) -> NDArray[np.int64]:
    """Forward where the goal lies within ``max_bearing`` [rad] of ahead, else a turn towards it, (N,)."""
    bearing = turn.observations["pointgoal"][:, 1]
    return np.where(np.abs(bearing) <= max_bearing, FORWARD, np.where(bearing > 0, LEFT, RIGHT))


@dataclass(frozen=True)
class InTaskNumbers:
    """An agent whose actions are numbered as the simulator does, in a task that numbers them otherwise."""

    agent: Agent
    first_action: int
    """The simulator's number of the task's action 0."""

    @property
    def name(self) -> str:
        """The agent's name."""
        return self.agent.name

    @property
    def actions(self) -> str:
        """How it chooses."""
        return self.agent.actions

    def act(self, turn: Turn) -> NDArray[np.int64]:
        """Actions (N,); one that the task lacks becomes its first."""
        return np.maximum(self.agent.act(turn) - self.first_action, 0)
