"""The walkable cells with their connections: Recast's compact heightfield, eroded, with its distance to the border.

Directions are 0: -x, 1: +z, 2: +x, 3: -z; the one after d, ``(d + 1) % 4``, turns to the next corner of a cell.

Before: :mod:`.heightfield`. After: :mod:`.regions`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.heightfield import OPEN_HEIGHT, Heightfield

FAR = 0x3FFFFFFF


class CompactField(NamedTuple):
    """Floor cells ordered by column, then upwards."""

    width: int  #: columns along x
    depth: int  #: columns along z
    start: NDArray[np.int32]  #: CSR offsets of the columns, (width * depth + 1,)
    column: NDArray[np.int32]  #: column ``x + z * width`` of a cell, (N,)
    floor: NDArray[np.int32]  #: height of the floor [cell heights], (N,)
    connected: NDArray[np.int32]  #: cell that can be walked to per direction, -1 = none, (N, 4)
    area: NDArray[np.uint8]  #: 1 where the body's centre may be, 0 where erosion took it, (N,)


def compact_field(field: Heightfield, walkable_height: int, walkable_climb: int) -> CompactField:
    """Cells for the walkable spans of a heightfield, connected where a body fits and the step is low enough."""
    start, column, floor, free = _floor_cells(field.start, field.bottom, field.top, field.walkable)
    connected = _connect(field.width, field.depth, start, column, floor, free, walkable_height, walkable_climb)
    area = np.ones(len(floor), np.uint8)
    return CompactField(field.width, field.depth, start, column, floor, connected, area)


@njit(cache=True, nogil=True, error_model="numpy")
def _floor_cells(span_start, bottom, top, walkable):
    columns = len(span_start) - 1
    start = np.zeros(columns + 1, np.int32)
    count = 0
    for column in range(columns):
        for i in range(span_start[column], span_start[column + 1]):
            if walkable[i] != 0:
                count += 1
        start[column + 1] = count
    column_of = np.empty(count, np.int32)
    floor = np.empty(count, np.int32)
    free = np.empty(count, np.int32)
    count = 0
    for column in range(columns):
        last = span_start[column + 1]
        for i in range(span_start[column], last):
            if walkable[i] != 0:
                column_of[count] = column
                floor[count] = top[i]
                ceiling = bottom[i + 1] if i + 1 < last else OPEN_HEIGHT
                free[count] = max(ceiling - top[i], 0)
                count += 1
    return start, column_of, floor, free


@njit(cache=True, nogil=True, error_model="numpy")
def _connect(width, depth, start, column_of, floor, free, height, climb):
    connected = np.empty((len(floor), 4), np.int32)
    for i in range(len(floor)):
        x = column_of[i] % width
        z = column_of[i] // width
        for direction in range(4):
            connected[i, direction] = -1
            nx = x + (direction == 2) - (direction == 0)
            nz = z + (direction == 1) - (direction == 3)
            if nx < 0 or nz < 0 or nx >= width or nz >= depth:
                continue
            column = nx + nz * width
            for j in range(start[column], start[column + 1]):
                low = max(floor[i], floor[j])
                high = min(floor[i] + free[i], floor[j] + free[j])
                if high - low >= height and abs(floor[j] - floor[i]) <= climb:
                    connected[i, direction] = j
                    break
    # Where the climb exceeds half the body's height, a cell can reach two floors of one column, and the way back may
    # lead elsewhere. Only mutual connections make borders that close.
    for i in range(len(floor)):
        for direction in range(4):
            j = connected[i, direction]
            if j >= 0 and connected[j, (direction + 2) % 4] != i:
                connected[i, direction] = -1
    return connected


@njit(cache=True, nogil=True, error_model="numpy")
def _chamfer(connected, distance):
    """Spread distances in two sweeps, in place: 2 per step to a side, 3 to a corner (half cells)."""
    count = len(distance)
    for sweep in range(2):
        side = 0 if sweep == 0 else 2
        for k in range(count):
            i = k if sweep == 0 else count - 1 - k
            best = distance[i]
            for turn in range(2):
                ahead = side if turn == 0 else (side + 3) % 4  # -x then -z; +x then +z
                j = connected[i, ahead]
                if j >= 0:
                    best = min(best, distance[j] + 2)
                    corner = connected[j, (ahead + 3) % 4]
                    if corner >= 0:
                        best = min(best, distance[corner] + 3)
            distance[i] = best


@njit(cache=True, nogil=True, error_model="numpy")
def erode(connected, area, radius):
    """Take away the cells nearer than ``radius`` cells to where one cannot walk; ``area`` in place."""
    count = len(area)
    distance = np.empty(count, np.int32)
    for i in range(count):
        sides = 0
        for direction in range(4):
            j = connected[i, direction]
            if j >= 0 and area[j] != 0:
                sides += 1
        distance[i] = FAR if sides == 4 and area[i] != 0 else 0
    _chamfer(connected, distance)
    for i in range(count):
        if distance[i] < 2 * radius:
            area[i] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def border_distance(connected, area):
    """Distance of each cell to the border of its area, blurred, (N,) [half cells]; and the largest before the blur."""
    count = len(area)
    distance = np.empty(count, np.int32)
    for i in range(count):
        sides = 0
        for direction in range(4):
            j = connected[i, direction]
            if j >= 0 and area[j] == area[i]:
                sides += 1
        distance[i] = FAR if sides == 4 else 0
    _chamfer(connected, distance)
    largest = 0
    blurred = np.empty(count, np.int32)
    for i in range(count):
        here = distance[i]
        largest = max(largest, here)
        if here <= 2:
            blurred[i] = here
            continue
        total = here
        for direction in range(4):
            j = connected[i, direction]
            if j >= 0:
                total += distance[j]
                corner = connected[j, (direction + 1) % 4]
                total += distance[corner] if corner >= 0 else here
            else:
                total += 2 * here
        blurred[i] = (total + 5) // 9
    return blurred, largest
