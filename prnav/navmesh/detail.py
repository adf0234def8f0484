"""Height detail: a triangulation of each polygon that follows the floor's height (Recast's detail mesh).

A polygon's outline and inside are sampled on the cells of its region; samples that lie farther from the triangles than
allowed become vertices. Outlines are sampled alike from both sides, so that no seams open. Coordinates here are metres
from the lower bound, in float32: heights are multiples of the cell height, so errors often equal the largest allowed
one, and the same vertices as Habitat's come out only if they round alike.

Before: :mod:`.polygons`. After: :mod:`.polymesh`, the builder's result.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.compact import CompactField
from prnav.navmesh.delaunay import delaunay_triangles, hull_triangles, vertical_errors
from prnav.navmesh.outlines import outline_distance, segment_distance, smallest_extent
from prnav.navmesh.polygons import GridPolygons
from prnav.navmesh.settings import NavMeshSettings

MAX_VERTICES = 127  # of one polygon; Detour counts them in a byte
MAX_EDGE_SAMPLES = 31
MAX_TRIANGLES = 254
OUTLINE_MARGIN = 0.001  # an edge this near to a side of the polygon lies on it [m]
NO_HEIGHT = 0x3FFFFFFF


class HeightDetail(NamedTuple):
    """Extra vertices and triangles by polygon, CSR."""

    vertices: NDArray[np.float64]  #: metres from the lower bound, (D, 3)
    vertex_start: NDArray[np.int32]  #: (P + 1,)
    triangles: NDArray[np.int32]  #: indices into polygon vertices, then these, (T, 3)
    triangle_start: NDArray[np.int32]  #: (P + 1,)
    flags: NDArray[np.uint8]  #: edges on the outline, as in :class:`prnav.navmesh.polymesh.PolyMesh`, (T,)


def height_detail(
    polygons: GridPolygons, field: CompactField, region: NDArray[np.int32], settings: NavMeshSettings
) -> HeightDetail:
    """Detail of all polygons; see :class:`NavMeshSettings` for the sampling distance and the largest error."""
    size = np.array([settings.cell_size, settings.cell_height, settings.cell_size], np.float32)
    sampling = size[0] * np.float32(0.0 if settings.detail_sample_dist < 0.9 else settings.detail_sample_dist)
    max_error = size[1] * np.float32(settings.detail_sample_max_error)
    radius = max(1, math.ceil(settings.edge_max_error))
    counts = (polygons.corners >= 0).sum(axis=1)
    boxes = _boxes(polygons, field)
    largest = int((boxes[:, 2] * boxes[:, 3]).max(initial=1)) if sampling > 0 else 1
    heights = np.empty(largest, np.int32)
    queue = np.empty((largest, 3), np.int64)
    hull = np.empty(MAX_VERTICES + 1, np.int64)
    points = np.empty((MAX_VERTICES + 1, 3), np.float32)
    triangles = np.empty((MAX_TRIANGLES, 3), np.int64)
    added: list[NDArray[np.float64]] = []
    faces: list[NDArray[np.int64]] = []
    flags: list[NDArray[np.uint8]] = []
    num_added = len(polygons.vertices)
    for p, count in enumerate(counts.tolist()):
        corners = polygons.corners[p, :count]
        cells = polygons.vertices[corners]
        points[:count] = cells.astype(np.float32) * size
        hull[:count] = np.arange(count)
        num_points = num_hull = count
        if sampling > 0:
            _height_patch(
                cells,
                polygons.region[p],
                boxes[p],
                field.width,
                field.start,
                field.floor,
                field.connected,
                region,
                heights,
                queue,
            )
            num_points, num_hull = _outline(points, count, sampling, max_error, size, radius, boxes[p], heights, hull)
        num = hull_triangles(points, hull, num_hull, count, triangles)
        if sampling > 0 and smallest_extent(points, count) >= 2 * sampling:
            num_points, num = _add_inner_points(
                points,
                count,
                num_points,
                hull,
                num_hull,
                sampling,
                max_error,
                size,
                radius,
                boxes[p],
                heights,
                triangles,
                num,
            )
        new = points[count:num_points].astype(np.float64) + [
            0.0,
            settings.cell_height,
            0.0,
        ]  # Recast lifts the detail by one cell
        own = np.concatenate([corners, np.arange(num_added, num_added + len(new))])
        num_added += len(new)
        added.append(new)
        faces.append(own[triangles[:num]])
        flags.append(_outline_flags(points[:num_points], count, triangles[:num]))
    return HeightDetail(
        vertices=np.concatenate([np.zeros((0, 3)), *added]),
        vertex_start=np.cumsum([0, *map(len, added)]).astype(np.int32),
        triangles=np.concatenate([np.zeros((0, 3), np.int64), *faces]).astype(np.int32),
        triangle_start=np.cumsum([0, *map(len, faces)]).astype(np.int32),
        flags=np.concatenate([np.zeros(0, np.uint8), *flags]),
    )


def _boxes(polygons: GridPolygons, field: CompactField) -> NDArray[np.int64]:
    """Cells around each polygon: first x, first z, number along x, number along z, (P, 4)."""
    used = (polygons.corners >= 0)[:, :, None]
    places = polygons.vertices[polygons.corners][:, :, [0, 2]]
    low = np.maximum(np.where(used, places, 1 << 30).min(axis=1) - 1, 0)
    high = np.minimum(np.where(used, places, -1).max(axis=1) + 1, [field.width, field.depth])
    return np.concatenate([low, high - low], axis=1)


def _outline_flags(points: NDArray[np.float32], count: int, triangles: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Bits 0, 2, 4 where the edges 01, 12, 20 of triangles lie on a side of the polygon (the first points), (T,)."""
    places = points[:, [0, 2]].astype(np.float64)
    start = places[:count]
    side = np.roll(start, -1, axis=0) - start
    offset = places[:, None] - start
    t = np.clip((offset * side).sum(axis=2) / np.maximum((side**2).sum(axis=1), 1e-12), 0, 1)
    on_side = ((offset - t[:, :, None] * side) ** 2).sum(axis=2) < OUTLINE_MARGIN**2  # (points, sides)
    on_outline = (on_side[triangles] & on_side[np.roll(triangles, -1, axis=1)]).any(axis=2)
    return (on_outline * np.array([1, 4, 16])).sum(axis=1).astype(np.uint8)


