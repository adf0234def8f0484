"""The interface that the evaluator needs of an environment: slots that are handed episodes one by one.

It knows neither navmeshes nor sensors: observations are a mapping of arrays, an outcome is a row of named numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

HOLD = -1
"""Action that leaves an idle slot untouched."""


class EpisodeSlots(Protocol):
    """N slots, each playing one episode of a list at a time."""

    num_slots: int

    @property
    def episode_ids(self) -> Sequence[tuple[str, str]]:
        """(scene_id, episode_id) of every episode that can be begun, in the order of the list."""
        ...

    @property
    def positions(self) -> NDArray[np.float64]:
        """Where the agents stand [m], shape (N, 3)."""
        ...

    @property
    def yaws(self) -> NDArray[np.float64]:
        """Where they look [rad], shape (N,)."""
        ...

    @property
    def collided(self) -> NDArray[np.bool_]:
        """Whether their last step hit something, shape (N,)."""
        ...

    def begin(self, slots: NDArray[np.int64], episodes: NDArray[np.int64]) -> None:
        """Put slots (n,) at the starts of the episodes with these indices (n,)."""
        ...

    def observe(self, slots: NDArray[np.int64]) -> Mapping[str, NDArray[Any]]:
        """Observations of slots (n,), each (n, ...)."""
        ...

    def advance(self, actions: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Take one step in each slot, none where the action is HOLD; True where the episode ended, shape (N,)."""
        ...

    def outcome(self, slot: int) -> dict[str, Any]:
        """Measures and facts of the episode that just ended in a slot: names to numbers and strings."""
        ...
