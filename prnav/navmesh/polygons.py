"""Outlines to convex polygons: holes bridged, ears cut, triangles merged, neighbours found (Recast's polygon mesh).

All geometry is exact: grid corners are integers, and predicates are signs of integer areas. With x to the right and z
*down* the page, ``_area2 < 0`` means that c lies left of the line from a to b, seen from above.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.contours import Contours

MERGE_HEIGHT = 2  # corners above each other at most this far apart are one vertex [cell heights]
EAR = 1  # a corner that may be cut off


class GridPolygons(NamedTuple):
    """Convex polygons on the grid; unused places of the fixed-size rows are -1."""

    vertices: NDArray[np.int32]  #: x, y, z [cells, cell heights, cells], (V, 3)
    corners: NDArray[np.int32]  #: vertex per corner, (P, most corners)
    neighbours: NDArray[np.int32]  #: polygon across the edge from corner k to the next, -1 = wall, (P, most corners)
    region: NDArray[np.int32]  #: region of each polygon, (P,)


def convex_polygons(contours: Contours, num_regions: int, most_corners: int) -> GridPolygons:
    """Convex polygons of at most ``most_corners`` corners that fill the contours."""
    start, corners, region = _join_holes(*contours, num_regions)
    vertices, polygons, owner = _fill(start, corners, region, most_corners)
    return GridPolygons(vertices, polygons, _neighbours(polygons, len(vertices)), owner)


@njit(cache=True, nogil=True, inline="never")
def _area2(points, a, b, c):
    """Twice the signed area of a triangle of points (rows of x, y, z)."""
    abx = np.int64(points[b, 0]) - points[a, 0]
    abz = np.int64(points[b, 2]) - points[a, 2]
    acx = np.int64(points[c, 0]) - points[a, 0]
    acz = np.int64(points[c, 2]) - points[a, 2]
    return abx * acz - acx * abz


@njit(cache=True, nogil=True)
def _same(points, a, b):
    """Whether two points are at the same place in the ground plane."""
    return points[a, 0] == points[b, 0] and points[a, 2] == points[b, 2]


@njit(cache=True, nogil=True)
def _between(points, a, b, c):
    """Whether c lies on the segment from a to b."""
    if _area2(points, a, b, c) != 0:
        return False
    axis = 0 if points[a, 0] != points[b, 0] else 2
    low = min(points[a, axis], points[b, axis])
    return low <= points[c, axis] <= max(points[a, axis], points[b, axis])


@njit(cache=True, nogil=True)
def _cross(points, a, b, c, d, loose):
    """Whether the segments ab and cd cross; unless ``loose``, touching is crossing."""
    abc = _area2(points, a, b, c)
    abd = _area2(points, a, b, d)
    cda = _area2(points, c, d, a)
    cdb = _area2(points, c, d, b)
    if abc != 0 and abd != 0 and cda != 0 and cdb != 0:
        return (abc < 0) != (abd < 0) and (cda < 0) != (cdb < 0)
    if loose:
        return False
    return (
        _between(points, a, b, c) or _between(points, a, b, d) or _between(points, c, d, a) or _between(points, c, d, b)
    )


@njit(cache=True, nogil=True)
def _in_cone(points, before, here, after, target, loose):
    """Whether the segment from a corner to ``target`` starts inwards; unless ``loose``, along a side does not count."""
    to_before = _area2(points, here, target, before)
    from_after = _area2(points, target, here, after)
    if _area2(points, before, here, after) <= 0:  # convex
        if loose:
            return to_before <= 0 and from_after <= 0
        return to_before < 0 and from_after < 0
    return not (_area2(points, here, target, after) <= 0 and _area2(points, target, here, before) <= 0)


@njit(cache=True, nogil=True)
def _is_diagonal(points, ring, count, i, j, loose):
    """Whether the segment between ring positions i and j lies inside the polygon."""
    a = ring[i]
    b = ring[j]
    if not _in_cone(points, ring[i - 1 if i > 0 else count - 1], a, ring[i + 1 if i + 1 < count else 0], b, loose):
        return False
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        if k == i or following == i or k == j or following == j:
            continue
        c = ring[k]
        d = ring[following]
        if _same(points, a, c) or _same(points, b, c) or _same(points, a, d) or _same(points, b, d):
            continue
        if _cross(points, a, b, c, d, loose):
            return False
    return True


@njit(cache=True, nogil=True)
def _blocked(points, ring, count, skip, a, b):
    """Whether the segment ab crosses a ring; edges at ring position ``skip`` do not count."""
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        if k == skip or following == skip:
            continue
        c = ring[k]
        d = ring[following]
        if _same(points, a, c) or _same(points, b, c) or _same(points, a, d) or _same(points, b, d):
            continue
        if _cross(points, a, b, c, d, False):
            return True
    return False


@njit(cache=True, nogil=True)
def _join_holes(start, corners, region, num_regions):
    """Bridge each region's holes into its outline; contours CSR without holes, as :class:`Contours`.

    Holes are taken from left to right; a bridge goes from a hole's corner to the nearest outline corner that it reaches
    without crossing anything. A hole that no bridge reaches is left out, as in Recast.
    """
    num = len(region)
    outline = np.full(num_regions + 1, -1, np.int32)
    hole = np.zeros(num, np.bool_)
    leftmost = np.zeros(num, np.int32)
    for c in range(num):
        first = start[c]
        last = start[c + 1]
        area = np.int64(0)
        before = last - 1
        leftmost[c] = first
        for k in range(first, last):
            area += np.int64(corners[k, 0]) * corners[before, 2] - np.int64(corners[before, 0]) * corners[k, 2]
            before = k
            best = leftmost[c]
            if corners[k, 0] < corners[best, 0] or (
                corners[k, 0] == corners[best, 0] and corners[k, 2] < corners[best, 2]
            ):
                leftmost[c] = k
        if area <= -3:  # a sliver's area rounds to none
            hole[c] = True
        else:
            outline[region[c]] = c
    # holes of one region, in a list sorted from left to right
    next_hole = np.full(num, -1, np.int32)
    first_hole = np.full(num_regions + 1, -1, np.int32)
    for c in range(num):
        if not hole[c]:
            continue
        x = corners[leftmost[c], 0]
        z = corners[leftmost[c], 2]
        before = -1
        here = first_hole[region[c]]
        while here >= 0:
            at = leftmost[here]
            if corners[at, 0] > x or (corners[at, 0] == x and corners[at, 2] > z):
                break
            before = here
            here = next_hole[here]
        next_hole[c] = here
        if before >= 0:
            next_hole[before] = c
        else:
            first_hole[region[c]] = c

    total = len(corners) + 2 * num
    joined = np.empty((total, 3), np.int32)
    joined_start = np.zeros(num + 1, np.int32)
    joined_region = np.empty(num, np.int32)
    num_joined = 0
    used = 0
    ring = np.empty(total, np.int32)  # rows of corners
    spare = np.empty(total, np.int32)
    other = np.empty(len(corners), np.int32)
    distance = np.empty(total, np.int64)
    for c in range(num):
        if hole[c]:
            continue
        count = start[c + 1] - start[c]
        for k in range(count):
            ring[k] = start[c] + k
        h = first_hole[region[c]] if outline[region[c]] == c else -1
        while h >= 0:
            size = start[h + 1] - start[h]
            corner = leftmost[h] - start[h]
            bridge = -1
            for _ in range(size):
                point = start[h] + corner
                for k in range(count):
                    here = ring[k]
                    if _in_cone(
                        corners,
                        ring[k - 1 if k > 0 else count - 1],
                        here,
                        ring[k + 1 if k + 1 < count else 0],
                        point,
                        False,
                    ):
                        dx = np.int64(corners[here, 0]) - corners[point, 0]
                        dz = np.int64(corners[here, 2]) - corners[point, 2]
                        distance[k] = dx * dx + dz * dz
                    else:
                        distance[k] = -1
                while bridge < 0:  # nearest first
                    nearest = -1
                    for k in range(count):
                        if distance[k] >= 0 and (nearest < 0 or distance[k] < distance[nearest]):
                            nearest = k
                    if nearest < 0:
                        break
                    distance[nearest] = -1
                    if _blocked(corners, ring, count, nearest, ring[nearest], point):
                        continue
                    clear = True
                    remaining = h
                    while remaining >= 0 and clear:
                        remaining_size = start[remaining + 1] - start[remaining]
                        for k in range(remaining_size):
                            other[k] = start[remaining] + k
                        clear = not _blocked(corners, other, remaining_size, -1, ring[nearest], point)
                        remaining = next_hole[remaining]
                    if clear:
                        bridge = nearest
                if bridge >= 0:
                    break
                corner = (corner + 1) % size
            if bridge >= 0:
                for k in range(count + 1):
                    spare[k] = ring[(bridge + k) % count]
                for k in range(size + 1):
                    spare[count + 1 + k] = start[h] + (corner + k) % size
                ring, spare = spare, ring
                count += size + 2
            h = next_hole[h]
        for k in range(count):
            joined[used + k] = corners[ring[k]]
        used += count
        joined_region[num_joined] = region[c]
        num_joined += 1
        joined_start[num_joined] = used
    return joined_start[: num_joined + 1].copy(), joined[:used].copy(), joined_region[:num_joined].copy()


@njit(cache=True, nogil=True)
def _cut_ears(points, ring, flags, count, triangles):
    """Triangulate a ring of points; the shortest diagonal goes first. Returns the number of triangles.

    ``ring`` and ``flags`` are used up. Where a contour overlaps itself, what cannot be cut is left out.
    """
    num = 0
    for i in range(count):
        middle = i + 1 if i + 1 < count else 0
        after = middle + 1 if middle + 1 < count else 0
        flags[middle] = EAR if _is_diagonal(points, ring, count, i, after, False) else 0
    while count > 3:
        best = -1
        shortest = np.int64(0)
        for loose in range(2):
            for i in range(count):
                middle = i + 1 if i + 1 < count else 0
                after = middle + 1 if middle + 1 < count else 0
                if loose == 0:
                    if flags[middle] != EAR:
                        continue
                    end = after
                else:
                    if not _is_diagonal(points, ring, count, i, after, True):
                        continue
                    end = after + 1 if after + 1 < count else 0
                dx = np.int64(points[ring[end], 0]) - points[ring[i], 0]
                dz = np.int64(points[ring[end], 2]) - points[ring[i], 2]
                length = dx * dx + dz * dz
                if best < 0 or length < shortest:
                    shortest = length
                    best = i
            if best >= 0:
                break
        if best < 0:
            return num
        i = best
        middle = i + 1 if i + 1 < count else 0
        after = middle + 1 if middle + 1 < count else 0
        triangles[num, 0] = ring[i]
        triangles[num, 1] = ring[middle]
        triangles[num, 2] = ring[after]
        num += 1
        count -= 1
        for k in range(middle, count):
            ring[k] = ring[k + 1]
            flags[k] = flags[k + 1]
        if middle >= count:
            middle = 0
        i = middle - 1 if middle > 0 else count - 1
        before = i - 1 if i > 0 else count - 1
        after = middle + 1 if middle + 1 < count else 0
        flags[i] = EAR if _is_diagonal(points, ring, count, before, middle, False) else 0
        flags[middle] = EAR if _is_diagonal(points, ring, count, i, after, False) else 0
    triangles[num, 0] = ring[0]
    triangles[num, 1] = ring[1]
    triangles[num, 2] = ring[2]
    return num + 1


@njit(cache=True, nogil=True)
def _num_corners(polygons, p):
    """Corners in use of a polygon's row."""
    count = polygons.shape[1]
    while count > 0 and polygons[p, count - 1] < 0:
        count -= 1
    return count