def _add_inner_points(
    points: NDArray[np.float32],
    count: int,
    num_points: int,
    hull: NDArray[np.int64],
    num_hull: int,
    sampling: np.float32,
    max_error: np.float32,
    size: NDArray[np.float32],
    radius: int,
    box: NDArray[np.int64],
    heights: NDArray[np.int32],
    triangles: NDArray[np.int64],
    num: int,
) -> tuple[int, int]:
    """Add samples from inside of a polygon, the worst first, until none errs too much.

    Fills ``points`` and ``triangles``; returns the numbers of both.
    """
    low = np.floor(points[:count].min(axis=0) / sampling).astype(np.int64)
    high = np.ceil(points[:count].max(axis=0) / sampling).astype(np.int64)
    samples = np.empty(((high[0] - low[0]) * (high[2] - low[2]), 3), np.float32)
    samples = samples[: _samples(points, count, low, high, sampling, size, radius, box, heights, samples)]
    edges = np.empty((10 * MAX_VERTICES, 4), np.int64)
    while num_points < MAX_VERTICES and len(samples):
        errors = vertical_errors(samples, points, triangles, num)
        worst = int(errors.argmax())
        if errors[worst] <= max_error:
            break
        points[num_points] = samples[worst]
        num_points += 1
        samples = np.delete(samples, worst, axis=0)
        num = delaunay_triangles(points, num_points, hull, num_hull, edges, triangles)
    return num_points, num


