"""Triangulations of a polygon with points on its outline and inside, in the ground plane.

Points are rows x, y, z in float32; an outline is a list of rows in order.

Before: outlines and samples of :mod:`.detail`. After: :mod:`.detail` again.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

UNKNOWN = -1  # side of an edge that no triangle has taken
HULL = -2  # side of an edge outside of the polygon


@njit(cache=True, nogil=True, error_model="numpy")
def _plane_distance(points, a, b):
    """Distance in the ground plane."""
    dx, dz = points[b, 0] - points[a, 0], points[b, 2] - points[a, 2]
    return math.sqrt(dx * dx + dz * dz)


@njit(cache=True, nogil=True, error_model="numpy")
def _cross(points, a, b, c):
    """Twice the signed area of a triangle in the ground plane."""
    abx, abz = points[b, 0] - points[a, 0], points[b, 2] - points[a, 2]
    return abx * (points[c, 2] - points[a, 2]) - abz * (points[c, 0] - points[a, 0])


@njit(cache=True, nogil=True, error_model="numpy")
def hull_triangles(points, hull, num_hull, num_corners, triangles):
    """Triangles of an outline without inner points: from the smallest ear on, the shorter side first."""
    start, left, right = 0, 1, num_hull - 1
    smallest = np.float32(np.inf)
    for i in range(num_hull):
        here = hull[i]
        if here >= num_corners:
            continue  # on an edge: no ear
        before = hull[(i + num_hull - 1) % num_hull]
        after = hull[(i + 1) % num_hull]
        length = (
            _plane_distance(points, before, here)
            + _plane_distance(points, here, after)
            + _plane_distance(points, after, before)
        )
        if length < smallest:
            smallest = length
            start, left, right = i, (i + 1) % num_hull, (i + num_hull - 1) % num_hull
    triangles[0, 0], triangles[0, 1], triangles[0, 2] = hull[start], hull[left], hull[right]
    count = 1
    while (left + 1) % num_hull != right:
        next_left = (left + 1) % num_hull
        next_right = (right + num_hull - 1) % num_hull
        a, b, c, d = hull[left], hull[next_left], hull[next_right], hull[right]
        triangles[count, 0], triangles[count, 2] = a, d
        if _plane_distance(points, a, b) + _plane_distance(points, b, d) < (
            _plane_distance(points, d, c) + _plane_distance(points, a, c)
        ):
            triangles[count, 1] = b
            left = next_left
        else:
            triangles[count, 1] = c
            right = next_right
        count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _crosses_edges(points, edges, count, a, b):
    """Whether the segment ab crosses an edge that does not end at a or b."""
    for k in range(count):
        c = edges[k, 0]
        d = edges[k, 1]
        if a == c or a == d or b == c or b == d:
            continue
        first = _cross(points, c, d, b)
        second = _cross(points, c, d, a)
        third = _cross(points, a, b, c)
        if first * second < 0 and third * (third + second - first) < 0:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def delaunay_triangles(points, num_points, hull, num_hull, edges, triangles):
    """Delaunay triangles of points inside an outline; returns their number.

    Rows of ``edges``: start, end, face to the left, face to the right of it.
    """
    count = 0
    before = hull[num_hull - 1]
    for i in range(num_hull):
        edges[count, 0], edges[count, 1], edges[count, 2], edges[count, 3] = before, hull[i], HULL, UNKNOWN
        before = hull[i]
        count += 1
    faces = 0
    current = 0
    while current < count:
        for side in range(2, 4):
            if edges[current, side] != UNKNOWN:
                continue
            s = edges[current, 0] if side == 2 else edges[current, 1]
            t = edges[current, 1] if side == 2 else edges[current, 0]
            best = np.int64(-1)
            x, z, radius = np.float32(0), np.float32(0), np.float32(0)
            for u in range(num_points):
                if u == s or u == t or _cross(points, s, t, u) <= 1e-5:
                    continue
                if best >= 0:
                    d = math.sqrt((points[u, 0] - x) ** 2 + (points[u, 2] - z) ** 2)
                    if d > radius * 1.001:
                        continue
                    if d >= radius * 0.999:  # on the circle: the new sides must not cross any
                        crossing = False
                        for turn in range(2):
                            crossing = crossing or _crosses_edges(
                                points, edges, count, s if turn == 0 else t, np.int64(u)
                            )
                        if crossing:
                            continue
                best = np.int64(u)
                bx, bz = points[t, 0] - points[s, 0], points[t, 2] - points[s, 2]
                cx, cz = points[u, 0] - points[s, 0], points[u, 2] - points[s, 2]
                b2 = bx * bx + bz * bz
                c2 = cx * cx + cz * cz
                twice = np.float32(2) * (bx * cz - bz * cx)
                ox = (b2 * cz - c2 * bz) / twice
                oz = (c2 * bx - b2 * cx) / twice
                radius = np.float32(math.sqrt(ox * ox + oz * oz))
                x, z = points[s, 0] + ox, points[s, 2] + oz
            if best < 0:
                edges[current, side] = HULL
                continue
            edges[current, side] = faces
            for turn in range(2):  # the triangle's other sides: new edges, or sides of known ones
                a = best if turn == 0 else t
                b = s if turn == 0 else best
                row = 0
                while row < count and not (
                    (edges[row, 0] == a and edges[row, 1] == b) or (edges[row, 0] == b and edges[row, 1] == a)
                ):
                    row += 1
                if row < count:
                    other = 2 if edges[row, 0] == a else 3
                    if edges[row, other] == UNKNOWN:
                        edges[row, other] = faces
                elif count < len(edges):
                    edges[count, 0], edges[count, 1], edges[count, 2], edges[count, 3] = a, b, faces, UNKNOWN
                    count += 1
            faces += 1
        current += 1
    faces = min(faces, len(triangles))
    for face in range(faces):
        for k in range(3):
            triangles[face, k] = -1
    for k in range(count):
        for side in range(2, 4):
            face = edges[k, side]
            if face < 0 or face >= faces:
                continue
            a = edges[k, 0] if side == 3 else edges[k, 1]
            b = edges[k, 1] if side == 3 else edges[k, 0]
            if triangles[face, 0] < 0:
                triangles[face, 0] = a
                triangles[face, 1] = b
            elif triangles[face, 0] == b:
                triangles[face, 2] = a
            elif triangles[face, 1] == a:
                triangles[face, 2] = b
    kept = 0
    for face in range(faces):
        if triangles[face, 2] >= 0:
            for k in range(3):
                triangles[kept, k] = triangles[face, k]
            kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def vertical_errors(samples, points, triangles, count):
    """Smallest vertical distance of each sample to the triangles above or below it, -1 if there are none."""
    errors = np.empty(len(samples), np.float32)
    margin = np.float32(1e-4)
    for i in range(len(samples)):
        nearest = np.float32(np.inf)
        for k in range(count):
            a, b, c = triangles[k, 0], triangles[k, 1], triangles[k, 2]
            v0x, v0z = points[c, 0] - points[a, 0], points[c, 2] - points[a, 2]
            v1x, v1z = points[b, 0] - points[a, 0], points[b, 2] - points[a, 2]
            v2x, v2z = samples[i, 0] - points[a, 0], samples[i, 2] - points[a, 2]
            dot00 = v0x * v0x + v0z * v0z
            dot01 = v0x * v1x + v0z * v1z
            dot02 = v0x * v2x + v0z * v2z
            dot11 = v1x * v1x + v1z * v1z
            dot12 = v1x * v2x + v1z * v2z
            area = dot00 * dot11 - dot01 * dot01
            if area == 0:
                continue
            u = (dot11 * dot02 - dot01 * dot12) * (np.float32(1) / area)
            v = (dot00 * dot12 - dot01 * dot02) * (np.float32(1) / area)
            if u >= -margin and v >= -margin and u + v <= 1 + margin:
                y = points[a, 1] + (points[c, 1] - points[a, 1]) * u + (points[b, 1] - points[a, 1]) * v
                nearest = min(nearest, abs(y - samples[i, 1]))
        errors[i] = nearest if nearest < np.inf else np.float32(-1)
    return errors
