"""Geodesic distances and paths between pairs of points, on the search of :mod:`.geodesic`.

Before: :mod:`.geodesic`. After: :mod:`.navmesh` and :mod:`.navmesh_set`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from prnav.navmesh import geodesic, queries
from prnav.navmesh.scratch import Scratch, ScratchPool, grown
from prnav.navmesh.surface import Surface

Floats = NDArray[np.float64]


def run_search(
    surface: Surface, scene: int, polygon: int, position: Floats, target: Floats, scratch: Scratch
) -> tuple[int, Scratch]:
    """One search from a floor point, as :func:`geodesic.search` has it, and the memory it ended in, grown as needed."""
    x, y, z = position.tolist()
    while True:
        result = geodesic.search(surface, scene, polygon, x, y, z, target, scratch)
        if result != geodesic.FULL:
            return int(result), scratch
        scratch = grown(scratch)


def pair_distances(pool: ScratchPool, scenes: NDArray[np.int64], starts: Floats, ends: Floats) -> Floats:
    """Geodesic distances between points (N, 3), (N,) [m]; inf between islands and off the floor."""
    a, p = queries.find_ends(pool.surface, scenes, starts)
    b, q = queries.find_ends(pool.surface, scenes, ends)
    return located_distances(pool, scenes, p, a, q, b)


def located_distances(
    pool: ScratchPool, scenes: NDArray[np.int64], p: queries.Ints, a: Floats, q: queries.Ints, b: Floats
) -> Floats:
    """Geodesic distances between floor points a and b (N, 3) in polygons p and q, (N,) [m]; polygon -1 for none."""
    distances = np.empty(len(a))
    row = 0
    scratch = pool.take()
    try:
        while True:
            row = geodesic.pair_distances(pool.surface, scenes, p, a, q, b, row, scratch, distances)
            if row >= len(distances):
                return distances
            scratch = grown(scratch)
    finally:
        pool.give_back(scratch)


def shortest_path(pool: ScratchPool, scene: int, start: Floats, end: Floats) -> Floats:
    """Turning points of a shortest path, both ends included, (M, 3); no rows where there is none."""
    surface = pool.surface
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
    scratch = pool.take()
    try:
        node, scratch = run_search(surface, scene, int(polygons[order[0]]), a, target, scratch)
        turns = _turning_points(surface, node, scratch, b) if node >= 0 else np.zeros((0, 3))
    finally:
        pool.give_back(scratch)
    return turns if order == [0, 1] else turns[::-1]


def _turning_points(surface: Surface, node: int, scratch: Scratch, end: Floats) -> Floats:
    """The way from a search's start through window ``node`` to ``end``, (M, 3), no point twice."""
    last = np.empty(3)
    _, over = geodesic.way(surface, node, scratch, end[0], end[1], end[2], last)
    path = [end] if over == 0 else [end, last]
    root = int(scratch.nodes[node, 1])
    while root >= 0:
        path.append(scratch.roots[root, :3].copy())
        root = int(scratch.links[root, 0])
    turns = np.array(path[::-1])
    keep = np.append(True, np.abs(np.diff(turns, axis=0)).max(axis=1) > 0.0)
    return turns[keep] if keep.sum() > 1 else turns[[0, -1]]


def path_length(path: Floats) -> float:
    """Length of a path of turning points (M, 3) [m]; inf for no points."""
    return math.inf if not len(path) else float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