@njit(cache=True, nogil=True)
def _shared_edge(polygons, p, q):
    """Corner of p and of q at which their (last) common edge starts; -1, -1 if there is none."""
    num_p = _num_corners(polygons, p)
    num_q = _num_corners(polygons, q)
    edge_p = -1
    edge_q = -1
    for i in range(num_p):
        a = polygons[p, i]
        b = polygons[p, (i + 1) % num_p]
        for j in range(num_q):
            c = polygons[q, j]
            d = polygons[q, (j + 1) % num_q]
            if (a == c and b == d) or (a == d and b == c):
                edge_p = i
                edge_q = j
                break
    return edge_p, edge_q


@njit(cache=True, nogil=True)
def _merge_gain(points, polygons, p, q):
    """Squared length of the common edge if the union of two polygons is convex and small enough, else -1."""
    num_p = _num_corners(polygons, p)
    num_q = _num_corners(polygons, q)
    if num_p + num_q - 2 > polygons.shape[1]:
        return np.int64(-1)
    edge_p, edge_q = _shared_edge(polygons, p, q)
    if edge_p < 0:
        return np.int64(-1)
    before = polygons[p, (edge_p + num_p - 1) % num_p]
    if _area2(points, before, polygons[p, edge_p], polygons[q, (edge_q + 2) % num_q]) >= 0:
        return np.int64(-1)
    before = polygons[q, (edge_q + num_q - 1) % num_q]
    if _area2(points, before, polygons[q, edge_q], polygons[p, (edge_p + 2) % num_p]) >= 0:
        return np.int64(-1)
    a = polygons[p, edge_p]
    b = polygons[p, (edge_p + 1) % num_p]
    dx = np.int64(points[a, 0]) - points[b, 0]
    dz = np.int64(points[a, 2]) - points[b, 2]
    return dx * dx + dz * dz


