"""Polygons of any number of corners as triangles, by ear clipping in the polygon's own plane.

The result does not depend on which corner a polygon's list starts with: clipping begins at the corner that comes first
by its coordinates. Concave outlines, corners on a straight line and outlines joined to holes by a double edge are
filled exactly. Of a polygon that crosses itself, what is inside is not defined; such ones are counted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_CORNERS = 10_000
"""Most corners of one polygon."""


class Triangulation(NamedTuple):
    """Triangles of a list of polygons."""

    corners: NDArray[np.int64]
    """Places in the list of corners, (T, 3), in the order of the polygons."""
    polygons: NDArray[np.int64]
    """The polygon that each triangle is of, (T,)."""
    crossing: int
    """Polygons that cross themselves."""


def triangulate(points: NDArray[np.float64], sizes: NDArray[np.int64]) -> Triangulation:
    """Triangles of polygons, each turning the way its polygon does; polygons of under three corners have none.

    Args:
        points: where each corner is, polygon by polygon, (C, 3).
        sizes: corners of each polygon, (P,), at most :data:`MAX_CORNERS`; they sum to C.
    """
    starts = np.cumsum(sizes) - sizes
    if (sizes == 3).all():
        return Triangulation(np.arange(len(points)).reshape(-1, 3), np.arange(len(sizes)), 0)
    room = int(np.maximum(sizes - 2, 0).sum())
    corners, polygons = np.empty((room, 3), np.int64), np.empty(room, np.int64)
    with np.errstate(all="ignore"):  # what is not finite is refused with the mesh
        count, crossing = _fill(points, starts, sizes, corners, polygons)
    return Triangulation(corners[:count], polygons[:count], int(crossing))


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(points, starts, sizes, corners, polygons):
    longest = 3
    for size in sizes:
        longest = max(longest, size)
    flat, after, before = np.empty((longest, 2)), np.empty(longest, np.int64), np.empty(longest, np.int64)
    count = crossing = 0
    for polygon in range(len(sizes)):
        start, size = starts[polygon], sizes[polygon]
        if size < 3:
            continue
        first = count
        if size == 3:
            for k in range(3):
                corners[count, k] = start + k
            count += 1
        else:
            shift = _first_corner(points, start, size)
            count, crossed = _clip(points, start, size, shift, flat, after, before, corners, count)
            crossing += crossed
        for k in range(first, count):
            polygons[k] = polygon
    return count, crossing


@njit(cache=True, nogil=True, error_model="numpy")
def _first_corner(points, start, size):
    """Corner with the least coordinates; of equal ones, the one whose next corners have the least."""
    best = 0
    for k in range(1, size):
        for ahead in range(size):
            a, b = start + (k + ahead) % size, start + (best + ahead) % size
            order = 0
            for axis in range(3):
                if points[a, axis] != points[b, axis]:
                    order = -1 if points[a, axis] < points[b, axis] else 1
                    break
            if order != 0:
                if order < 0:
                    best = k
                break
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _clip(points, start, size, shift, flat, after, before, corners, count):
    """Ears of one polygon, written from row ``count`` on; the next free row, and whether the polygon crosses itself."""
    scale = _flatten(points, start, size, shift, flat)
    tiny = 1e-12 * scale
    for k in range(size):
        after[k], before[k] = (k + 1) % size, (k + size - 1) % size
    left, k, since, crossed = size, 0, 0, False
    while left > 3 and since < left:  # there and back again on one line: nothing to fill, and in the way of the rest
        a, c = before[k], after[k]
        if _is_spike(flat, a, k, c):
            after[a], before[c] = c, a
            left, since, k = left - 1, 0, a
        else:
            since, k = since + 1, c
    since = 0
    while left > 2:
        a, b, c = before[k], k, after[k]
        turn = _turn(flat, a, b, c)
        ear = left == 3 or abs(turn) <= tiny or (turn > tiny and _free(flat, after, before, a, b, c))
        if not ear and since >= left:  # nowhere is an ear: the outline crosses itself
            ear = True
        if not ear:
            k, since = c, since + 1
            continue
        crossed |= turn < -1e-9 * scale
        p, q, r = start + (a + shift) % size, start + (b + shift) % size, start + (c + shift) % size
        if _has_area(points, p, q, r, scale):
            corners[count, 0], corners[count, 1], corners[count, 2] = p, q, r
            count += 1
        after[a], before[c] = c, a
        left, since, k = left - 1, 0, c
    return count, crossed


@njit(cache=True, nogil=True, error_model="numpy")
def _flatten(points, start, size, shift, flat):
    """Corners of a polygon in its plane, seen so that it turns left, into ``flat``; its size squared."""
    ox, oy, oz = points[start + shift]
    nx = ny = nz = 0.0
    for k in range(size):
        a, b = start + k, start + (k + 1) % size
        ax, ay, az = points[a, 0] - ox, points[a, 1] - oy, points[a, 2] - oz
        bx, by, bz = points[b, 0] - ox, points[b, 1] - oy, points[b, 2] - oz
        nx += ay * bz - az * by
        ny += az * bx - ax * bz
        nz += ax * by - ay * bx
    if abs(nz) >= abs(nx) and abs(nz) >= abs(ny):
        u, v, turned = 0, 1, nz < 0.0
    elif abs(nx) >= abs(ny):
        u, v, turned = 1, 2, nx < 0.0
    else:
        u, v, turned = 2, 0, ny < 0.0
    if turned:
        u, v = v, u
    scale = 0.0
    for k in range(size):
        at = start + (k + shift) % size
        flat[k, 0] = points[at, u] - points[start + shift, u]
        flat[k, 1] = points[at, v] - points[start + shift, v]
        scale = max(scale, flat[k, 0] * flat[k, 0] + flat[k, 1] * flat[k, 1])
    return scale


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turn(flat, a, b, c):
    """Twice the area of a triangle, positive where it turns left."""
    return (flat[b, 0] - flat[a, 0]) * (flat[c, 1] - flat[a, 1]) - (flat[b, 1] - flat[a, 1]) * (flat[c, 0] - flat[a, 0])


@njit(cache=True, nogil=True, error_model="numpy")
def _free(flat, after, before, a, b, c):
    """Whether nothing of the outline lies in the triangle of a corner and its neighbours.

    Another corner at the place of one of theirs, as outlines joined to holes have, is in the way only if an edge leads
    from it into the triangle.
    """
    k = after[c]
    while k != a:
        if _same(flat, k, a):
            if _enters(flat, after, before, k, c, a, b):
                return False
        elif _same(flat, k, b):
            if _enters(flat, after, before, k, a, b, c):
                return False
        elif _same(flat, k, c):
            if _enters(flat, after, before, k, b, c, a):
                return False
        elif _turn(flat, a, b, k) >= 0.0 and _turn(flat, b, c, k) >= 0.0 and _turn(flat, c, a, k) >= 0.0:
            return False
        k = after[k]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _is_spike(flat, a, b, c):
    """Whether the outline goes from a to b and straight back, or stays where it is."""
    ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
    vx, vy = flat[c, 0] - flat[b, 0], flat[c, 1] - flat[b, 1]
    length = np.sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy))
    return length == 0.0 or (ux * vx + uy * vy < 0.0 and abs(ux * vy - uy * vx) <= 1e-7 * length)


@njit(cache=True, nogil=True, error_model="numpy")
def _same(flat, a, b):
    return flat[a, 0] == flat[b, 0] and flat[a, 1] == flat[b, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _enters(flat, after, before, k, p, q, r):
    """Whether an edge of corner k, which lies at q, leads between the directions from q to r and to p."""
    for end in (after[k], before[k]):
        if _turn(flat, q, r, end) > 0.0 and _turn(flat, p, q, end) > 0.0:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _has_area(points, p, q, r, scale):
    ax, ay, az = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1], points[q, 2] - points[p, 2]
    bx, by, bz = points[r, 0] - points[p, 0], points[r, 1] - points[p, 1], points[r, 2] - points[p, 2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return x * x + y * y + z * z > (1e-12 * scale) ** 2
