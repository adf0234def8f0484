"""Distances to prepared goals: the best of the windows that shortest paths enter a polygon through.

Before: the windows of :mod:`.geodesic`. After: :mod:`.goal_fields`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prnav.navmesh.geodesic import stale
from prnav.navmesh.planar import TOUCH, bend


@njit(cache=True, nogil=True)
def sort_windows(s, scene, count, scratch, start, windows, window_root):
    """Windows of an exhaustive search by polygon: CSR offsets (P + 1,), both ends (M, 6) and root (M,); returns M."""
    base, first = s.scene_fan[scene], s.scene_polygon[scene]
    nodes, ends, taken = scratch.nodes, scratch.ends, scratch.taken
    start[:] = 0
    fresh = np.zeros(len(start), np.bool_)
    for i in range(count):
        if not stale(s, base, taken[i], scratch):
            fresh[s.polygon[nodes[taken[i], 0]] - first] = True
    for i in range(count):  # where rounding has made all windows of a polygon stale, they all stay
        p = s.polygon[nodes[taken[i], 0]] - first
        if not (fresh[p] and stale(s, base, taken[i], scratch)):
            start[p + 1] += 1
    for i in range(1, len(start)):
        start[i] += start[i - 1]
    fill = start[:-1].copy()
    for i in range(count):
        node = taken[i]
        k = nodes[node, 0]
        if fresh[s.polygon[k] - first] and stale(s, base, node, scratch):
            continue
        a, b = s.corner[k], s.corner[s.following[k]]
        at = fill[s.polygon[k] - first]
        fill[s.polygon[k] - first] += 1
        for axis in range(3):
            windows[at, axis] = a[axis] + ends[node, 0] * (b[axis] - a[axis])
            windows[at, 3 + axis] = a[axis] + ends[node, 1] * (b[axis] - a[axis])
        window_root[at] = nodes[node, 1]
    return start[-1]


@njit(cache=True, nogil=True)
def query_windows(s, slots, scenes, polygons, points, slot_scene, goal_polygon, place, start, windows, window_root,
                  roots, links, distances, corners):  # fmt: skip
    """Distance from points (N, 3) in known polygons to the goals of their slots, and the next turning point.

    ``place`` (slots, 3) says where a slot's rows begin in ``start``, ``windows`` and ``roots``.
    """
    for i in range(len(slots)):
        slot, p = slots[i], polygons[i]
        distances[i] = math.inf
        corners[i, 0], corners[i, 1], corners[i, 2] = math.nan, math.nan, math.nan
        goal = goal_polygon[slot]
        if p < 0 or goal < 0 or slot_scene[slot] != scenes[i]:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        row0, window0, root0 = place[slot, 0], place[slot, 1], place[slot, 2]
        if p == goal:
            r = roots[root0]
            distances[i] = math.sqrt((x - r[0]) ** 2 + (y - r[1]) ** 2 + (z - r[2]) ** 2)
            corners[i, 0], corners[i, 1], corners[i, 2] = r[0], r[1], r[2]
            continue
        local = p - s.scene_polygon[scenes[i]]
        best, chosen, chosen_over = math.inf, -1, 0
        for w in range(window0 + start[row0 + local], window0 + start[row0 + local + 1]):
            e = windows[w]
            r = roots[root0 + window_root[w]]
            cost, over = bend(r[0], r[2], e[0], e[2], e[3], e[5], x, z)
            if r[3] + cost < best:
                best, chosen, chosen_over = r[3] + cost, w, over
        if chosen < 0:
            continue
        root = window_root[chosen]
        r = roots[root0 + root]
        if chosen_over == 0:
            away = math.sqrt((x - r[0]) ** 2 + (y - r[1]) ** 2 + (z - r[2]) ** 2)
            distances[i] = r[4] + away
            if away <= 10.0 * TOUCH and links[root0 + root, 0] >= 0:
                r = roots[root0 + links[root0 + root, 0]]
            corners[i, 0], corners[i, 1], corners[i, 2] = r[0], r[1], r[2]
            continue
        e = windows[chosen]
        o = 0 if chosen_over == 1 else 3
        corners[i, 0], corners[i, 1], corners[i, 2] = e[o], e[o + 1], e[o + 2]
        distances[i] = (
            r[4]
            + math.sqrt((e[o] - r[0]) ** 2 + (e[o + 1] - r[1]) ** 2 + (e[o + 2] - r[2]) ** 2)
            + math.sqrt((e[o] - x) ** 2 + (e[o + 1] - y) ** 2 + (e[o + 2] - z) ** 2)
        )
