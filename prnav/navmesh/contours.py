"""Regions to outlines: the borders of regions as closed chains of grid corners, simplified (Recast's contours).

A contour is a chain of grid corners x, y, z [cells, cell heights, cells]. Outlines of regions are positively oriented
(counter-clockwise seen from above, see :mod:`prnav.navmesh.polymesh`), holes negatively. Two regions simplify their
common border alike, so that their polygons fit without gaps.

Before: :mod:`.regions`. After: :mod:`.triangles`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.compact import CompactField


class Contours(NamedTuple):
    """Closed chains, CSR."""

    start: NDArray[np.int32]  #: offsets of the contours, (C + 1,)
    corners: NDArray[np.int32]  #: x, y, z per corner, (M, 3)
    region: NDArray[np.int32]  #: region of each contour, (C,)


def region_contours(field: CompactField, region: NDArray[np.int32], max_error: float, max_edge_length: int) -> Contours:
    """Simplified outlines and holes of all regions.

    Args:
        field: The cells.
        region: Region per cell, (N,).
        max_error: Largest deviation from the cells' outline [cells].
        max_edge_length: Longest edge along a wall [cells]; 0 = any.
    """
    borders, total = _border_sides(field.connected, region)
    raw_start, raw, owner = _trace(field.width, field.column, field.floor, field.connected, region, borders, total)
    corners = np.empty((total, 3), np.int32)
    start = np.zeros(len(raw_start), np.int32)
    _simplify(raw_start, raw, np.float32(max_error), max_edge_length, corners, start)
    kept = np.diff(start) > 0
    return Contours(np.append(np.int32(0), start[1:][kept]), corners[: start[-1]], owner[kept])


@njit(cache=True, nogil=True, error_model="numpy")
def _corner_height(floor, connected, i, direction):
    """Highest floor of the up to four cells that meet at a cell's corner."""
    turn = (direction + 1) % 4
    height = floor[i]
    for first, second in ((direction, turn), (turn, direction)):
        j = connected[i, first]
        if j >= 0:
            height = max(height, floor[j])
            corner = connected[j, second]
            if corner >= 0:
                height = max(height, floor[corner])
    return height


@njit(cache=True, nogil=True, error_model="numpy")
def _border_sides(connected, region):
    """Bit per side of a cell where its region ends, (N,), and how many there are; cells that stand alone have none."""
    borders = np.zeros(len(region), np.uint8)
    total = 0
    for i in range(len(region)):
        if region[i] == 0:
            continue
        sides = 0
        bits = 0
        for side in range(4):
            j = connected[i, side]
            if j < 0 or region[j] != region[i]:
                bits |= 1 << side
                sides += 1
        if sides < 4:
            borders[i] = bits
            total += sides
    return borders, total


@njit(cache=True, nogil=True, error_model="numpy")
def _trace(width, column, floor, connected, region, borders, total):
    """Walk along all borders of regions, and clear ``borders`` on the way.

    Returns the offsets of the contours, their corners as rows x, y, z, region beyond, and the contours' regions.
    """
    raw = np.empty((total, 4), np.int32)
    start = np.zeros(total + 1, np.int32)
    owner = np.empty(total, np.int32)
    num = 0
    count = 0
    for cell in range(len(region)):
        while borders[cell] != 0:
            i = np.int64(cell)
            side = 0
            while borders[i] & (1 << side) == 0:
                side += 1
            first_side = side
            while True:
                j = np.int64(connected[i, side])
                if borders[i] & (1 << side):
                    raw[count, 0] = column[i] % width + (side == 1 or side == 2)
                    raw[count, 1] = _corner_height(floor, connected, i, side)
                    raw[count, 2] = column[i] // width + (side == 0 or side == 1)
                    raw[count, 3] = region[j] if j >= 0 else 0
                    count += 1
                    borders[i] &= ~(1 << side)
                    side = (side + 1) % 4
                elif j >= 0:
                    i = j
                    side = (side + 3) % 4
                if i == cell and side == first_side:
                    break
            owner[num] = region[cell]
            num += 1
            start[num] = count
    return start[: num + 1].copy(), raw, owner[:num].copy()


