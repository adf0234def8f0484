"""Where on the floor is a point: the nearest polygon, heights, and the distance to the nearest wall.

The nearest polygon is Detour's ``findNearestPoly`` as Habitat calls it: among polygons that touch the box of half
extents 2, 4, 2 m around the point, a polygon straight above or below costs the height difference beyond the climb,
any other one the distance to its outline; the cheapest wins. A point with floor within the climb below or above it is
found through the grid alone.

One oddity of Detour is kept, because Habitat's recorded answers have it: a box that holds the lower corner of the
scene's bounds sees the scene's first polygon too, however far away that is, so that a few points outside the building
snap to it instead of nowhere.

Before: :mod:`.surface` and :mod:`.planar`. After: :mod:`.step` and :mod:`.geodesic`, which start at a polygon.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prnav.navmesh.planar import TOUCH, cross, length, nearest_on_segment

REACH_XZ = 2.0  #: half extent of the search box in the ground plane [m]
REACH_Y = 4.0  #: half extent of the search box in height [m]


OUTSIDE, INSIDE, RIM = 0, 1, 2


@njit(cache=True, nogil=True)
def inside(s, p, x, z):
    """Whether polygon p holds the ground point: INSIDE, OUTSIDE, or RIM for less than TOUCH outside."""
    box = s.box[p]
    if x < box[0] - TOUCH or x > box[3] + TOUCH or z < box[2] - TOUCH or z > box[5] + TOUCH:
        return OUTSIDE
    first, end = s.start[p], s.start[p + 1]
    ax, az = s.corner[end - 1, 0], s.corner[end - 1, 2]
    result = INSIDE
    for k in range(first, end):
        bx, bz = s.corner[k, 0], s.corner[k, 2]
        dx, dz = bx - ax, bz - az
        side = cross(dx, dz, x - ax, z - az)
        if side < 0.0:
            if side < -TOUCH * length(dx, dz):
                return OUTSIDE
            result = RIM
        ax, az = bx, bz
    return result


@njit(cache=True, nogil=True)
def settle(s, p, x, z, state, out):
    """The floor point of polygon p at a ground point that it holds, into ``out`` (3,); from the rim onto its edge."""
    if state == RIM:
        best, qx, qz = math.inf, x, z
        for k in range(s.start[p], s.start[p + 1]):
            a, b = s.corner[k], s.corner[s.following[k]]
            t, squared = nearest_on_segment(x, z, a[0], a[2], b[0], b[2])
            if squared < best:
                best, qx, qz = squared, a[0] + t * (b[0] - a[0]), a[2] + t * (b[2] - a[2])
        x, z = qx, qz
    out[0], out[1], out[2] = x, height(s, p, x, z), z


@njit(cache=True, nogil=True)
def height(s, p, x, z):
    """Height of polygon p's detail mesh at the ground point, or at the nearest edge of that mesh."""
    first, end = s.detail_start[p], s.detail_start[p + 1]
    for t in range(first, end):
        d = s.detail[t]
        ux, uz, vx, vz = d[3] - d[0], d[5] - d[2], d[6] - d[0], d[8] - d[2]
        area = cross(ux, uz, vx, vz)
        if area <= 1e-12:
            continue
        wx, wz = x - d[0], z - d[2]
        v = cross(ux, uz, wx, wz)
        u = cross(wx, wz, vx, vz)
        if u >= 0.0 and v >= 0.0 and u + v <= area:
            return d[1] + ((d[4] - d[1]) * u + (d[7] - d[1]) * v) / area
    best, result = math.inf, s.detail[first, 1]
    for t in range(first, end):
        d = s.detail[t]
        for e in range(3):
            a, b = 3 * e, 3 * ((e + 1) % 3)
            w, squared = nearest_on_segment(x, z, d[a], d[a + 2], d[b], d[b + 2])
            if squared < best:
                best, result = squared, d[a + 1] + w * (d[b + 1] - d[a + 1])
    return result


