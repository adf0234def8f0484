"""Triangles to solid spans: the voxel columns that every later stage reads (Recast's heightfield and its filters).

The ground plane is a grid of ``width`` (x) by ``depth`` (z) columns, column ``x + z * width``. A column holds spans of
solid matter, lowest first, in cell heights above the lower bound; a span's top may be floor to walk on. Positions are
cut in float32, as Recast does, so that a wall exactly on a grid line falls into the same cell as in Habitat's meshes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_SPAN_HEIGHT = 8191  # highest span top [cell heights]; Recast packs it in 13 bits
OPEN_HEIGHT = 0xFFFF  # where the space above a column's last span ends


class Heightfield(NamedTuple):
    """Solid spans per column, CSR; the arrays' rows are ordered by column, then upwards."""

    width: int  #: columns along x
    depth: int  #: columns along z
    start: NDArray[np.int32]  #: CSR offsets, (width * depth + 1,)
    bottom: NDArray[np.int32]  #: lowest cell of a span [cell heights], (S,)
    top: NDArray[np.int32]  #: cell above a span, where feet stand [cell heights], (S,)
    walkable: NDArray[np.uint8]  #: 1 where a span's top can be walked, (S,)


def grid_size(bounds: NDArray[np.float32], cell_size: float) -> tuple[int, int]:
    """Columns along x and z that cover bounds (2, 3); rounded to the nearest, as Recast does."""
    extent = (bounds[1] - bounds[0]) / np.float32(cell_size) + np.float32(0.5)
    return int(extent[0]), int(extent[2])


def walkable_triangles(vertices: NDArray[np.float32], faces: NDArray[np.int32], max_slope: float) -> NDArray[np.uint8]:
    """1 per triangle that faces up and is flatter than ``max_slope`` [degrees], (F,); degenerate ones get 0."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    normal = np.cross(b - a, c - a)
    length = np.sqrt((normal * normal).sum(axis=1))
    return (normal[:, 1] > np.float32(math.cos(math.radians(max_slope))) * length).astype(np.uint8)


def solid_spans(
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    bounds: NDArray[np.float32],
    cell_size: float,
    cell_height: float,
    max_slope: float,
    walkable_climb: int,
) -> Heightfield:
    """Heightfield of a mesh.

    Where spans touch or overlap they become one, and its top stays walkable if the walkable one of them is at most
    ``walkable_climb`` below it.
    """
    width, depth = grid_size(bounds, cell_size)
    walkable = walkable_triangles(vertices, faces, max_slope)
    sizes = np.array([cell_size, cell_height], np.float32)
    lists = _rasterise(vertices, faces, walkable, bounds, sizes, width, depth, walkable_climb)
    return Heightfield(width, depth, *_columns(*lists))


@njit(cache=True, nogil=True, error_model="numpy")
def _divide(polygon, count, low, high, axis, offset):
    """Cut a convex polygon at ``offset`` along an axis; corners below and above go to ``low`` and ``high``."""
    num_low = 0
    num_high = 0
    before = count - 1
    for here in range(count):
        distance = offset - polygon[here, axis]
        distance_before = offset - polygon[before, axis]
        if (distance >= 0) != (distance_before >= 0):
            s = distance_before / (distance_before - distance)
            for k in range(3):
                value = polygon[before, k] + (polygon[here, k] - polygon[before, k]) * s
                low[num_low, k] = value
                high[num_high, k] = value
            num_low += 1
            num_high += 1
            to_low = distance > 0
            to_high = distance < 0
        else:
            to_low = distance >= 0
            to_high = distance <= 0
        if to_low:
            low[num_low] = polygon[here]
            num_low += 1
        if to_high:
            high[num_high] = polygon[here]
            num_high += 1
        before = here
    return num_low, num_high


@njit(cache=True, nogil=True)
def _add_span(spans, following, head, column, bottom, top, area, climb, free, used):
    """Insert a span in a column's list and swallow those it touches; returns the new list heads of free and used."""
    previous = -1
    current = head[column]
    while current >= 0:
        if spans[current, 0] > top:
            break
        after = following[current]
        if spans[current, 1] < bottom:
            previous = current
        else:
            bottom = min(bottom, spans[current, 0])
            top = max(top, spans[current, 1])
            if abs(top - spans[current, 1]) <= climb:
                area = max(area, spans[current, 2])
            if previous >= 0:
                following[previous] = after
            else:
                head[column] = after
            following[current] = free
            free = current
        current = after
    if free >= 0:
        new = free
        free = following[new]
    else:
        new = used
        used += 1
    spans[new, 0] = bottom
    spans[new, 1] = top
    spans[new, 2] = area
    if previous >= 0:
        following[new] = following[previous]
        following[previous] = new
    else:
        following[new] = head[column]
        head[column] = new
    return free, used


