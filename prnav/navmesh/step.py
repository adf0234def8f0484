"""One agent's move: along the straight line until a wall, then, where sliding is on, to the best point near it.

Without sliding a move ends where its segment meets the first wall. With sliding it ends where Detour's
``moveAlongSurface`` would end it: at the wanted end if a local search over polygons gets there, else at the wall
point nearest to it. That search may reach over a thin wall or round a corner; where the straight segment to its
answer would leave the floor, the move ends at the point nearest to the wanted end among those it can go to in a
straight line, so that no move ever passes a wall.

Before: :mod:`.locate` has found the polygon of the start. After: :mod:`.queries`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prnav.navmesh.planar import TOUCH, cross, length, nearest_on_segment

MAX_VISITED = 64  #: polygons of the local search (Detour's pool of nodes)
MAX_WAITING = 48  #: polygons waiting in it (Detour's stack)
MARGIN = 0.001  #: by which Detour widens the disc of the search [m]

BLOCKED, REACHED = 0, 1


@njit(cache=True, nogil=True)
def through_vertex(s, corner, dx, dz):
    """The polygon around a vertex into which a direction points; -1 where that is a wall. ``corner`` names the fan."""
    for turn in range(2):
        k = corner
        for _ in range(1024):
            end = s.following[k]
            first = s.start[s.polygon[k]]
            before = k - 1 if k > first else s.start[s.polygon[k] + 1] - 1
            x, z = s.corner[k, 0], s.corner[k, 2]
            ux, uz = s.corner[end, 0] - x, s.corner[end, 2] - z
            vx, vz = s.corner[before, 0] - x, s.corner[before, 2] - z
            if (
                cross(ux, uz, dx, dz) >= -1e-12 * length(ux, uz)
                and cross(dx, dz, vx, vz) >= -1e-12 * length(vx, vz)
                and (ux * dx + uz * dz > 0.0 or vx * dx + vz * dz > 0.0 or cross(ux, uz, dx, dz) > 0.0)
            ):
                return s.polygon[k]
            other = s.twin[k] if turn == 0 else s.twin[before]
            if other < 0:
                break
            k = s.following[other] if turn == 0 else other
            if k == corner:
                return -1
    return -1


@njit(cache=True, nogil=True)
def walk(s, p, x, z, ex, ez, out):
    """Go straight from a point of polygon p towards an end; the ground point reached into ``out`` (2,).

    Returns the polygon there, and REACHED or BLOCKED.
    """
    out[0], out[1] = ex, ez
    dx, dz = ex - x, ez - z
    far = length(dx, dz)
    if far == 0.0:
        return p, REACHED
    ux, uz = dx / far, dz / far
    for _ in range(4 * len(s.island) + 16):
        best, edge, others = math.inf, -1, False
        for k in range(s.start[p], s.start[p + 1]):
            n = s.following[k]
            ax, az = s.corner[k, 0], s.corner[k, 2]
            lx, lz = s.corner[n, 0] - ax, s.corner[n, 2] - az
            scale = length(lx, lz)
            side_end = cross(lx, lz, ex - ax, ez - az)
            if side_end >= -TOUCH * scale:
                continue
            side = max(0.0, cross(lx, lz, x - ax, z - az))
            t = side / (side - side_end)
            others = others or abs(t - best) * far <= TOUCH
            if t < best:
                best, edge = t, k
        if edge < 0:
            return p, REACHED
        hx, hz = x + best * dx, z + best * dz
        if others:  # edges in one line, or a corner: the one that is met
            near = math.inf
            for k in range(s.start[p], s.start[p + 1]):
                n = s.following[k]
                ax, az, bx, bz = s.corner[k, 0], s.corner[k, 2], s.corner[n, 0], s.corner[n, 2]
                if cross(bx - ax, bz - az, ex - ax, ez - az) >= -TOUCH * length(bx - ax, bz - az):
                    continue
                squared = nearest_on_segment(hx, hz, ax, az, bx, bz)[1]
                if squared < near:
                    near, edge = squared, k
        n = s.following[edge]
        corner = -1
        if length(s.corner[edge, 0] - hx, s.corner[edge, 2] - hz) <= TOUCH:
            corner = edge
        elif length(s.corner[n, 0] - hx, s.corner[n, 2] - hz) <= TOUCH:
            corner = n
        onward = -1
        if corner >= 0:
            onward = through_vertex(s, corner, ux, uz)
            if onward == p:
                onward = -1
        if onward < 0 and s.twin[edge] >= 0:
            onward = s.polygon[s.twin[edge]]
        if onward < 0:
            out[0], out[1] = hx, hz
            return p, BLOCKED
        p = onward
    out[0], out[1] = x, z
    return p, BLOCKED


@njit(cache=True, nogil=True)
def search_disc(s, p, x, z, ex, ez, lift, out, visited):
    """Detour's local search: the end if a polygon near the move holds it, else the wall point nearest to it.

    The point goes into ``out`` (2,). Returns its polygon (-1 if there is none), REACHED or BLOCKED, and the number of
    polygons in ``visited``.
    """
    cx, cz = 0.5 * (x + ex), 0.5 * (z + ez)
    reach = (0.5 * math.sqrt((ex - x) ** 2 + (ez - z) ** 2 + lift * lift) + MARGIN) ** 2
    visited[0] = p
    count, head = 1, 0
    best, found = math.inf, -1
    while head < count:
        p = visited[head]
        head += 1
        hit = True
        for k in range(s.start[p], s.start[p + 1]):
            a, b = s.corner[k], s.corner[s.following[k]]
            lx, lz = b[0] - a[0], b[2] - a[2]
            if cross(lx, lz, ex - a[0], ez - a[2]) < 0.0:
                hit = False
                break
        if hit:
            out[0], out[1] = ex, ez
            return p, REACHED, count
        first, end = s.start[p], s.start[p + 1]
        for n in range(end - first):
            k = end - 1 if n == 0 else first + n - 1
            a, b = s.corner[k], s.corner[s.following[k]]
            other = s.twin[k]
            if other < 0:
                t, squared = nearest_on_segment(ex, ez, a[0], a[2], b[0], b[2])
                if squared < best:
                    best, found = squared, p
                    out[0], out[1] = a[0] + t * (b[0] - a[0]), a[2] + t * (b[2] - a[2])
                continue
            q = s.polygon[other]
            if count >= MAX_VISITED or count - head >= MAX_WAITING:
                continue
            known = False
            for m in range(count):
                if visited[m] == q:
                    known = True
                    break
            if not known and nearest_on_segment(cx, cz, a[0], a[2], b[0], b[2])[1] <= reach:
                visited[count] = q
                count += 1
    return found, BLOCKED, count


@njit(cache=True, nogil=True)
def best_in_sight(s, p, x, z, ex, ez, visited, count, out):
    """The ground point nearest to an end that a straight line reaches, into ``out`` (2,); returns its polygon.

    Nearest points of walls, and of the lines of sight past corners, are the candidates: one of them is the nearest.
    """
    point = np.empty(2)
    found, _ = walk(s, p, x, z, ex, ez, out)
    best = (out[0] - ex) ** 2 + (out[1] - ez) ** 2
    for m in range(count):
        for k in range(s.start[visited[m]], s.start[visited[m] + 1]):
            if s.twin[k] >= 0:
                continue
            a, b = s.corner[k], s.corner[s.following[k]]
            t, squared = nearest_on_segment(ex, ez, a[0], a[2], b[0], b[2])
            if squared < best:
                qx, qz = a[0] + t * (b[0] - a[0]), a[2] + t * (b[2] - a[2])
                q, state = walk(s, p, x, z, qx, qz, point)
                if state == REACHED:
                    best, found = squared, q
                    out[0], out[1] = qx, qz
            for corner in (k, s.following[k]):
                # along the line of sight past a corner, as far as it comes near the end
                vx, vz = s.corner[corner, 0] - x, s.corner[corner, 2] - z
                squared = vx * vx + vz * vz
                if squared <= TOUCH * TOUCH:
                    continue
                t = (vx * (ex - x) + vz * (ez - z)) / squared
                if t <= 0.0 or (x + t * vx - ex) ** 2 + (z + t * vz - ez) ** 2 >= best:
                    continue
                q, _ = walk(s, p, x, z, x + t * vx, z + t * vz, point)
                squared = (point[0] - ex) ** 2 + (point[1] - ez) ** 2
                if squared < best:
                    best, found = squared, q
                    out[0], out[1] = point[0], point[1]
    return found


@njit(cache=True, nogil=True)
def walk_straight(s, polygons, starts, ends, positions, last):
    """Straight moves of rows whose start polygon is known; returns how many hit a wall (``last`` = -2 - polygon)."""
    blocked = 0
    point = np.empty(2)
    for i in range(len(starts)):
        if polygons[i] < 0 or not (math.isfinite(ends[i, 0]) and math.isfinite(ends[i, 2])):
            last[i] = -1
            continue
        p, state = walk(s, polygons[i], starts[i, 0], starts[i, 2], ends[i, 0], ends[i, 2], point)
        positions[i, 0], positions[i, 2] = point[0], point[1]
        last[i] = p
        if state == BLOCKED:
            last[i] = -2 - p
            blocked += 1
    return blocked


@njit(cache=True, nogil=True)
def slide(s, rows, polygons, starts, ends, positions, last):
    """Sliding moves of the given rows, which meet a wall on the straight line."""
    point = np.empty(2)
    seen = np.empty(2)
    visited = np.empty(MAX_VISITED, np.int32)
    for i in rows:
        p, x, z, ex, ez = polygons[i], starts[i, 0], starts[i, 2], ends[i, 0], ends[i, 2]
        q, _, count = search_disc(s, p, x, z, ex, ez, ends[i, 1] - starts[i, 1], point, visited)
        if q >= 0:
            r, state = walk(s, p, x, z, point[0], point[1], seen)
            if state == REACHED:
                q = r
            else:
                q = best_in_sight(s, p, x, z, ex, ez, visited, count, point)
        if q >= 0:
            positions[i, 0], positions[i, 2] = point[0], point[1]
            last[i] = q


@njit(cache=True, nogil=True)
def share_edge(s, p, q):
    """Whether two polygons are the same or neighbours."""
    if p == q:
        return True
    for k in range(s.start[p], s.start[p + 1]):
        if s.twin[k] >= 0 and s.polygon[s.twin[k]] == q:
            return True
    return False


@njit(cache=True, nogil=True)
def nudge(s, rows, last, found, positions, distance):
    """Move rows that would be found again in a polygon across a wall into their own, by ``distance`` [m]."""
    for i in rows:
        p = last[i]
        if p < 0 or found[i] < 0 or share_edge(s, p, found[i]):
            continue
        x, z, n = 0.0, 0.0, s.start[p + 1] - s.start[p]
        for k in range(s.start[p], s.start[p + 1]):
            x += s.corner[k, 0] / n
            z += s.corner[k, 2] / n
        dx, dz = x - positions[i, 0], z - positions[i, 2]
        far = length(dx, dz)
        if far > 0.0:
            positions[i, 0] += dx / far * min(distance, far)
            positions[i, 2] += dz / far * min(distance, far)
