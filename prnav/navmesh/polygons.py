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
EAR, NO_EAR = 1, 0  # a corner that may be cut off
UNKNOWN = -2  # not found out yet


class GridPolygons(NamedTuple):
    """Convex polygons on the grid; unused places of the fixed-size rows are -1."""

    vertices: NDArray[np.int64]  #: x, y, z [cells, cell heights, cells], (V, 3)
    corners: NDArray[np.int64]  #: vertex per corner, (P, most corners)
    neighbours: NDArray[np.int64]  #: polygon across the edge from corner k to the next, -1 = wall, (P, most corners)
    region: NDArray[np.int64]  #: region of each polygon, (P,)


def convex_polygons(contours: Contours, num_regions: int, most_corners: int) -> GridPolygons:
    """Convex polygons of at most ``most_corners`` corners that fill the contours."""
    start, corners, region = _outlines(contours, num_regions)
    num_triangles = np.zeros(len(region), np.int64)
    triangles = np.empty((len(corners), 3), np.int64)
    _cut_ears(corners, start, num_triangles, triangles)
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


def _outlines(contours: Contours, num_regions: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Contours with their holes joined in: offsets, corners and regions."""
    start = contours.start.astype(np.int64)
    corners = contours.corners.astype(np.int64)
    region = contours.region.astype(np.int64)
    x, _, z = corners.T
    after = np.arange(1, len(corners) + 1)
    after[start[1:] - 1] = start[:-1]
    area = np.add.reduceat(z * x[after] - x * z[after], start[:-1]) if len(region) else np.zeros(0, np.int64)
    hole = area <= -3  # a sliver's area rounds to none
    outline = np.full(num_regions + 1, -1)
    outline[region[~hole]] = np.flatnonzero(~hole)
    # holes of a region from left to right, by their leftmost corner
    order = np.lexsort((z, x, np.repeat(np.arange(len(region)), np.diff(start))))
    leftmost = order[start[:-1]]
    holes = np.flatnonzero(hole)
    holes = holes[np.lexsort((holes, z[leftmost[holes]], x[leftmost[holes]], region[holes]))]
    hole_start = np.searchsorted(region[holes], np.arange(num_regions + 2))
    if len(holes) == 0:
        return start, corners, region
    return _join_holes(start, corners, region, outline, hole, leftmost, holes, hole_start)


@njit(cache=True, nogil=True, error_model="numpy")
def _area2(points, a, b, c):
    """Twice the signed area of a triangle of points (rows of x, y, z)."""
    return (points[b, 0] - points[a, 0]) * (points[c, 2] - points[a, 2]) - (points[c, 0] - points[a, 0]) * (
        points[b, 2] - points[a, 2]
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _spans(points, a, b, c):
    """Whether c, on the line through a and b, lies on the segment between them."""
    axis = 0 if points[a, 0] != points[b, 0] else 2
    u, v, w = points[a, axis], points[b, axis], points[c, axis]
    return min(u, v) <= w <= max(u, v)


@njit(cache=True, nogil=True, error_model="numpy")
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
    for k in range(4):  # an end of one on the other
        area = abc if k == 0 else (abd if k == 1 else (cda if k == 2 else cdb))
        if area == 0 and _spans(
            points, a if k < 2 else c, b if k < 2 else d, c if k == 0 else (d if k == 1 else (a if k == 2 else b))
        ):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _in_cone(points, before, here, after, target, loose):
    """Whether the segment from a corner to ``target`` starts inwards; unless ``loose``, along a side does not count."""
    to_before = _area2(points, here, target, before)
    from_after = _area2(points, target, here, after)
    if _area2(points, before, here, after) <= 0:  # convex
        if loose:
            return to_before <= 0 and from_after <= 0
        return to_before < 0 and from_after < 0
    return not (_area2(points, here, target, after) <= 0 and _area2(points, target, here, before) <= 0)


@njit(cache=True, nogil=True, error_model="numpy")
def _blocked(points, ring, count, i, j, a, b, loose):
    """Whether the segment ab crosses a ring; sides at ring positions i and j, or that end at a or b, do not count."""
    ax, az, bx, bz = points[a, 0], points[a, 2], points[b, 0], points[b, 2]
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        if k == i or following == i or k == j or following == j:
            continue
        c = ring[k]
        d = ring[following]
        cx, cz, dx, dz = points[c, 0], points[c, 2], points[d, 0], points[d, 2]
        touches = (
            (cx == ax and cz == az) or (cx == bx and cz == bz) or (dx == ax and dz == az) or (dx == bx and dz == bz)
        )
        if not touches and _cross(points, a, b, c, d, loose):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _join_holes(start, corners, region, outline, hole, leftmost, holes, hole_start):
    """Bridge each region's holes into its outline; contours CSR without holes.

    Holes are taken from left to right; a bridge goes from a hole's corner to the nearest outline corner that it reaches
    without crossing anything. A hole that no bridge reaches is left out, as in Recast.
    """
    total = len(corners) + 2 * len(region)
    joined = np.empty((total, 3), np.int64)
    joined_start = np.zeros(len(region) + 1, np.int64)
    joined_region = np.empty(len(region), np.int64)
    num_joined = 0
    used = 0
    ring = np.empty(total, np.int64)  # rows of corners
    spare = np.empty(total, np.int64)
    probe = np.empty(total, np.int64)
    distance = np.empty(total, np.int64)
    strict = total < 0  # False, as a variable: numba compiles a constant anew
    for c in range(len(region)):
        if hole[c]:
            continue
        count = start[c + 1] - start[c]
        for k in range(count):
            ring[k] = start[c] + k
        first_hole = hole_start[region[c]]
        last_hole = hole_start[region[c] + 1] if outline[region[c]] == c else first_hole
        for h in range(first_hole, last_hole):
            begin = start[holes[h]]
            size = start[holes[h] + 1] - begin
            corner = leftmost[holes[h]] - begin
            bridge = -1
            for _ in range(size):
                point = begin + corner
                for k in range(count):
                    before = ring[k - 1 if k > 0 else count - 1]
                    after = ring[k + 1 if k + 1 < count else 0]
                    dx = corners[ring[k], 0] - corners[point, 0]
                    dz = corners[ring[k], 2] - corners[point, 2]
                    inwards = _in_cone(corners, before, ring[k], after, point, strict)
                    distance[k] = dx * dx + dz * dz if inwards else -1
                while bridge < 0:  # nearest first
                    nearest = -1
                    for k in range(count):
                        if distance[k] >= 0 and (nearest < 0 or distance[k] < distance[nearest]):
                            nearest = k
                    if nearest < 0:
                        break
                    distance[nearest] = -1
                    clear = True
                    for other in range(h - 1, last_hole):  # the outline, then this and the later holes
                        num_probe = count
                        skip = nearest
                        for k in range(count):
                            probe[k] = ring[k]
                        if other >= h:
                            num_probe = start[holes[other] + 1] - start[holes[other]]
                            skip = -1
                            for k in range(num_probe):
                                probe[k] = start[holes[other]] + k
                        if _blocked(corners, probe, num_probe, skip, skip, ring[nearest], point, strict):
                            clear = False
                            break
                    if clear:
                        bridge = nearest
                if bridge >= 0:
                    break
                corner = (corner + 1) % size
            if bridge >= 0:
                for k in range(count + 1):
                    spare[k] = ring[(bridge + k) % count]
                for k in range(size + 1):
                    spare[count + 1 + k] = begin + (corner + k) % size
                ring, spare = spare, ring
                count += size + 2
        for k in range(count):
            for axis in range(3):
                joined[used + k, axis] = corners[ring[k], axis]
        used += count
        joined_region[num_joined] = region[c]
        num_joined += 1
        joined_start[num_joined] = used
    return joined_start[: num_joined + 1].copy(), joined[:used].copy(), joined_region[:num_joined].copy()


@njit(cache=True, nogil=True, error_model="numpy")
def _cut_ears(points, start, num_triangles, triangles):
    """Triangulate contours; the shortest diagonal goes first. The triangles of contour c are rows from ``start[c]`` on.

    Where a contour overlaps itself, diagonals may touch sides, and what cannot be cut even so is left out.
    """
    longest = np.int64(0)
    for c in range(len(num_triangles)):
        longest = max(longest, start[c + 1] - start[c])
    ring = np.empty(longest, np.int64)
    ear = np.empty(longest, np.int64)
    for c in range(len(num_triangles)):
        count = start[c + 1] - start[c]
        for k in range(count):
            ring[k] = start[c] + k
            ear[k] = UNKNOWN
        num = start[c]
        while count >= 3:
            best = np.int64(0 if count == 3 else -1)
            shortest = np.int64(0)
            for attempt in range(2):
                loose = attempt > 0
                if best >= 0:
                    break
                for i in range(count):
                    middle = i + 1 if i + 1 < count else 0
                    after = middle + 1 if middle + 1 < count else 0
                    fits = ear[middle] == EAR
                    if loose or ear[middle] == UNKNOWN:
                        before = ring[i - 1 if i > 0 else count - 1]
                        fits = _in_cone(points, before, ring[i], ring[middle], ring[after], loose) and not _blocked(
                            points, ring, count, i, after, ring[i], ring[after], loose
                        )
                    if not loose:
                        ear[middle] = EAR if fits else NO_EAR
                    if not fits:
                        continue
                    end = after
                    if loose:
                        end = after + 1 if after + 1 < count else 0
                    dx = points[ring[end], 0] - points[ring[i], 0]
                    dz = points[ring[end], 2] - points[ring[i], 2]
                    length = dx * dx + dz * dz
                    if best < 0 or length < shortest:
                        shortest = length
                        best = np.int64(i)
            if best < 0:
                break
            middle = best + 1 if best + 1 < count else 0
            after = middle + 1 if middle + 1 < count else 0
            triangles[num, 0] = ring[best]
            triangles[num, 1] = ring[middle]
            triangles[num, 2] = ring[after]
            num += 1
            if count == 3:
                break
            count -= 1
            for k in range(middle, count):
                ring[k] = ring[k + 1]
                ear[k] = ear[k + 1]
            if middle >= count:
                middle = 0
            ear[middle] = UNKNOWN
            ear[middle - 1 if middle > 0 else count - 1] = UNKNOWN
        num_triangles[c] = num - start[c]


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
        v = table[slot] - 1
        while v >= 0 and (vertices[v, 0] != x or vertices[v, 2] != z or abs(vertices[v, 1] - y) > MERGE_HEIGHT):
            v = chain[v]
        if v < 0:
            v = np.int64(num)
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
        before = polygons[one, (at_one + num_one - 1) % num_one]
        if _area2(points, before, polygons[one, at_one], polygons[two, (at_two + 2) % num_two]) >= 0:
            return np.int64(-1)
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