@njit(cache=True, nogil=True, error_model="numpy")
def _rasterise(vertices, faces, walkable, bounds, sizes, width, depth, climb):
    """Lists of spans per column: head (columns,), following (S,), spans (S, 3) = bottom, top, walkable."""
    cell = sizes[0]
    inverse_cell = np.float32(1) / sizes[0]
    inverse_height = np.float32(1) / sizes[1]
    low_x, low_y, low_z = bounds[0, 0], bounds[0, 1], bounds[0, 2]
    range_y = bounds[1, 1] - low_y
    head = np.full(width * depth, -1, np.int32)
    capacity = max(1024, width * depth)
    spans = np.empty((capacity, 3), np.int32)
    following = np.empty(capacity, np.int32)
    free = -1
    used = 0
    rest = np.empty((16, 3), np.float32)
    row = np.empty((16, 3), np.float32)
    piece = np.empty((16, 3), np.float32)
    spare = np.empty((16, 3), np.float32)
    for face in range(len(faces)):
        for k in range(3):
            rest[k] = vertices[faces[face, k]]
        min_x = min(rest[0, 0], rest[1, 0], rest[2, 0])
        max_x = max(rest[0, 0], rest[1, 0], rest[2, 0])
        min_z = min(rest[0, 2], rest[1, 2], rest[2, 2])
        max_z = max(rest[0, 2], rest[1, 2], rest[2, 2])
        z0 = max(int((min_z - low_z) * inverse_cell), -1)
        z1 = min(max(int((max_z - low_z) * inverse_cell), 0), depth - 1)
        z0 = min(z0, depth - 1)
        if z0 == z1 and z0 >= 0:
            x0 = int((min_x - low_x) * inverse_cell)
            single = x0 == int((max_x - low_x) * inverse_cell) and x0 >= 0 and x0 < width
        else:
            single = False
        num_rest = 3
        for z in range(z0, z1 + 1):
            if single:
                num_row = 3
                x1 = x0
            else:
                edge = low_z + np.float32(z) * cell + cell
                num_row, num_rest = _divide(rest, num_rest, row, spare, 2, edge)
                rest, spare = spare, rest
                if num_row < 3 or z < 0:
                    continue
                row_min = row[0, 0]
                row_max = row[0, 0]
                for k in range(1, num_row):
                    row_min = min(row_min, row[k, 0])
                    row_max = max(row_max, row[k, 0])
                x0 = int((row_min - low_x) * inverse_cell)
                x1 = int((row_max - low_x) * inverse_cell)
                if x1 < 0 or x0 >= width:
                    continue
                x0 = max(x0, -1)
                x1 = min(x1, width - 1)
            for x in range(x0, x1 + 1):
                if single:
                    num_piece = 3
                    min_y = min(rest[0, 1], rest[1, 1], rest[2, 1])
                    max_y = max(rest[0, 1], rest[1, 1], rest[2, 1])
                else:
                    edge = low_x + np.float32(x) * cell + cell
                    num_piece, num_row = _divide(row, num_row, piece, spare, 0, edge)
                    row, spare = spare, row
                    if num_piece < 3 or x < 0:
                        continue
                    min_y = piece[0, 1]
                    max_y = piece[0, 1]
                    for k in range(1, num_piece):
                        min_y = min(min_y, piece[k, 1])
                        max_y = max(max_y, piece[k, 1])
                min_y -= low_y
                max_y -= low_y
                if max_y < 0 or min_y > range_y:
                    continue
                min_y = max(min_y, np.float32(0))
                max_y = min(max_y, range_y)
                bottom = min(int(math.floor(min_y * inverse_height)), MAX_SPAN_HEIGHT)
                top = min(max(int(math.ceil(max_y * inverse_height)), bottom + 1), MAX_SPAN_HEIGHT)
                if free < 0 and used == capacity:
                    capacity *= 2
                    old_spans, old_following = spans, following
                    spans = np.empty((capacity, 3), np.int32)
                    following = np.empty(capacity, np.int32)
                    spans[:used] = old_spans
                    following[:used] = old_following
                free, used = _add_span(
                    spans, following, head, x + z * width, bottom, top, walkable[face], climb, free, used
                )
    return head, following, spans


