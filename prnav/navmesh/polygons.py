"""Triangles to convex polygons: merged while they stay convex, and neighbours found (Recast's polygon mesh).

Before: :mod:`.triangles`. After: :mod:`.detail`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.contours import Contours
from prnav.navmesh.triangles import contour_triangles

MERGE_HEIGHT = 2  # corners above each other at most this far apart are one vertex [cell heights]
UNKNOWN = -2  # not found out yet


class GridPolygons(NamedTuple):
    """Convex polygons on the grid; unused places of the fixed-size rows are -1."""

    vertices: NDArray[np.int64]  #: x, y, z [cells, cell heights, cells], (V, 3)
    corners: NDArray[np.int64]  #: vertex per corner, (P, most corners)
    neighbours: NDArray[np.int64]  #: polygon across the edge from corner k to the next, -1 = wall, (P, most corners)
    region: NDArray[np.int64]  #: region of each polygon, (P,)


def convex_polygons(contours: Contours, num_regions: int, most_corners: int) -> GridPolygons:
    """Convex polygons of at most ``most_corners`` corners that fill the contours."""
    start, corners, region, num_triangles, triangles = contour_triangles(contours, num_regions)
    vertices, vertex = _weld(corners)
    contour = np.repeat(np.arange(len(region)), np.diff(start))
    rows = np.flatnonzero(np.arange(len(corners)) < (start[:-1] + num_triangles)[contour])
    rows = rows[_faces_up(vertices, vertex[triangles[rows]])]
    num_triangles = np.bincount(contour[rows], minlength=len(region))
    begin = (start[:-1] - np.cumsum(num_triangles) + num_triangles)[contour[rows]] + np.arange(len(rows))
    polygons = np.full((len(corners), most_corners), -1, np.int64)
    polygons[begin, :3] = vertex[triangles[rows]]
    if most_corners > 3:
        _merge_triangles(vertices, start, num_triangles, polygons, np.full(len(vertices), -1))
    polygons, owner = _with_area(vertices, polygons, np.repeat(region, np.diff(start)))
    return GridPolygons(vertices, polygons, _neighbours(polygons, len(vertices)), owner)


def _faces_up(vertices: NDArray[np.int64], triangles: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether triangles have three different corners and are not turned over; slivers without area count as fine."""
    a, b, c = vertices[triangles[:, 0]], vertices[triangles[:, 1]], vertices[triangles[:, 2]]
    area = (b[:, 0] - a[:, 0]) * (c[:, 2] - a[:, 2]) - (c[:, 0] - a[:, 0]) * (b[:, 2] - a[:, 2])
    p, q, r = triangles.T
    return (area <= 0) & (p != q) & (q != r) & (r != p)


@njit(cache=True, nogil=True, error_model="numpy")
def _weld(corners):
    """Vertices of corners at the same place and nearly the same height, (V, 3), and the vertex of each corner."""
    total = len(corners)
    size = 1
    while size < 2 * total:
        size *= 2
    table = np.zeros(size, np.int64)  # 1 + the last vertex per slot
    chain = np.empty(total, np.int64)
    vertices = np.empty((total, 3), np.int64)
    vertex = np.empty(total, np.int64)
    num = 0
    for k in range(total):
        x = corners[k, 0]
        y = corners[k, 1]
        z = corners[k, 2]
        slot = (x * 73856093 ^ z * 19349663) & (size - 1)
        v = int(table[slot] - 1)
        while v >= 0 and (vertices[v, 0] != x or vertices[v, 2] != z or abs(vertices[v, 1] - y) > MERGE_HEIGHT):
            v = int(chain[v])
        if v < 0:
            v = num
            num += 1
            vertices[v, 0] = x
            vertices[v, 1] = y
            vertices[v, 2] = z
            chain[v] = table[slot] - 1
            table[slot] = v + 1
        vertex[k] = v
    return vertices[:num].copy(), vertex


