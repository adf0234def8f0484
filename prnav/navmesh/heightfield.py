"""Triangles to solid spans: the voxel columns that every later stage reads (Recast's heightfield and its filters).

The ground plane is a grid of ``width`` (x) by ``depth`` (z) columns, column ``x + z * width``. A column holds spans of
solid matter, lowest first, in cell heights above the lower bound; a span's top may be floor to walk on. Positions are
cut in float32, as Recast does, so that a wall exactly on a grid line falls into the same cell as in Habitat's meshes.

Before: :mod:`.build` hands over triangles. After: :mod:`.compact`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_SPAN_HEIGHT = 8191  # highest span top [cell heights]; Recast packs it in 13 bits
OPEN_HEIGHT = 0xFFFF  # where the space above a column's last span ends
BOTTOM, TOP, AREA, NEXT = range(4)  # columns of a list's row


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
    head = np.full(width * depth, -1, np.int32)
    spans = _rasterise(vertices, faces, walkable, bounds, sizes, width, depth, walkable_climb, head)
    start = np.zeros(width * depth + 1, np.int32)
    return Heightfield(width, depth, start, *_columns(head, spans, start))


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
        for k in range(3):
            if to_low:
                low[num_low, k] = polygon[here, k]
            if to_high:
                high[num_high, k] = polygon[here, k]
        num_low += to_low
        num_high += to_high
        before = here
    return num_low, num_high


@njit(cache=True, nogil=True, error_model="numpy")
def _add_span(spans, head, column, bottom, top, area, climb, ends):
    """Insert a span in a column's list and swallow those it touches.

    ``ends`` holds the first free row (-1 = none) and the number of rows in use.
    """
    previous = np.int64(-1)
    current = np.int64(head[column])
    while current >= 0:
        if spans[current, BOTTOM] > top:
            break
        after = np.int64(spans[current, NEXT])
        if spans[current, TOP] < bottom:
            previous = current
        else:
            bottom = min(bottom, spans[current, BOTTOM])
            top = max(top, spans[current, TOP])
            if abs(top - spans[current, TOP]) <= climb:
                area = max(area, spans[current, AREA])
            if previous >= 0:
                spans[previous, NEXT] = after
            else:
                head[column] = after
            spans[current, NEXT] = ends[0]
            ends[0] = current
        current = after
    new = ends[0]
    if new >= 0:
        ends[0] = spans[new, NEXT]
    else:
        new = ends[1]
        ends[1] += 1
    spans[new, BOTTOM] = bottom
    spans[new, TOP] = top
    spans[new, AREA] = area
    if previous >= 0:
        spans[new, NEXT] = spans[previous, NEXT]
        spans[previous, NEXT] = new
    else:
        spans[new, NEXT] = head[column]
        head[column] = new


@njit(cache=True, nogil=True, error_model="numpy")
def _rasterise(vertices, faces, walkable, bounds, sizes, width, depth, climb, head):
    """Lists of spans per column: fills ``head`` (columns,) and returns rows bottom, top, walkable, next."""
    cell = sizes[0]
    inverse_cell = np.float32(1) / sizes[0]
    inverse_height = np.float32(1) / sizes[1]
    low_x, low_y, low_z = bounds[0, 0], bounds[0, 1], bounds[0, 2]
    range_y = bounds[1, 1] - low_y
    capacity = max(1024, width * depth)
    spans = np.empty((capacity, 4), np.int32)
    ends = np.array([-1, 0])
    rest = np.empty((16, 3), np.float32)
    row = np.empty((16, 3), np.float32)
    piece = np.empty((16, 3), np.float32)
    spare = np.empty((16, 3), np.float32)
    axis_x = np.int64(0)
    axis_z = np.int64(2)
    for face in range(len(faces)):
        for corner in range(3):
            for k in range(3):
                rest[corner, k] = vertices[faces[face, corner], k]
        min_x = min(rest[0, 0], rest[1, 0], rest[2, 0])
        max_x = max(rest[0, 0], rest[1, 0], rest[2, 0])
        min_z = min(rest[0, 2], rest[1, 2], rest[2, 2])
        max_z = max(rest[0, 2], rest[1, 2], rest[2, 2])
        z0 = min(max(int((min_z - low_z) * inverse_cell), -1), depth - 1)
        z1 = min(max(int((max_z - low_z) * inverse_cell), 0), depth - 1)
        x0 = int((min_x - low_x) * inverse_cell)
        x1 = int((max_x - low_x) * inverse_cell)
        single = z0 == z1 and z0 >= 0 and x0 == x1 and x0 >= 0 and x0 < width
        num_rest = np.int64(3)
        for z in range(z0, z1 + 1):
            num_row = np.int64(3)
            if not single:
                edge = low_z + np.float32(z) * cell + cell
                num_row, num_rest = _divide(rest, num_rest, row, spare, axis_z, edge)
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
                    num_piece = np.int64(3)
                    source = rest
                else:
                    edge = low_x + np.float32(x) * cell + cell
                    num_piece, num_row = _divide(row, num_row, piece, spare, axis_x, edge)
                    row, spare = spare, row
                    if num_piece < 3 or x < 0:
                        continue
                    source = piece
                min_y = source[0, 1]
                max_y = source[0, 1]
                for k in range(1, num_piece):
                    min_y = min(min_y, source[k, 1])
                    max_y = max(max_y, source[k, 1])
                min_y -= low_y
                max_y -= low_y
                if max_y < 0 or min_y > range_y:
                    continue
                min_y = max(min_y, np.float32(0))
                max_y = min(max_y, range_y)
                bottom = min(int(math.floor(min_y * inverse_height)), MAX_SPAN_HEIGHT)
                top = min(max(int(math.ceil(max_y * inverse_height)), bottom + 1), MAX_SPAN_HEIGHT)
                if ends[0] < 0 and ends[1] == capacity:
                    larger = np.empty((2 * capacity, 4), np.int32)
                    for i in range(capacity):
                        for k in range(4):
                            larger[i, k] = spans[i, k]
                    spans = larger
                    capacity *= 2
                _add_span(spans, head, x + z * width, bottom, top, np.int64(walkable[face]), climb, ends)
    return spans


@njit(cache=True, nogil=True, error_model="numpy")
def _columns(head, spans, start):
    """CSR arrays from the lists; fills ``start``."""
    count = 0
    for column in range(len(head)):
        current = head[column]
        while current >= 0:
            count += 1
            current = spans[current, NEXT]
        start[column + 1] = count
    bottom = np.empty(count, np.int32)
    top = np.empty(count, np.int32)
    walkable = np.empty(count, np.uint8)
    count = 0
    for column in range(len(head)):
        current = head[column]
        while current >= 0:
            bottom[count] = spans[current, BOTTOM]
            top[count] = spans[current, TOP]
            walkable[count] = spans[current, AREA]
            count += 1
            current = spans[current, NEXT]
    return bottom, top, walkable


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def filter_low_ceilings(start, bottom, top, walkable, height):
    """Refuse spans with less than ``height`` free cell heights above; in place."""
    for column in range(len(start) - 1):
        for i in range(start[column], start[column + 1] - 1):
            if bottom[i + 1] - top[i] < height:
                walkable[i] = 0
