"""Geodesic distances and paths between pairs of points, on the search of :mod:`.geodesic`.

Before: :mod:`.geodesic`. After: :mod:`.navmesh` and :mod:`.navmesh_set`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from prnav.errors import NavMeshError
from prnav.navmesh import geodesic, queries
from prnav.navmesh.surface import Surface

Floats = NDArray[np.float64]

FIRST_WINDOWS = 4096  #: windows a search has room for at first; doubled whenever one needs more
MOST_WINDOWS = 1 << 26  #: a search that needs more is taken for a broken mesh


class SearchArrays:
    """Working memory of searches on one surface, kept between calls and grown as needed."""

    def __init__(self, surface: Surface):
        self.surface = surface
        fans = int(np.diff(surface.scene_fan).max(initial=0))
        polygons = int(np.diff(surface.scene_polygon).max(initial=0))
        self._per_fan = (np.zeros(fans, np.int64), np.zeros(fans, np.int32), np.zeros(fans), np.zeros(fans, np.int32))
        self.reached = np.zeros(polygons, np.int64)
        self._around = np.zeros(len(surface.island), np.int64)
        self._entry = np.zeros(len(surface.island), np.int32)
        self.stamp = np.zeros(1, np.int64)
        self.state = np.zeros(4, np.int64)
        self._allocate(FIRST_WINDOWS)

    def _allocate(self, windows: int) -> None:
        self.scratch = (
            np.empty((windows, 3), np.int32),
            np.empty((windows, 2)),
            np.empty(windows),
            np.empty(windows, np.int32),
            *self._per_fan,
            self._around,
            self._entry,
        )
        self.roots = np.empty((windows, 5))
        self.links = np.empty((windows, 2), np.int32)
        self.taken = np.empty(windows, np.int32)

    def grow(self) -> None:
        """Double the room for windows.

        Raises:
            NavMeshError: there is no end to it.
        """
        windows = 2 * len(self.taken)
        if windows > MOST_WINDOWS:
            raise NavMeshError(f"a shortest-path search needs more than {MOST_WINDOWS} windows; the mesh is broken")
        self._allocate(windows)

    def run(self, scene: int, polygon: int, position: Floats, target: Floats) -> int:
        """One search from a floor point; see :func:`geodesic.search`."""
        x, y, z = position.tolist()
        while True:
            self.stamp[0] += 1
            result = geodesic.search(
                self.surface, scene, polygon, x, y, z, target, int(self.stamp[0]), self.scratch, self.state,
                self.roots, self.links, self.reached, self.taken,
            )  # fmt: skip
            if result != geodesic.FULL:
                return int(result)
            self.grow()


def pair_distances(arrays: SearchArrays, scenes: NDArray[np.int64], starts: Floats, ends: Floats) -> Floats:
    """Geodesic distances between points (N, 3), (N,) [m]; inf between islands and off the floor."""
    a, p = queries.find_ends(arrays.surface, scenes, starts)
    b, q = queries.find_ends(arrays.surface, scenes, ends)
    return located_distances(arrays, scenes, p, a, q, b)


def located_distances(
    arrays: SearchArrays, scenes: NDArray[np.int64], p: queries.Ints, a: Floats, q: queries.Ints, b: Floats
) -> Floats:
    """Geodesic distances between floor points a and b (N, 3) in polygons p and q, (N,) [m]; polygon -1 for none."""
    surface = arrays.surface
    distances = np.empty(len(a))
    row = 0
    while True:
        row = geodesic.pair_distances(
            surface, scenes, p, a, q, b, row, arrays.scratch, arrays.state, arrays.roots, arrays.links,
            arrays.reached, arrays.taken, arrays.stamp, distances,
        )  # fmt: skip
        if row >= len(distances):
            return distances
        arrays.grow()


def shortest_path(arrays: SearchArrays, scene: int, start: Floats, end: Floats) -> Floats:
    """Turning points of a shortest path, both ends included, (M, 3); no rows where there is none."""
    surface = arrays.surface
    scenes = np.array([scene, scene], np.int64)
    points, polygons = queries.find_ends(surface, scenes, np.stack([start, end]))
    if polygons.min() < 0 or surface.island[polygons[0]] != surface.island[polygons[1]]:
        return np.zeros((0, 3))
    if polygons[0] == polygons[1]:
        return points
    order = [0, 1]
    if tuple(points[0, [0, 2, 1]]) > tuple(points[1, [0, 2, 1]]):
        order = [1, 0]  # as for distances: from the end that comes first
    a, b = points[order]
    target = np.array([polygons[order[1]], b[0], b[2]])
    node = arrays.run(scene, int(polygons[order[0]]), a, target)
    if node < 0:
        return np.zeros((0, 3))
    last = np.empty(3)
    _, over = geodesic.way(surface, node, arrays.scratch, arrays.roots, b[0], b[1], b[2], last)
    path = [b] if over == 0 else [b, last]
    root = int(arrays.scratch[0][node, 1])
    while root >= 0:
        path.append(arrays.roots[root, :3].copy())
        root = int(arrays.links[root, 0])
    turns = np.array(path[::-1])
    keep = np.append(True, np.abs(np.diff(turns, axis=0)).max(axis=1) > 0.0)
    turns = turns[keep] if keep.sum() > 1 else turns[[0, -1]]
    return turns if order == [0, 1] else turns[::-1]


def path_length(path: Floats) -> float:
    """Length of a path of turning points (M, 3) [m]; inf for no points."""
    return math.inf if not len(path) else float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