@njit(cache=True, nogil=True)
def nearest_outline(s, p, x, z, out):
    """The point of polygon p's detailed outline nearest to a ground point, into ``out`` (3,)."""
    best = math.inf
    for t in range(s.detail_start[p], s.detail_start[p + 1]):
        bits = s.outline[t]
        d = s.detail[t]
        for e in range(3):
            if (bits >> e) & 1:
                a, b = 3 * e, 3 * ((e + 1) % 3)
                w, squared = nearest_on_segment(x, z, d[a], d[a + 2], d[b], d[b + 2])
                if squared < best:
                    best = squared
                    for i in range(3):
                        out[i] = d[a + i] + w * (d[b + i] - d[a + i])
    if best < math.inf:
        return
    first, end = s.start[p], s.start[p + 1]  # a file without outline bits: the polygon's own edges
    for k in range(first, end):
        a, b = s.corner[k], s.corner[s.following[k]]
        w, squared = nearest_on_segment(x, z, a[0], a[2], b[0], b[2])
        if squared < best:
            best = squared
            for i in range(3):
                out[i] = a[i] + w * (b[i] - a[i])


@njit(cache=True, nogil=True)
def coarse(value, unit, span):
    """A coordinate relative to the scene's origin in Detour's whole units, kept inside the scene."""
    return int(min(max(value, 0.0), max(span, 0.0)) * unit)


@njit(cache=True, nogil=True)
def nearest(s, scene, x, y, z, out):
    """Nearest polygon of a scene and the point on it (into ``out``); -1 where the search box meets no polygon."""
    out[0], out[1], out[2] = math.nan, math.nan, math.nan
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        return -1
    gx, gz, cell = s.grid[scene, 0], s.grid[scene, 1], s.grid[scene, 2]
    columns, rows, base = s.grid_shape[scene, 0], s.grid_shape[scene, 1], s.grid_shape[scene, 2]
    unit, climb = s.scene_unit[scene, 0], s.scene_unit[scene, 1]
    across, down = (x - gx) / cell, (z - gz) / cell
    if across > -2.0 and down > -2.0 and across < columns + 1.0 and down < rows + 1.0:
        column = min(max(int(across), 0), columns - 1)
        row = min(max(int(down), 0), rows - 1)
        at = base + row * columns + column
        for i in range(s.cell_start[at], s.cell_start[at + 1]):
            p = s.cell_polygon[i]
            held = inside(s, p, x, z)
            if held != OUTSIDE:
                settle(s, p, x, z, held, out)
                if abs(out[1] - y) <= climb:
                    return p
    out[0], out[1], out[2] = math.nan, math.nan, math.nan
    # the whole box
    scene_box = s.scene_box[scene]
    if x - REACH_XZ >= scene_box[3] or z - REACH_XZ >= scene_box[5]:
        return -1
    if x + REACH_XZ < scene_box[0] or z + REACH_XZ < scene_box[2]:
        return -1
    low = np.empty(3, np.int64)
    high = np.empty(3, np.int64)
    for i in range(3):
        centre = x if i == 0 else (y if i == 1 else z)
        reach = REACH_Y if i == 1 else REACH_XZ
        span = scene_box[3 + i] - scene_box[i]
        low[i] = coarse(centre - reach - scene_box[i], unit, span) & 0xFFFE
        high[i] = (coarse(centre + reach - scene_box[i], unit, span) + 1) | 1
    margin = REACH_XZ + 3.0 / unit
    c0 = int(min(max((x - margin - gx) / cell, 0.0), columns - 1.0))
    c1 = int(min(max((x + margin - gx) / cell, 0.0), columns - 1.0))
    r0 = int(min(max((z - margin - gz) / cell, 0.0), rows - 1.0))
    r1 = int(min(max((z + margin - gz) / cell, 0.0), rows - 1.0))
    best, found = math.inf, -1
    point = np.empty(3)
    for row in range(r0, r1 + 1):
        for column in range(c0, c1 + 1):
            at = base + row * columns + column
            for i in range(s.cell_start[at], s.cell_start[at + 1]):
                p = s.cell_polygon[i]
                b = s.box[p]
                # each polygon once: in the first of its cells that the box meets
                if column != max(c0, int((b[0] - gx) / cell)) or row != max(r0, int((b[2] - gz) / cell)):
                    continue
                q = s.coarse_box[p]
                if (
                    low[0] > q[3]
                    or high[0] < q[0]
                    or low[1] > q[4]
                    or high[1] < q[1]
                    or low[2] > q[5]
                    or high[2] < q[2]
                ):
                    continue
                dx = max(b[0] - x, 0.0, x - b[3])
                dz = max(b[2] - z, 0.0, z - b[5])
                dy = max(b[1] - y, 0.0, y - b[4])
                if dx * dx + dz * dz + max(0.0, dy - climb) ** 2 > best:
                    continue
                held = inside(s, p, x, z)
                if held != OUTSIDE:
                    settle(s, p, x, z, held, point)
                    squared = max(0.0, abs(point[1] - y) - climb) ** 2
                else:
                    nearest_outline(s, p, x, z, point)
                    squared = (point[0] - x) ** 2 + (point[1] - y) ** 2 + (point[2] - z) ** 2
                if squared < best or (squared == best and p < found):
                    best, found = squared, p
                    out[0], out[1], out[2] = point[0], point[1], point[2]
    if low[0] > 0 or low[1] > 0 or low[2] > 0:
        return found
    # Detour's tree has a spare last node of no size at the lower corner that names the first polygon
    p = s.scene_polygon[scene]
    if s.island[p] >= 0:
        held = inside(s, p, x, z)
        if held != OUTSIDE:
            settle(s, p, x, z, held, point)
            squared = max(0.0, abs(point[1] - y) - climb) ** 2
        else:
            nearest_outline(s, p, x, z, point)
            squared = (point[0] - x) ** 2 + (point[1] - y) ** 2 + (point[2] - z) ** 2
        if squared < best:
            found = p
            out[0], out[1], out[2] = point[0], point[1], point[2]
    return found


