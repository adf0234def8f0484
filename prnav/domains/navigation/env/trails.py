"""The ways that agents took in their present episodes, kept for pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Trails:
    """Where each of N agents was before every step of its episode and is now."""

    def __init__(self, count: int) -> None:
        """Nobody has been anywhere."""
        self._positions: list[list[NDArray[np.float64]]] = [[] for _ in range(count)]
        self._collisions: list[list[bool]] = [[] for _ in range(count)]

    def begin(self, agents: NDArray[np.int64], positions: NDArray[np.float64]) -> None:
        """Agents (n,) start where they stand now; positions of all (N, 3) [m]."""
        for agent in agents.tolist():
            self._positions[agent], self._collisions[agent] = [positions[agent].copy()], []

    def go(self, positions: NDArray[np.float64], collided: NDArray[np.bool_]) -> None:
        """All took a step and stand at (N, 3) [m]; ``collided`` (N,) says who hit something."""
        for agent, position in enumerate(positions):
            self._positions[agent].append(position.copy())
            self._collisions[agent].append(bool(collided[agent]))

    def of(self, agent: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Positions (T + 1, 3) [m] and collisions (T,) of an agent's episode so far."""
        return np.array(self._positions[agent]).reshape(-1, 3), np.array(self._collisions[agent], np.bool_)