@njit(cache=True, nogil=True)
def _columns(head, following, spans):
    """CSR arrays from the lists."""
    start = np.zeros(len(head) + 1, np.int32)
    count = 0
    for column in range(len(head)):
        current = head[column]
        while current >= 0:
            count += 1
            current = following[current]
        start[column + 1] = count
    bottom = np.empty(count, np.int32)
    top = np.empty(count, np.int32)
    walkable = np.empty(count, np.uint8)
    count = 0
    for column in range(len(head)):
        current = head[column]
        while current >= 0:
            bottom[count] = spans[current, 0]
            top[count] = spans[current, 1]
            walkable[count] = spans[current, 2]
            count += 1
            current = following[current]
    return start, bottom, top, walkable


@njit(cache=True, nogil=True)
def filter_low_obstacles(start, top, walkable, climb):
    """Make a span's top walkable where the span right below it is and the step up is at most ``climb``; in place.

    Curbs and stairs' noses become floor; the mark does not travel on from such a span to the next one.
    """
    for column in range(len(start) - 1):
        below_walkable = False
        for i in range(start[column], start[column + 1]):
            here = walkable[i] != 0
            if not here and below_walkable and abs(top[i] - top[i - 1]) <= climb:
                walkable[i] = walkable[i - 1]
            below_walkable = here


@njit(cache=True, nogil=True)
def filter_ledges(width, depth, start, bottom, top, walkable, height, climb):
    """Refuse spans beside a drop higher than ``climb``, and spans on a slope steeper than it per cell; in place.

    The world outside of the grid counts as a drop.
    """
    for z in range(depth):
        for x in range(width):
            column = x + z * width
            for i in range(start[column], start[column + 1]):
                if walkable[i] == 0:
                    continue
                floor = top[i]
                ceiling = bottom[i + 1] if i + 1 < start[column + 1] else OPEN_HEIGHT
                lowest_drop = OPEN_HEIGHT
                reach_low = floor
                reach_high = floor
                for direction in range(4):
                    nx = x + (direction == 2) - (direction == 0)
                    nz = z + (direction == 1) - (direction == 3)
                    if nx < 0 or nz < 0 or nx >= width or nz >= depth:
                        lowest_drop = min(lowest_drop, -climb - floor)
                        continue
                    first = start[nx + nz * width]
                    last = start[nx + nz * width + 1]
                    next_floor = -climb  # the space below the first span
                    next_ceiling = bottom[first] if first < last else OPEN_HEIGHT
                    if min(ceiling, next_ceiling) - max(floor, next_floor) > height:
                        lowest_drop = min(lowest_drop, next_floor - floor)
                    for j in range(first, last):
                        next_floor = top[j]
                        next_ceiling = bottom[j + 1] if j + 1 < last else OPEN_HEIGHT
                        if min(ceiling, next_ceiling) - max(floor, next_floor) > height:
                            lowest_drop = min(lowest_drop, next_floor - floor)
                            if abs(next_floor - floor) <= climb:
                                reach_low = min(reach_low, next_floor)
                                reach_high = max(reach_high, next_floor)
                if lowest_drop < -climb or reach_high - reach_low > climb:
                    walkable[i] = 0


@njit(cache=True, nogil=True)
def filter_low_ceilings(start, bottom, top, walkable, height):
    """Refuse spans with less than ``height`` free cell heights above; in place."""
    for column in range(len(start) - 1):
        for i in range(start[column], start[column + 1] - 1):
            if bottom[i + 1] - top[i] < height:
                walkable[i] = 0