@njit(cache=True, nogil=True)
def locate_points(s, scenes, points, positions, polygons):
    """Nearest polygons (N,) and points on them (N, 3) of many points; -1 and NaN on a miss."""
    for i in range(len(points)):
        polygons[i] = nearest(s, scenes[i], points[i, 0], points[i, 1], points[i, 2], positions[i])


@njit(cache=True, nogil=True)
def place_on_floor(s, polygons, positions):
    """Set the height of positions (N, 3) whose polygons are known; -1 leaves a row alone."""
    for i in range(len(positions)):
        if polygons[i] >= 0:
            positions[i, 1] = height(s, polygons[i], positions[i, 0], positions[i, 2])


@njit(cache=True, nogil=True)
def place_on_edges(s, polygons, positions):
    """Set the height of positions (N, 3) to that of the nearest edge of their polygons; -1 leaves a row alone."""
    for i in range(len(positions)):
        best = math.inf
        if polygons[i] < 0:
            continue
        for k in range(s.start[polygons[i]], s.start[polygons[i] + 1]):
            a, b = s.corner[k], s.corner[s.following[k]]
            t, squared = nearest_on_segment(positions[i, 0], positions[i, 2], a[0], a[2], b[0], b[2])
            if squared < best:
                best = squared
                positions[i, 1] = a[1] + t * (b[1] - a[1])


@njit(cache=True, nogil=True)
def wall_distances(s, polygons, positions, radius, distances):
    """Distance in the ground plane to the nearest wall that can be reached within it, at most ``radius`` [m]."""
    seen = np.full(len(s.island), -1, np.int64)
    queue = np.empty(len(s.island), np.int32)
    for i in range(len(positions)):
        if polygons[i] < 0:
            distances[i] = math.inf
            continue
        x, z = positions[i, 0], positions[i, 2]
        best = radius * radius
        queue[0] = polygons[i]
        seen[polygons[i]] = i
        head, tail = 0, 1
        while head < tail:
            p = queue[head]
            head += 1
            for k in range(s.start[p], s.start[p + 1]):
                a, b = s.corner[k], s.corner[s.following[k]]
                squared = nearest_on_segment(x, z, a[0], a[2], b[0], b[2])[1]
                if squared > best:
                    continue
                other = s.twin[k]
                if other < 0:
                    best = squared
                elif seen[s.polygon[other]] != i:
                    seen[s.polygon[other]] = i
                    queue[tail] = s.polygon[other]
                    tail += 1
        distances[i] = math.sqrt(best)
