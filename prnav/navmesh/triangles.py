"""Outlines to triangles: holes are bridged into their outlines, then ears are cut (Recast's triangulation).

All geometry is exact: grid corners are integers, and predicates are signs of integer areas. With x to the right and z
*down* the page, ``_area2 < 0`` means that c lies left of the line from a to b, seen from above.

Before: :mod:`.contours`. After: :mod:`.polygons`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.contours import Contours

EAR, NO_EAR = 1, 0  # a corner that may be cut off
UNKNOWN = -2  # not found out yet


def contour_triangles(
    contours: Contours, num_regions: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Triangles that fill the contours.

    Returns:
        Offsets of the contours with their holes joined in, (C + 1,); their corners, (M, 3); their regions, (C,); the
        number of triangles of each, (C,); and the triangles' corners, (M, 3), those of contour c from row
        ``start[c]`` on.
    """
    start, corners, region = _outlines(contours, num_regions)
    num_triangles = np.zeros(len(region), np.int64)
    triangles = np.empty((len(corners), 3), np.int64)
    _cut_ears(corners, start, num_triangles, triangles)
    return start, corners, region, num_triangles, triangles


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
            best = 0 if count == 3 else -1
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
                        best = i
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