@njit(cache=True, nogil=True)
def _merge_triangles(points, polygons, first, last):
    """Merge polygons ``first:last`` of one contour, longest common edge first, in place; the new ``last``.

    Pairs that share an edge are listed once; a merge removes one pair and changes the values of those around it.
    """
    most = polygons.shape[1]
    count = last - first
    edges = np.empty((3 * count, 3), np.int64)  # lower vertex, higher vertex, polygon
    for p in range(count):
        for k in range(3):
            a = polygons[first + p, k]
            b = polygons[first + p, (k + 1) % 3]
            edges[3 * p + k, 0] = np.int64(min(a, b)) << 32 | max(a, b)
            edges[3 * p + k, 1] = p
    order = np.argsort(edges[:, 0])
    num = 0
    for k in range(len(order)):
        m = k + 1
        while m < len(order) and edges[order[m], 0] == edges[order[k], 0]:
            num += 1
            m += 1
    pairs = np.empty((num, 2), np.int32)
    gain = np.empty(num, np.int64)
    num = 0
    for k in range(len(order)):
        m = k + 1
        while m < len(order) and edges[order[m], 0] == edges[order[k], 0]:
            p = first + edges[order[k], 1]
            q = first + edges[order[m], 1]
            pairs[num, 0] = min(p, q)
            pairs[num, 1] = max(p, q)
            gain[num] = _merge_gain(points, polygons, pairs[num, 0], pairs[num, 1]) if p != q else -1
            num += 1
            m += 1
    merged = np.empty(2 * most, np.int32)
    while True:
        best = -1
        for k in range(num):
            if gain[k] <= 0:
                continue
            if (
                best < 0
                or gain[k] > gain[best]
                or (
                    gain[k] == gain[best]
                    and (
                        pairs[k, 0] < pairs[best, 0] or (pairs[k, 0] == pairs[best, 0] and pairs[k, 1] < pairs[best, 1])
                    )
                )
            ):
                best = k
        if best < 0:
            return last
        p = pairs[best, 0]
        q = pairs[best, 1]
        edge_p, edge_q = _shared_edge(polygons, p, q)
        num_p = _num_corners(polygons, p)
        num_q = _num_corners(polygons, q)
        size = 0
        for k in range(num_p - 1):
            merged[size] = polygons[p, (edge_p + 1 + k) % num_p]
            size += 1
        for k in range(num_q - 1):
            merged[size] = polygons[q, (edge_q + 1 + k) % num_q]
            size += 1
        for k in range(most):
            polygons[p, k] = merged[k] if k < size else -1
        last -= 1
        polygons[q] = polygons[last]
        kept = 0
        for k in range(num):  # q is now part of p, and the last polygon has taken its place
            if k == best:
                continue
            a = pairs[k, 0]
            b = pairs[k, 1]
            a = p if a == q else (q if a == last else a)
            b = p if b == q else (q if b == last else b)
            if a == b:
                continue
            value = gain[k]
            pairs[kept, 0] = min(a, b)
            pairs[kept, 1] = max(a, b)
            if a == p or b == p or a == q or b == q:
                value = _merge_gain(points, polygons, pairs[kept, 0], pairs[kept, 1])
            gain[kept] = value
            kept += 1
        num = kept


