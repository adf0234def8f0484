"""Reference agents that feel their way: without light, they notice walls because GPS says that a step fell short.

They bound what can be had without seeing: a trained agent that sees should beat them, and so should a trained blind
one. N slots; agents remember, so each belongs to the slots it was made for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prnav.contracts import Turn
from prnav.domains.navigation.agents import FORWARD, LEFT, RIGHT, STOP, arrived, towards_goal
from prnav.play import uniforms

Bools = NDArray[np.bool_]
Integers = NDArray[np.int64]

BLOCKED, GRAZED = 0.5, 0.95
"""Shares of a full step below which one was blocked, or slid along a wall."""

CIRCLE = 12
"""Turns to the right with a free step after each, after which a wall is given up as lost."""


class Feeler:
    """What the last step of each slot met, told from GPS alone."""

    def __init__(self, num_slots: int, forward_step: float) -> None:
        self.step = forward_step
        self.last = np.full(num_slots, STOP, np.int64)
        self.place = np.zeros((num_slots, 2))

    def feel(self, turn: Turn) -> tuple[Bools, Bools]:
        """Whether the last action was a step that was blocked, or one that met nothing, (N,) each."""
        place = np.asarray(turn.observations["gps"], np.float64)
        moved = np.hypot(*(place - self.place).T) / self.step
        walked = (self.last == FORWARD) & ~turn.starts
        self.place = place
        return walked & (moved < BLOCKED), walked & (moved >= GRAZED)

    def keep(self, actions: Integers) -> Integers:
        """Remember what is done now."""
        self.last = actions
        return actions


class _Wall:
    """The right-hand rule: turn left at a wall, and back to the right after each free step, to stay beside it."""

    def __init__(self, num_slots: int) -> None:
        self.following = np.zeros(num_slots, np.bool_)
        self.rights = np.zeros(num_slots, np.int64)

    def follow(self, starts: Bools, last: Integers, blocked: Bools, free: Bools) -> Integers:
        """What to do to stay beside the wall, (N,); straight ahead where there is none yet."""
        self.following = (self.following & ~starts) | blocked
        self.rights = np.where(starts | blocked, 0, self.rights + ((last == RIGHT) & self.following))
        lost = self.rights > CIRCLE
        self.following &= ~lost
        self.rights[lost] = 0
        return np.where(blocked, LEFT, np.where(free & self.following, RIGHT, FORWARD))


class WallFollowerAgent:
    """Straight ahead to the first wall, then along it with the wall on the right; stops within reach of the goal."""

    name = "wall-follower"
    actions = "rule"

    def __init__(self, num_slots: int, forward_step: float = 0.25, stop_distance: float = 0.2) -> None:
        self.stop_distance = stop_distance
        self.feeler, self.wall = Feeler(num_slots, forward_step), _Wall(num_slots)

    def act(self, turn: Turn) -> Integers:
        """Actions (N,)."""
        blocked, free = self.feeler.feel(turn)
        move = self.wall.follow(turn.starts, self.feeler.last, blocked, free)
        return self.feeler.keep(np.where(arrived(turn, self.stop_distance), STOP, move))


class BlindAgent:
    """What rules can do without light.

    Told a goal, it heads there; at a wall it follows the wall until it is nearer to the goal than where it met it
    (after Lumelsky and Stepanov's bug algorithms, 1987). Told none, it goes straight on, and at a wall turns by two
    to five turns to a side that it draws.
    """

    name = "blind"
    actions = "rule"

    def __init__(self, num_slots: int, forward_step: float = 0.25, stop_distance: float = 0.2) -> None:
        self.stop_distance = stop_distance
        self.feeler, self.wall = Feeler(num_slots, forward_step), _Wall(num_slots)
        self.met_at = np.zeros(num_slots)  #: distance to the goal where the wall was met [m]
        self.pending = np.zeros(num_slots, np.int64)  #: turns still to make, left is positive

    def act(self, turn: Turn) -> Integers:
        """Actions (N,)."""
        blocked, free = self.feeler.feel(turn)
        move = self._seek(turn, blocked, free) if "pointgoal" in turn.observations else self._roam(turn, blocked)
        return self.feeler.keep(move)

    def _seek(self, turn: Turn, blocked: Bools, free: Bools) -> Integers:
        distance = np.asarray(turn.observations["pointgoal"][:, 0], np.float64)
        self.met_at = np.where(blocked & ~self.wall.following, distance, self.met_at)
        along = self.wall.follow(turn.starts, self.feeler.last, blocked, free)
        leaving = self.wall.following & free & (distance < self.met_at - self.feeler.step)
        self.wall.following &= ~leaving
        move = np.where(self.wall.following, along, towards_goal(turn, np.pi / 12))
        return np.where(arrived(turn, self.stop_distance), STOP, move)

    def _roam(self, turn: Turn, blocked: Bools) -> Integers:
        drawn = np.floor(8.0 * uniforms(turn.keys, turn.steps)).astype(np.int64)  # a side, and 2 to 5 turns
        turns = (2 + drawn // 2) * np.where(drawn % 2 == 0, 1, -1)
        self.pending = np.where(turn.starts, 0, np.where(blocked, turns, self.pending))
        move = np.where(self.pending == 0, FORWARD, np.where(self.pending > 0, LEFT, RIGHT))
        self.pending -= np.sign(self.pending)
        return move
