"""Agents as arrays: where they stand, where they look, and what an action does to that.

Shapes: N agents, n <= N of them named by their slots. Positions are metres, yaws radians, both float64.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.frames import forward, wrap_angle
from prnav.sim.world import World

HOLD, STOP, FORWARD, LEFT, RIGHT = -1, 0, 1, 2, 3
"""Actions, numbered as in Habitat; HOLD leaves an agent untouched."""


@dataclass(frozen=True)
class SimConfig:
    """How agents move (paper, appendix "PointGoal Navigation Setting", Action Space)."""

    forward_step: float = 0.25
    """Length of a step forward [m]."""
    turn_angle_deg: float = 30.0
    sliding: bool = True
    """Whether a step against a wall goes on along it, as in Habitat's default."""

    def __post_init__(self) -> None:
        if not self.forward_step > 0:
            raise ValueError(f"forward_step is {self.forward_step}; it must be above 0 m")
        if not 0 < self.turn_angle_deg <= 180:
            raise ValueError(f"turn_angle_deg is {self.turn_angle_deg}; it must be above 0 and at most 180")

    @property
    def turn_angle(self) -> float:
        """Turn angle [rad]."""
        return float(np.deg2rad(self.turn_angle_deg))

    @property
    def turns_in_circle(self) -> int:
        """How many turns make a full circle; 0 where no whole number does."""
        count = round(360.0 / self.turn_angle_deg)
        return count if abs(count * self.turn_angle_deg - 360.0) < 1e-9 else 0


class Simulator:
    """N agents in any mix of a world's scenes; rows do not influence each other.

    Yaws are counted in turns from the yaw at reset, so that a heading an agent comes back to is the same to the bit:
    otherwise a step that grazes a wall could hit it after a full circle where it passed before.
    """

    def __init__(self, world: World, num_agents: int, config: SimConfig = SimConfig()):  # noqa: B008 (frozen)
        self.world = world
        self.config = config
        self.num_agents = num_agents
        self.positions = np.zeros((num_agents, 3))  #: feet [m], (N, 3)
        self.yaws = np.zeros(num_agents)  #: [rad] in [-pi, pi), (N,)
        self.start_yaws = np.zeros(num_agents)  #: at the last reset [rad], (N,)
        self.turns = np.zeros(num_agents, np.int64)  #: made to the left since then, modulo a full circle, (N,)
        self.scene_index = np.zeros(num_agents, np.int64)  #: index into the world's scenes, (N,)
        self.collided = np.zeros(num_agents, np.bool_)  #: whether the last action hit something, (N,)

    def reset(self, slots: ArrayLike, scene_index: ArrayLike, positions: ArrayLike, yaws: ArrayLike) -> None:
        """Put the agents in ``slots`` (n,) at positions (n, 3) and yaws (n,) in scenes (n,)."""
        slots = np.asarray(slots, np.int64)
        self.scene_index[slots] = scene_index
        self.positions[slots] = positions
        self.start_yaws[slots] = yaws
        self.turns[slots] = 0
        self.yaws[slots] = wrap_angle(yaws)
        self.collided[slots] = False

    def step(self, actions: ArrayLike) -> NDArray[np.float64]:
        """Carry out one action per agent, (N,); the distance that each moved, (N,) [m]."""
        actions = np.asarray(actions)
        self.collided[:] &= actions == HOLD
        turning = np.flatnonzero((actions == LEFT) | (actions == RIGHT))
        if len(turning):
            turns = self._modulo(self.turns[turning] + np.where(actions[turning] == LEFT, 1, -1))
            self.turns[turning] = turns
            self.yaws[turning] = wrap_angle(self.start_yaws[turning] + turns * self.config.turn_angle)
        moved = np.zeros(self.num_agents)
        walking = np.flatnonzero(actions == FORWARD)
        if len(walking):
            starts = self.positions[walking]
            ends = starts + self.config.forward_step * forward(self.yaws[walking])
            reached, collided = self.world.navmesh_set.step(
                self.scene_index[walking], starts, ends, sliding=self.config.sliding
            )
            self.positions[walking] = reached
            self.collided[walking] = collided
            moved[walking] = np.linalg.norm(reached - starts, axis=1)
        return moved

    def yaws_after(self, slots: NDArray[np.int64], turns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Yaws [rad] of agents (n,) after so many turns to the left (n,), exactly as :meth:`step` would make them."""
        turns = self._modulo(self.turns[slots] + turns)
        return wrap_angle(self.start_yaws[slots] + turns * self.config.turn_angle)

    def _modulo(self, turns: NDArray[np.int64]) -> NDArray[np.int64]:
        circle = self.config.turns_in_circle
        return turns % circle if circle else turns

    def snapshot(self) -> dict[str, NDArray[np.generic]]:
        """Copies of all state arrays, for a checkpoint."""
        names = ("positions", "yaws", "start_yaws", "turns", "scene_index", "collided")
        return {name: getattr(self, name).copy() for name in names}

    def restore(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Take over arrays from :meth:`snapshot`."""
        for name, value in state.items():
            getattr(self, name)[:] = value