@njit(cache=True, nogil=True)
def _fill(start, corners, region, most_corners):
    """Triangulate every contour and merge its triangles; vertices, polygons and their regions."""
    total = len(corners)
    bits = 1
    while (1 << bits) < 2 * total:
        bits += 1
    table = np.full(1 << bits, -1, np.int32)
    chain = np.empty(total, np.int32)
    vertices = np.empty((total, 3), np.int32)
    index = np.empty(total, np.int32)
    num_vertices = 0
    polygons = np.full((total, most_corners), -1, np.int32)
    owner = np.empty(total, np.int32)
    num = 0
    longest = 3
    for c in range(len(region)):
        longest = max(longest, start[c + 1] - start[c])
    ring = np.empty(longest, np.int32)
    flags = np.empty(longest, np.uint8)
    triangles = np.empty((longest, 3), np.int32)
    for c in range(len(region)):
        count = start[c + 1] - start[c]
        for k in range(count):
            ring[k] = start[c] + k
        num_triangles = _cut_ears(corners, ring, flags, count, triangles)
        for k in range(start[c], start[c + 1]):
            x = corners[k, 0]
            y = corners[k, 1]
            z = corners[k, 2]
            slot = (x * 73856093 ^ z * 19349663) & ((1 << bits) - 1)
            v = table[slot]
            while v >= 0 and (vertices[v, 0] != x or vertices[v, 2] != z or abs(vertices[v, 1] - y) > MERGE_HEIGHT):
                v = chain[v]
            if v < 0:
                v = num_vertices
                num_vertices += 1
                vertices[v, 0] = x
                vertices[v, 1] = y
                vertices[v, 2] = z
                chain[v] = table[slot]
                table[slot] = v
            index[k] = v
        first = num
        for t in range(num_triangles):
            a = index[triangles[t, 0]]
            b = index[triangles[t, 1]]
            d = index[triangles[t, 2]]
            if a != b and a != d and b != d and _area2(vertices, a, b, d) <= 0:
                polygons[num, 0] = a
                polygons[num, 1] = b
                polygons[num, 2] = d
                num += 1
        if most_corners > 3 and num > first + 1:
            last = _merge_triangles(vertices, polygons, first, num)
            polygons[last:num] = -1
            num = last
        kept = first  # slivers without area that no polygon took in are left out
        for p in range(first, num):
            flat = True
            for k in range(2, _num_corners(polygons, p)):
                flat = flat and _area2(vertices, polygons[p, 0], polygons[p, k - 1], polygons[p, k]) == 0
            if not flat:
                if kept != p:
                    polygons[kept] = polygons[p]
                owner[kept] = region[c]
                kept += 1
        polygons[kept:num] = -1
        num = kept
    return vertices[:num_vertices].copy(), polygons[:num].copy(), owner[:num].copy()


@njit(cache=True, nogil=True)
def _neighbours(polygons, num_vertices):
    """Polygon across each edge: the one that has the edge in the other direction."""
    neighbours = np.full(polygons.shape, -1, np.int32)
    head = np.full(num_vertices, -1, np.int64)
    chain = np.full(polygons.size, -1, np.int64)
    most = polygons.shape[1]
    for p in range(len(polygons)):
        count = _num_corners(polygons, p)
        for k in range(count):
            if polygons[p, k] < polygons[p, (k + 1) % count]:
                edge = p * most + k
                chain[edge] = head[polygons[p, k]]
                head[polygons[p, k]] = edge
    for p in range(len(polygons)):
        count = _num_corners(polygons, p)
        for k in range(count):
            a = polygons[p, k]
            b = polygons[p, (k + 1) % count]
            if a < b:
                continue
            edge = head[b]
            while edge >= 0:
                q = edge // most
                m = edge % most
                if polygons[q, (m + 1) % _num_corners(polygons, q)] == a and neighbours[q, m] < 0 and q != p:
                    neighbours[q, m] = p
                    neighbours[p, k] = q
                    break
                edge = chain[edge]
    return neighbours
