"""Working memory of shortest-path searches, one per search that runs.

Compiled searches let other threads run meanwhile, so two of them must never write to the same arrays. A
:class:`ScratchPool` lends each search memory of its own and keeps it for the next one.

Before: :mod:`.surface`. After: :mod:`.geodesic`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.errors import NavMeshError
from prnav.navmesh.surface import Surface

FIRST_WINDOWS = 4096  #: windows a search has room for at first; doubled whenever one needs more
MOST_WINDOWS = 1 << 26  #: a search that needs more is taken for a broken mesh

WINDOWS, HEAP, ROOTS, STAMP = 0, 1, 2, 3  #: entries of :attr:`Scratch.counts`


class Scratch(NamedTuple):
    """What one search writes: W windows and roots at most, F fans, P polygons of the largest scene, Q of all."""

    nodes: NDArray[np.int32]  #: of each window: the corner whose edge it is on, its root, 1 where it was forced, (W, 3)
    ends: NDArray[np.float64]  #: its interval along that edge, 0 to 1, (W, 2)
    key: NDArray[np.float64]  #: length of the shortest way that it could stand for [m], (W,)
    heap: NDArray[np.int32]  #: windows to be looked at, a binary heap by ``key``, (W,)
    taken: NDArray[np.int32]  #: windows in the order in which a search without a target expanded them, (W,)
    roots: NDArray[np.float64]  #: x, y, z [m], cost in the ground plane [m], length in space [m], (W, 5)
    links: NDArray[np.int32]  #: of each root: the root before it (-1 for none) and its fan (-1 for none), (W, 2)
    fan_stamp: NDArray[np.int64]  #: the search that last wrote to a fan, (F,)
    fan_root: NDArray[np.int32]  #: the best root at a fan's corner, -1 for none, (F,)
    bound: NDArray[np.float64]  #: cost of the best known way to a fan's corner [m], (F,)
    reached: NDArray[np.int64]  #: the search that last reached a polygon, (P,)
    entry: NDArray[np.int32]  #: the window through which a polygon was first reached, -1 for the start's, (Q,)
    around: NDArray[np.int64]  #: the search and root that last went around a vertex of a polygon, (Q,)
    counts: NDArray[np.int64]
    """Windows made, windows in the heap, roots made, and the stamp of the search, by which it tells its own entries
    from those of earlier ones, (4,)."""


class ScratchPool:
    """Working memory for searches on one surface; safe to use from several threads, without a lock.

    It keeps as many pieces as searches have ever run at once.
    """

    def __init__(self, surface: Surface):
        self.surface = surface
        self._idle: list[Scratch] = []  # list.pop and list.append are atomic

    def take(self) -> Scratch:
        """Memory that nobody else uses until it is given back."""
        try:
            return self._idle.pop()
        except IndexError:
            return _new_scratch(self.surface)

    def give_back(self, scratch: Scratch) -> None:
        """Let others use memory that was taken."""
        self._idle.append(scratch)

    def __reduce__(self) -> tuple[type[ScratchPool], tuple[Surface]]:
        """Copies begin empty."""
        return ScratchPool, (self.surface,)


def grown(scratch: Scratch) -> Scratch:
    """The same with room for twice as many windows, whose old content is lost.

    Raises:
        NavMeshError: there is no end to it.
    """
    windows = 2 * len(scratch.taken)
    if windows > MOST_WINDOWS:
        raise NavMeshError(f"a shortest-path search needs more than {MOST_WINDOWS} windows; the mesh is broken")
    return scratch._replace(**_window_arrays(windows))


def _new_scratch(surface: Surface) -> Scratch:
    fans = int(np.diff(surface.scene_fan).max(initial=0))
    polygons = int(np.diff(surface.scene_polygon).max(initial=0))
    return Scratch(
        **_window_arrays(FIRST_WINDOWS),
        fan_stamp=np.zeros(fans, np.int64),
        fan_root=np.zeros(fans, np.int32),
        bound=np.zeros(fans),
        reached=np.zeros(polygons, np.int64),
        entry=np.zeros(len(surface.island), np.int32),
        around=np.zeros(len(surface.island), np.int64),
        counts=np.zeros(4, np.int64),
    )


def _window_arrays(windows: int) -> dict[str, Array]:
    return {
        "nodes": np.empty((windows, 3), np.int32),
        "ends": np.empty((windows, 2)),
        "key": np.empty(windows),
        "heap": np.empty(windows, np.int32),
        "taken": np.empty(windows, np.int32),
        "roots": np.empty((windows, 5)),
        "links": np.empty((windows, 2), np.int32),
    }