@njit(cache=True, nogil=True, error_model="numpy")
def _deviation(x, z, ax, az, bx, bz):
    """Squared distance of a point to a segment in the ground plane, in float32 (ties fall as in Recast)."""
    along_x = np.float32(bx - ax)
    along_z = np.float32(bz - az)
    dx = np.float32(x - ax)
    dz = np.float32(z - az)
    length = along_x * along_x + along_z * along_z
    t = along_x * dx + along_z * dz
    if length > 0:
        t /= length
    t = min(max(t, np.float32(0)), np.float32(1))
    dx = np.float32(ax) + t * along_x - np.float32(x)
    dz = np.float32(az) + t * along_z - np.float32(z)
    return dx * dx + dz * dz


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(raw, following, max_error, max_edge_length):
    """Choose the corners to keep of one raw contour: fills the ring ``following`` and returns its first corner."""
    count = len(raw)
    head = -1
    tail = -1
    portal = False
    for k in range(count):
        portal = portal or raw[k, 3] != 0
    if portal:  # keep the corners where the region beyond changes
        for k in range(count):
            if raw[k, 3] != raw[(k + 1) % count, 3]:
                if head < 0:
                    head = k
                else:
                    following[tail] = k
                tail = k
    if head < 0:  # an island or a region around a hole: its lower left and upper right corners
        low = 0
        high = 0
        for k in range(count):
            if raw[k, 0] < raw[low, 0] or (raw[k, 0] == raw[low, 0] and raw[k, 2] < raw[low, 2]):
                low = k
            if raw[k, 0] > raw[high, 0] or (raw[k, 0] == raw[high, 0] and raw[k, 2] > raw[high, 2]):
                high = k
        head = low
        if high != low:
            following[low] = high
            tail = high
        else:
            tail = low
    following[tail] = head

    a = head  # add the farthest corner of an edge until none is too far from it
    while True:
        b = int(following[a])
        ax, az, bx, bz = raw[a, 0], raw[a, 2], raw[b, 0], raw[b, 2]
        if bx > ax or (bx == ax and bz > az):  # the same order from both sides of a border
            step = 1
            k = (a + 1) % count
            end = b
        else:
            step = count - 1
            k = (b + step) % count
            end = a
            ax, az, bx, bz = bx, bz, ax, az
        farthest = -1
        largest = np.float32(0)
        if raw[k, 3] == 0:  # only along walls
            while k != end:
                deviation = _deviation(raw[k, 0], raw[k, 2], ax, az, bx, bz)
                if deviation > largest:
                    largest = deviation
                    farthest = k
                k = (k + step) % count
        if farthest >= 0 and largest > max_error * max_error:
            following[a] = farthest
            following[farthest] = b
        else:
            a = b
            if a == head:
                break

    while max_edge_length > 0:  # split long edges along walls
        b = int(following[a])
        middle = -1
        dx = raw[b, 0] - raw[a, 0]
        dz = raw[b, 2] - raw[a, 2]
        if raw[(a + 1) % count, 3] == 0 and dx * dx + dz * dz > max_edge_length * max_edge_length:
            between = b - a if b >= a else b + count - a
            if between > 1:
                forward = dx > 0 or (dx == 0 and dz > 0)
                middle = (a + (between if forward else between + 1) // 2) % count
        if middle >= 0:
            following[a] = middle
            following[middle] = b
        else:
            a = b
            if a == head:
                break
    return head


@njit(cache=True, nogil=True, error_model="numpy")
def _simplify(raw_start, raw, max_error, max_edge_length, corners, start):
    """Chosen corners of all contours; fills ``corners`` and ``start``, whose contours may be empty."""
    longest = 0
    for c in range(len(raw_start) - 1):
        longest = max(longest, raw_start[c + 1] - raw_start[c])
    following = np.empty(longest, np.int64)
    used = 0
    for c in range(len(raw_start) - 1):
        rows = raw[raw_start[c] : raw_start[c + 1]]
        head = _choose(rows, following, max_error, max_edge_length)
        first = used
        a = head
        while True:
            b = int(following[a])
            if rows[a, 0] != rows[b, 0] or rows[a, 2] != rows[b, 2]:  # at one place in the ground plane: one corner
                for axis in range(3):
                    corners[used, axis] = rows[a, axis]
                used += 1
            a = b
            if a == head:
                break
        if used - first < 3:
            used = first
        start[c + 1] = used
