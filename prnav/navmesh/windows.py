"""Distances to prepared goals: the best of the windows that shortest paths enter a polygon through.

Before: the windows that :mod:`.geodesic` has sorted. After: :mod:`.goal_fields`.
"""

from __future__ import annotations

import math

from numba import njit

from prnav.navmesh.planar import TOUCH, bend


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