@njit(cache=True, nogil=True, error_model="numpy")
def _centre_seed(cells, x0, z0, wide, long, width, start, floor, connected, queue):
    """Find the cell at a polygon's centre from near its corners: the place and index in ``queue[0]``, False if none."""
    best = NO_HEIGHT
    centre_x = 0
    centre_z = 0
    for k in range(len(cells)):
        centre_x += cells[k, 0]
        centre_z += cells[k, 2]
        for place in range(9):
            x = cells[k, 0] + place % 3 - 1
            z = cells[k, 2] + place // 3 - 1
            if x < x0 or z < z0 or x >= x0 + wide or z >= z0 + long:
                continue
            for i in range(start[x + z * width], start[x + z * width + 1]):
                gap = abs(floor[i] - cells[k, 1])
                if gap < best:
                    best = gap
                    queue[0, 0] = x
                    queue[0, 1] = z
                    queue[0, 2] = i
    if best == NO_HEIGHT:
        return False
    centre_x //= len(cells)
    centre_z //= len(cells)
    visited = np.zeros(wide * long, np.bool_)
    visited[queue[0, 0] - x0 + (queue[0, 1] - z0) * wide] = True
    stack = 1
    x = queue[0, 0]
    z = queue[0, 1]
    i = queue[0, 2]
    while stack > 0:  # depth first, towards the centre
        stack -= 1
        x = queue[stack, 0]
        z = queue[stack, 1]
        i = queue[stack, 2]
        if x == centre_x and z == centre_z:
            break
        if x == centre_x:
            direct = 1 if centre_z > z else 3
        else:
            direct = 2 if centre_x > x else 0
        for turn in range(1, 5):
            direction = (direct + turn) % 4  # the direct one last, on top of the stack
            j = connected[i, direction]
            px = x + (direction == 2) - (direction == 0)
            pz = z + (direction == 1) - (direction == 3)
            if j < 0 or px < x0 or pz < z0 or px >= x0 + wide or pz >= z0 + long:
                continue
            if not visited[px - x0 + (pz - z0) * wide]:
                visited[px - x0 + (pz - z0) * wide] = True
                queue[stack, 0] = px
                queue[stack, 1] = pz
                queue[stack, 2] = j
                stack += 1
    queue[0, 0] = x
    queue[0, 1] = z
    queue[0, 2] = i
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _height_patch(cells, own, box, width, start, floor, connected, region, heights, queue):
    """Floor heights around a polygon: of its own region, spread from there to connected cells; fills ``heights``.

    A polygon without cells of its own region spreads from the cell at its centre.
    """
    x0, z0, wide, long = box[0], box[1], box[2], box[3]
    last = 0
    found = False
    for place in range(wide * long):
        heights[place] = NO_HEIGHT
        x = x0 + place % wide
        z = z0 + place // wide
        for i in range(start[x + z * width], start[x + z * width + 1]):
            if region[i] != own:
                continue
            heights[place] = floor[i]
            found = True
            border = False
            for direction in range(4):
                j = connected[i, direction]
                border = border or (j >= 0 and region[j] != own)
            if border:
                queue[last, 0] = x
                queue[last, 1] = z
                queue[last, 2] = i
                last += 1
            break
    if not found and _centre_seed(cells, x0, z0, wide, long, width, start, floor, connected, queue):
        heights[queue[0, 0] - x0 + (queue[0, 1] - z0) * wide] = floor[queue[0, 2]]
        last = 1
    head = 0
    while head < last:
        x = queue[head, 0]
        z = queue[head, 1]
        i = queue[head, 2]
        head += 1
        for direction in range(4):
            j = connected[i, direction]
            px = x + (direction == 2) - (direction == 0) - x0
            pz = z + (direction == 1) - (direction == 3) - z0
            if j < 0 or px < 0 or pz < 0 or px >= wide or pz >= long or heights[px + pz * wide] != NO_HEIGHT:
                continue
            heights[px + pz * wide] = floor[j]
            queue[last, 0] = px + x0
            queue[last, 1] = pz + z0
            queue[last, 2] = j
            last += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _height(x, y, z, size, radius, box, heights):
    """Floor height at a point [m]; where its cell has none, the nearest to y of the closest ring of cells."""
    x0, z0, wide, long = box[0], box[1], box[2], box[3]
    cell_height = size[1]
    per_cell, margin = np.float32(1) / size[0], np.float32(0.01)
    px = min(max(int(math.floor(x * per_cell + margin)) - x0, 0), wide - 1)
    pz = min(max(int(math.floor(z * per_cell + margin)) - z0, 0), long - 1)
    height = heights[px + pz * wide]
    if height != NO_HEIGHT:
        return np.float32(height) * cell_height
    for ring in range(1, radius + 1):
        nearest = np.float32(np.inf)
        for qz in range(max(pz - ring, 0), min(pz + ring + 1, long)):
            for qx in range(max(px - ring, 0), min(px + ring + 1, wide)):
                if max(abs(qx - px), abs(qz - pz)) != ring:
                    continue
                candidate = heights[qx + qz * wide]
                if candidate != NO_HEIGHT and abs(np.float32(candidate) * cell_height - y) < nearest:
                    nearest = abs(np.float32(candidate) * cell_height - y)
                    height = candidate
        if height != NO_HEIGHT:
            return np.float32(height) * cell_height
    return y