def _with_area(
    vertices: NDArray[np.int64], polygons: NDArray[np.int64], owner: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows in use whose area is above 0: slivers that no polygon took in are left out, as Habitat disables them."""
    used = polygons[:, 0] >= 0
    polygons, owner = polygons[used], owner[used]
    x, z = vertices[polygons, 0], vertices[polygons, 2]
    missing = polygons < 0
    x[missing] = np.broadcast_to(x[:, :1], x.shape)[missing]
    z[missing] = np.broadcast_to(z[:, :1], z.shape)[missing]
    area = (z * np.roll(x, -1, axis=1) - x * np.roll(z, -1, axis=1)).sum(axis=1)
    return polygons[area > 0], owner[area > 0]


@njit(cache=True, nogil=True, error_model="numpy")
def _num_corners(polygons, p):
    """Corners in use of a polygon's row."""
    count = polygons.shape[1]
    while count > 0 and polygons[p, count - 1] < 0:
        count -= 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _merge_gain(points, polygons, p, q, edge):
    """Squared length of the common edge if the union of two polygons is convex and small enough, else -1.

    Fills ``edge`` with the corners of p and of q at which the (last) common edge starts.
    """
    num_p = _num_corners(polygons, p)
    num_q = _num_corners(polygons, q)
    edge[0] = -1
    for i in range(num_p):
        a = polygons[p, i]
        b = polygons[p, (i + 1) % num_p]
        for j in range(num_q):
            c = polygons[q, j]
            d = polygons[q, (j + 1) % num_q]
            if (a == c and b == d) or (a == d and b == c):
                edge[0] = i
                edge[1] = j
                break
    if edge[0] < 0 or num_p + num_q - 2 > polygons.shape[1]:
        return np.int64(-1)
    for turn in range(2):
        one, num_one, at_one = (p, num_p, edge[0]) if turn == 0 else (q, num_q, edge[1])
        two, num_two, at_two = (q, num_q, edge[1]) if turn == 0 else (p, num_p, edge[0])
        u = polygons[one, (at_one + num_one - 1) % num_one]
        v = polygons[one, at_one]
        w = polygons[two, (at_two + 2) % num_two]
        uvx, uvz = points[v, 0] - points[u, 0], points[v, 2] - points[u, 2]
        if uvx * (points[w, 2] - points[u, 2]) - uvz * (points[w, 0] - points[u, 0]) >= 0:
            return np.int64(-1)  # not convex at v
    a = polygons[p, edge[0]]
    b = polygons[p, (edge[0] + 1) % num_p]
    dx = points[a, 0] - points[b, 0]
    dz = points[a, 2] - points[b, 2]
    return dx * dx + dz * dz


@njit(cache=True, nogil=True, error_model="numpy")
def _merge_triangles(points, start, num_triangles, polygons, head):
    """Merge the triangles of each contour, longest common edge first, in place; unused rows become -1.

    Pairs that share an edge are listed once; a merge removes one pair and changes the values of those around it.
    ``head`` holds -1 per vertex, before and after.
    """
    most = polygons.shape[1]
    longest = np.int64(1)
    for c in range(len(num_triangles)):
        longest = max(longest, num_triangles[c])
    chain = np.empty(3 * longest, np.int64)
    pairs = np.empty((9 * longest, 2), np.int64)
    gain = np.empty(9 * longest, np.int64)
    merged = np.empty(2 * most, np.int64)
    edge = np.zeros(2, np.int64)
    for c in range(len(num_triangles)):
        first = start[c]
        last = first + num_triangles[c]
        num = 0
        for p in range(first, last):  # pairs of triangles with a common edge, by its lower vertex
            for k in range(3):
                a = polygons[p, k]
                b = polygons[p, (k + 1) % 3]
                low, high = min(a, b), max(a, b)
                other = head[low]
                while other >= 0:
                    q = first + other // 3
                    a = polygons[q, other % 3]
                    b = polygons[q, (other % 3 + 1) % 3]
                    if max(a, b) == high and q != p and num < len(pairs):
                        pairs[num, 0] = q
                        pairs[num, 1] = p
                        gain[num] = UNKNOWN
                        num += 1
                    other = chain[other]
                chain[3 * (p - first) + k] = head[low]
                head[low] = 3 * (p - first) + k
        for p in range(first, last):
            for k in range(3):
                head[polygons[p, k]] = -1
        while True:
            best = -1
            for k in range(num):
                if gain[k] == UNKNOWN:
                    gain[k] = _merge_gain(points, polygons, pairs[k, 0], pairs[k, 1], edge)
                if gain[k] <= 0 or (best >= 0 and gain[k] < gain[best]):
                    continue
                if (
                    best < 0
                    or gain[k] > gain[best]
                    or pairs[k, 0] < pairs[best, 0]
                    or (pairs[k, 0] == pairs[best, 0] and pairs[k, 1] < pairs[best, 1])
                ):
                    best = k
            if best < 0:
                break
            p = pairs[best, 0]
            q = pairs[best, 1]
            edge[0] = -1
            size = 0
            _merge_gain(points, polygons, p, q, edge)
            for turn in range(2):
                here = p if turn == 0 else q
                count = _num_corners(polygons, here)
                for k in range(count - 1):
                    merged[size] = polygons[here, (edge[turn] + 1 + k) % count]
                    size += 1
            last -= 1
            for k in range(most):
                polygons[p, k] = merged[k] if k < size else -1
                polygons[q, k] = polygons[last, k]
                polygons[last, k] = -1
            kept = 0
            for k in range(num):  # q is now part of p, and the last polygon has taken its place
                a = pairs[k, 0]
                b = pairs[k, 1]
                touched = a == p or b == p or a == q or b == q
                a = p if a == q else (q if a == last else a)
                b = p if b == q else (q if b == last else b)
                if a != b:
                    pairs[kept, 0] = min(a, b)
                    pairs[kept, 1] = max(a, b)
                    gain[kept] = UNKNOWN if touched else gain[k]
                    kept += 1
            num = kept


@njit(cache=True, nogil=True, error_model="numpy")
def _neighbours(polygons, num_vertices):
    """Polygon across each edge: the one that has the edge in the other direction."""
    most = polygons.shape[1]
    neighbours = np.empty(polygons.shape, np.int64)
    head = np.zeros(num_vertices, np.int64)  # 1 + the last edge that starts at the vertex
    chain = np.empty(polygons.size, np.int64)
    for turn in range(2):
        for p in range(len(polygons)):
            count = _num_corners(polygons, p)
            for k in range(most):
                if turn == 0:
                    neighbours[p, k] = -1
                if k >= count:
                    continue
                a = polygons[p, k]
                b = polygons[p, (k + 1) % count]
                if turn == 0 and a < b:
                    chain[p * most + k] = head[a] - 1
                    head[a] = 1 + p * most + k
                elif turn == 1 and a > b:
                    edge = head[b] - 1
                    while edge >= 0:
                        q = edge // most
                        m = edge % most
                        following = m + 1 if m + 1 < most and polygons[q, m + 1 if m + 1 < most else m] >= 0 else 0
                        if polygons[q, following] == a and neighbours[q, m] < 0 and q != p:
                            neighbours[q, m] = p
                            neighbours[p, k] = q
                            break
                        edge = chain[edge]
    return neighbours