@njit(cache=True, nogil=True, error_model="numpy")
def _outline(points, count, sampling, max_error, size, radius, box, heights, hull):
    """Add the vertices that the outline's height needs; fills ``hull``, returns the numbers of points and of hull."""
    num_points = count
    num_hull = 0
    edge = np.empty((MAX_EDGE_SAMPLES + 1, 3), np.float32)
    chosen = np.empty(MAX_EDGE_SAMPLES + 1, np.int64)
    before = count - 1
    for i in range(count):
        a = before
        b = i
        hull[num_hull] = before
        num_hull += 1
        before = i
        if abs(points[a, 0] - points[b, 0]) < 1e-6:
            swapped = points[a, 2] > points[b, 2]
        else:
            swapped = points[a, 0] > points[b, 0]
        if swapped:  # the same order from both sides of an edge
            a, b = b, a
        dx, dz = points[b, 0] - points[a, 0], points[b, 2] - points[a, 2]
        parts = min(1 + int(math.floor(math.sqrt(dx * dx + dz * dz) / sampling)), MAX_EDGE_SAMPLES)
        parts = min(parts, MAX_VERTICES - 1 - num_points)
        if parts < 2:
            continue
        for k in range(parts + 1):
            share = np.float32(k) / np.float32(parts)
            for axis in range(3):
                edge[k, axis] = points[a, axis] + (points[b, axis] - points[a, axis]) * share
            edge[k, 1] = _height(edge[k, 0], edge[k, 1], edge[k, 2], size, radius, box, heights)
        chosen[0] = 0
        chosen[1] = parts
        num = 2
        k = 0
        while k < num - 1:
            first = chosen[k]
            last = chosen[k + 1]
            largest = np.float32(0)
            farthest = -1
            for m in range(first + 1, last):
                deviation = segment_distance(
                    edge[m, 0],
                    edge[m, 1],
                    edge[m, 2],
                    edge[first, 0],
                    edge[first, 1],
                    edge[first, 2],
                    edge[last, 0],
                    edge[last, 1],
                    edge[last, 2],
                )
                if deviation > largest:
                    largest = deviation
                    farthest = m
            if farthest >= 0 and largest > max_error * max_error:
                for m in range(num, k + 1, -1):
                    chosen[m] = chosen[m - 1]
                chosen[k + 1] = farthest
                num += 1
            else:
                k += 1
        for k in range(1, num - 1):
            sample = chosen[num - 1 - k if swapped else k]
            for axis in range(3):
                points[num_points, axis] = edge[sample, axis]
            hull[num_hull] = num_points
            num_hull += 1
            num_points += 1
    return num_points, num_hull


@njit(cache=True, nogil=True, error_model="numpy")
def _samples(points, count, low, high, sampling, size, radius, box, heights, samples):
    """Samples on a grid inside a polygon, not too near to its outline; fills ``samples``, returns how many."""
    low_y = points[0, 1]
    high_y = points[0, 1]
    for k in range(1, count):
        low_y = min(low_y, points[k, 1])
        high_y = max(high_y, points[k, 1])
    num = 0
    for column in range(low[2], high[2]):
        for row in range(low[0], high[0]):
            x = np.float32(row) * sampling
            z = np.float32(column) * sampling
            if outline_distance(points, count, x, z) > -sampling / np.float32(2):
                continue
            # off the grid by a little, as symmetric points triangulate badly: pseudo-random numbers in -1..1
            jitter_x = np.float32((num * 0x8DA6B343) & 0xFFFF) / np.float32(65535) * np.float32(2) - np.float32(1)
            jitter_z = np.float32((num * 0xD8163841) & 0xFFFF) / np.float32(65535) * np.float32(2) - np.float32(1)
            samples[num, 0] = x + jitter_x * size[0] * np.float32(0.1)
            samples[num, 1] = _height(x, (low_y + high_y) * np.float32(0.5), z, size, radius, box, heights)
            samples[num, 2] = z + jitter_z * size[2] * np.float32(0.1)
            num += 1
    return num
