"""Shortest paths over the floor, exact in the ground plane: Polyanya's search over convex polygons.

A *window* is an interval on an edge, seen in a straight line from a *root* (the goal or a corner that paths turn at).
Crossing the polygon behind the edge gives new windows with the same root on the edges that can be seen, and beyond an
end of the interval that is a corner, windows whose root is that corner. Windows are taken in order of the shortest
way they could stand for, so that the first one to reach the target's polygon holds a shortest path (Cui, Harabor,
Grastien: Compromise-free Pathfinding on a Navigation Mesh, IJCAI 2017). Without a target the search goes on until
nothing is left, and its windows, sorted by polygon, answer any point's distance to the goal.

What cannot be part of a shortest path is dropped: windows of a corner that is reached on a shorter way by now, turns
away from the wall that a path would have to bend around, and windows that for every point cost more than the way over
one end of their edge (Xin and Wang's filter for exact geodesics, 2009). All by more than BETTER, so that equal ways
never drop each other. A polygon that rounding has hidden from all windows is reached over the corners of its edges.

Turning points are chosen in the ground plane; lengths are sums of straight segments in space between them, as Habitat
measures. All that a search writes is in a :class:`~prnav.navmesh.scratch.Scratch`, which no other search may use
meanwhile.

Before: :mod:`.locate` has found the polygons of the ends. After: :mod:`.pairs` and :mod:`.goal_fields`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from prnav.navmesh.planar import BETTER, JOIN, NARROW, TOUCH, bend, cross, length, nearest_on_segment
from prnav.navmesh.scratch import HEAP, ROOTS, STAMP, WINDOWS

FULL = -1  #: the arrays are too small; call again with larger ones
NOWHERE = -2  #: the search ended without the target
MANY_ROOTS = 1 << 27  #: more than a search can have


@njit(cache=True, nogil=True)
def visit_fan(f, stamp, fan_stamp, fan_root, bound):
    """Forget what an earlier search left at a fan."""
    if fan_stamp[f] != stamp:
        fan_stamp[f] = stamp
        fan_root[f] = -1
        bound[f] = math.inf


@njit(cache=True, nogil=True)
def push(s, base, edge, tl, tr, root, forced, target, scratch):
    """Add a window to the heap unless it cannot matter; False where the arrays are full.

    ``edge`` is the corner of the polygon that is entered, ``tl`` and ``tr`` the interval along it. ``target`` is
    (polygon, x, z), polygon -1 for none.
    """
    nodes, ends, key, heap, roots = scratch.nodes, scratch.ends, scratch.key, scratch.heap, scratch.roots
    fan_stamp, fan_root, bound, counts = scratch.fan_stamp, scratch.fan_root, scratch.bound, scratch.counts
    a, b = s.corner[edge], s.corner[s.following[edge]]
    dx, dz = b[0] - a[0], b[2] - a[2]
    size = length(dx, dz)
    if (tr - tl) * size < NARROW and not forced:
        return True
    rx, rz, g = roots[root, 0], roots[root, 2], roots[root, 3]
    lx, lz, ex, ez = a[0] + tl * dx, a[2] + tl * dz, a[0] + tr * dx, a[2] + tr * dz
    left, right = g + length(lx - rx, lz - rz), g + length(ex - rx, ez - rz)
    fa, fb = s.fan[edge] - base, s.fan[s.following[edge]] - base
    visit_fan(fa, counts[STAMP], fan_stamp, fan_root, bound)
    visit_fan(fb, counts[STAMP], fan_stamp, fan_root, bound)
    if tl == 0.0 and left < bound[fa]:
        bound[fa] = left
    if tr == 1.0 and right < bound[fb]:
        bound[fb] = right
    if not forced and (bound[fa] + tr * size < right - BETTER or bound[fb] + (1.0 - tl) * size < left - BETTER):
        return True
    if target[0] < 0.0:
        w, squared = nearest_on_segment(rx, rz, lx, lz, ex, ez)
        cost = g + math.sqrt(squared)
    else:
        qx, qz = target[1], target[2]
        side = cross(dx, dz, qx - a[0], qz - a[2])
        if side < 0.0 and size > 0.0:  # the target's mirror image beyond the edge is as far away
            qx, qz = qx - 2.0 * side * dz / (size * size), qz + 2.0 * side * dx / (size * size)
        cost = g + bend(rx, rz, lx, lz, ex, ez, qx, qz)[0]
    node = counts[WINDOWS]
    if node >= len(key):
        return False
    counts[WINDOWS] += 1
    nodes[node, 0], nodes[node, 1], nodes[node, 2] = edge, root, forced
    ends[node, 0], ends[node, 1] = tl, tr
    key[node] = cost
    at = counts[HEAP]
    counts[HEAP] += 1
    while at > 0:
        up = (at - 1) >> 1
        if key[heap[up]] <= cost:
            break
        heap[at] = heap[up]
        at = up
    heap[at] = node
    return True


@njit(cache=True, nogil=True)
def pop(key, heap, counts):
    """The cheapest window of the heap; of equal ones any, but always the same."""
    top = heap[0]
    counts[HEAP] -= 1
    count = counts[HEAP]
    last = heap[count]
    at = 0
    while True:
        down = 2 * at + 1
        if down >= count:
            break
        if down + 1 < count and key[heap[down + 1]] < key[heap[down]]:
            down += 1
        if key[heap[down]] >= key[last]:
            break
        heap[at] = heap[down]
        at = down
    heap[at] = last
    return top


@njit(cache=True, nogil=True)
def add_root(counts, roots, links, x, y, z, parent, fan):
    """A new root in a straight line from its parent; its number, -1 where the arrays are full."""
    new = counts[ROOTS]
    if new >= len(roots):
        return -1
    counts[ROOTS] += 1
    r = roots[parent]
    dx, dy, dz = x - r[0], y - r[1], z - r[2]
    roots[new, 0], roots[new, 1], roots[new, 2] = x, y, z
    roots[new, 3] = r[3] + length(dx, dz)
    roots[new, 4] = r[4] + math.sqrt(dx * dx + dy * dy + dz * dz)
    links[new, 0], links[new, 1] = parent, fan
    return new


@njit(cache=True, nogil=True)
def turn_at(s, base, corner, root, sign, scratch):
    """The root at a corner where paths from ``root`` turn left (sign 1) or right (-1); -1 where they don't."""
    roots, fan_root, bound = scratch.roots, scratch.fan_root, scratch.bound
    f = s.fan[corner]
    if not s.turn[f]:
        return -1
    x, z = s.corner[corner, 0], s.corner[corner, 2]
    dx, dz = x - roots[root, 0], z - roots[root, 2]
    size = length(dx, dz)
    if size <= TOUCH:
        return -1
    w = s.walls[f]
    slack = -TOUCH * size  # turning a little more than the wall asks for costs a window, turning less a path
    if sign * cross(dx, dz, w[0], w[1]) < slack or sign * cross(dx, dz, w[2], w[3]) < slack:
        return -1
    f -= base
    visit_fan(f, scratch.counts[STAMP], scratch.fan_stamp, fan_root, bound)
    cost = roots[root, 3] + size
    if cost > bound[f] + BETTER:
        return -1
    known = fan_root[f]
    if known >= 0 and roots[known, 3] <= cost + BETTER:
        return known
    new = add_root(scratch.counts, roots, scratch.links, x, s.corner[corner, 1], z, root, f)
    if new < 0:
        return -3
    fan_root[f] = new
    return new


@njit(cache=True, nogil=True)
def expand(s, base, node, target, scratch):
    """Push the windows that lie behind a window's polygon; False where the arrays are full."""
    nodes, ends, roots = scratch.nodes, scratch.ends, scratch.roots
    k, root = nodes[node, 0], nodes[node, 1]
    tl, tr = ends[node, 0], ends[node, 1]
    n = s.following[k]
    a, b = s.corner[k], s.corner[n]
    rx, rz = roots[root, 0], roots[root, 2]
    touching = nearest_on_segment(rx, rz, a[0], a[2], b[0], b[2])[1] <= TOUCH * TOUCH
    lx, lz = a[0] + tl * (b[0] - a[0]) - rx, a[2] + tl * (b[2] - a[2]) - rz
    ex, ez = a[0] + tr * (b[0] - a[0]) - rx, a[2] + tr * (b[2] - a[2]) - rz
    if touching:  # around a vertex in the middle of the floor such windows would follow each other for ever
        around, mark = scratch.around, scratch.counts[STAMP] * MANY_ROOTS + root
        if around[s.polygon[k]] == mark:
            return True
        around[s.polygon[k]] = mark
    left_root, right_root = -2, -2  # not asked for yet
    c = b
    right_c = cross(ex, ez, c[0] - rx, c[2] - rz)
    left_c = cross(lx, lz, c[0] - rx, c[2] - rz)
    j = n
    while j != k:
        after = s.following[j]
        d = s.corner[after]
        right_d = cross(ex, ez, d[0] - rx, d[2] - rz)
        left_d = cross(lx, lz, d[0] - rx, d[2] - rz)
        other = s.twin[j]
        if other >= 0:
            if touching:
                if not push(s, base, other, 0.0, 1.0, root, False, target, scratch):
                    return False
            else:
                t0, t1 = 0.0, 1.0
                # the outline from b to a lies right of the right ray, then between the rays, then left of the left one
                if right_d <= 0.0:
                    t0 = 1.0
                elif right_c < 0.0:
                    t0 = right_c / (right_c - right_d)
                if left_c >= 0.0:
                    t1 = 0.0
                elif left_d > 0.0:
                    t1 = left_c / (left_c - left_d)
                size = length(d[0] - c[0], d[2] - c[2])
                if t0 * size < NARROW:
                    t0 = 0.0
                if (1.0 - t0) * size < NARROW:
                    t0 = 1.0
                if t1 * size < NARROW:
                    t1 = 0.0
                if (1.0 - t1) * size < NARROW:
                    t1 = 1.0
                if t0 < t1 and not push(s, base, other, 1.0 - t1, 1.0 - t0, root, False, target, scratch):
                    return False
                if t0 > 0.0 and tr == 1.0:
                    if right_root == -2:
                        right_root = turn_at(s, base, n, root, -1.0, scratch)
                    if right_root == -3:
                        return False
                    if right_root >= 0 and not push(s, base, other, 1.0 - t0, 1.0, right_root, False, target, scratch):
                        return False
                if t1 < 1.0 and tl == 0.0:
                    if left_root == -2:
                        left_root = turn_at(s, base, k, root, 1.0, scratch)
                    if left_root == -3:
                        return False
                    if left_root >= 0 and not push(s, base, other, 0.0, 1.0 - t1, left_root, False, target, scratch):
                        return False
        j, c, right_c, left_c = after, d, right_d, left_d
    return True


@njit(cache=True, nogil=True)
def stale(s, base, node, scratch):
    """Whether a window's root is reached on a shorter way by now, or its edge's ends are."""
    nodes, ends, bound, roots, links = scratch.nodes, scratch.ends, scratch.bound, scratch.roots, scratch.links
    if nodes[node, 2]:
        return False
    root = nodes[node, 1]
    g = roots[root, 3]
    if links[root, 1] >= 0 and g > bound[links[root, 1]] + BETTER:
        return True
    k = nodes[node, 0]
    n = s.following[k]
    a, b = s.corner[k], s.corner[n]
    tl, tr = ends[node, 0], ends[node, 1]
    dx, dz = b[0] - a[0], b[2] - a[2]
    size = length(dx, dz)
    right = g + length(a[0] + tr * dx - roots[root, 0], a[2] + tr * dz - roots[root, 2])
    left = g + length(a[0] + tl * dx - roots[root, 0], a[2] + tl * dz - roots[root, 2])
    return (
        bound[s.fan[k] - base] + tr * size < right - BETTER
        or bound[s.fan[n] - base] + (1.0 - tl) * size < left - BETTER
    )


@njit(cache=True, nogil=True)
def reach_corner(s, base, q, corner, scratch):
    """The root at a corner of an edge of polygon q, on the way that q was first reached; -1 where the arrays are full.

    A window bends at its end where it has to, so that there is always a way.
    """
    nodes, ends, entry, roots = scratch.nodes, scratch.ends, scratch.entry, scratch.roots
    x, y, z = s.corner[corner, 0], s.corner[corner, 1], s.corner[corner, 2]
    root, node = 0, entry[q]
    if node >= 0:
        root = nodes[node, 1]
        k = nodes[node, 0]
        a, b = s.corner[k], s.corner[s.following[k]]
        tl, tr = ends[node, 0], ends[node, 1]
        lx, lz = a[0] + tl * (b[0] - a[0]), a[2] + tl * (b[2] - a[2])
        ex, ez = a[0] + tr * (b[0] - a[0]), a[2] + tr * (b[2] - a[2])
        _, over = bend(roots[root, 0], roots[root, 2], lx, lz, ex, ez, x, z)
        if over > 0:
            t = tl if over == 1 else tr
            px, py, pz = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
            root = add_root(scratch.counts, roots, scratch.links, px, py, pz, root, -1)
            if root < 0:
                return -1
    return add_root(scratch.counts, roots, scratch.links, x, y, z, root, s.fan[corner] - base)


@njit(cache=True, nogil=True)
def force(s, base, scene, target, scratch):
    """Reach polygons that no window has reached over a corner of an edge they share with one that was.

    Returns how many windows were pushed, FULL where the arrays are too small.
    """
    entry, reached, stamp = scratch.entry, scratch.reached, scratch.counts[STAMP]
    first, end = s.scene_polygon[scene], s.scene_polygon[scene + 1]
    pushed = 0
    for p in range(first, end):
        if reached[p - first] == stamp:
            continue
        for k in range(s.start[p], s.start[p + 1]):
            other = s.twin[k]
            if other < 0 or reached[s.polygon[other] - first] != stamp:
                continue
            q = s.polygon[other]
            one = reach_corner(s, base, q, k, scratch)
            two = reach_corner(s, base, q, s.following[k], scratch)
            if one < 0 or two < 0:
                return FULL
            root = one if scratch.roots[one, 3] <= scratch.roots[two, 3] else two
            entry[p] = scratch.counts[WINDOWS]
            if not push(s, base, k, 0.0, 1.0, root, True, target, scratch):
                return FULL
            reached[p - first] = stamp
            pushed += 1
            break
    return pushed


@njit(cache=True, nogil=True)
def search(s, scene, p, x, y, z, target, scratch):
    """Search from the point (x, y, z) in polygon p; the last window with a target, their number without.

    Where there is no target, ``scratch.taken`` receives the windows that were expanded, in order.
    """
    base = s.scene_fan[scene]
    first = s.scene_polygon[scene]
    roots, counts, reached, entry = scratch.roots, scratch.counts, scratch.reached, scratch.entry
    counts[WINDOWS], counts[HEAP], counts[ROOTS] = 0, 0, 1
    counts[STAMP] += 1
    stamp = counts[STAMP]
    for k in range(s.start[p], s.start[p + 1]):
        if length(s.corner[k, 0] - x, s.corner[k, 2] - z) <= JOIN:
            x, z = s.corner[k, 0], s.corner[k, 2]
            break
    roots[0, 0], roots[0, 1], roots[0, 2], roots[0, 3], roots[0, 4] = x, y, z, 0.0, 0.0
    scratch.links[0, 0], scratch.links[0, 1] = -1, -1
    goal = int(target[0])
    reached[p - first] = stamp
    entry[p] = -1
    for k in range(s.start[p], s.start[p + 1]):
        if s.twin[k] >= 0 and not push(s, base, s.twin[k], 0.0, 1.0, 0, False, target, scratch):
            return FULL
    count = 0
    while True:
        while counts[HEAP] > 0:
            node = pop(scratch.key, scratch.heap, counts)
            if stale(s, base, node, scratch):
                continue
            q = s.polygon[scratch.nodes[node, 0]]
            if q == goal:
                return node
            if reached[q - first] != stamp:
                reached[q - first] = stamp
                entry[q] = node
            if goal < 0:
                scratch.taken[count] = node
                count += 1
            if not expand(s, base, node, target, scratch):
                return FULL
        pushed = force(s, base, scene, target, scratch)
        if pushed == FULL:
            return FULL
        if pushed == 0:
            return count if goal < 0 else NOWHERE


@njit(cache=True, nogil=True)
def way(s, node, scratch, qx, qy, qz, point):
    """Length in space from the search's start through a window to a point of its polygon, and its last turn.

    Where the way bends at an end of the window, that end goes into ``point``, else the root.
    """
    nodes, ends = scratch.nodes, scratch.ends
    k, root = nodes[node, 0], nodes[node, 1]
    a, b = s.corner[k], s.corner[s.following[k]]
    tl, tr = ends[node, 0], ends[node, 1]
    r = scratch.roots[root]
    lx, lz = a[0] + tl * (b[0] - a[0]), a[2] + tl * (b[2] - a[2])
    ex, ez = a[0] + tr * (b[0] - a[0]), a[2] + tr * (b[2] - a[2])
    _, over = bend(r[0], r[2], lx, lz, ex, ez, qx, qz)
    if over == 0:
        point[0], point[1], point[2] = r[0], r[1], r[2]
        return r[4] + math.sqrt((qx - r[0]) ** 2 + (qy - r[1]) ** 2 + (qz - r[2]) ** 2), 0
    t = tl if over == 1 else tr
    for i in range(3):
        point[i] = a[i] + t * (b[i] - a[i])
    return (
        r[4]
        + math.sqrt((point[0] - r[0]) ** 2 + (point[1] - r[1]) ** 2 + (point[2] - r[2]) ** 2)
        + math.sqrt((qx - point[0]) ** 2 + (qy - point[1]) ** 2 + (qz - point[2]) ** 2)
    ), over


@njit(cache=True, nogil=True)
def pair_distances(s, scenes, p, a, q, b, begin, scratch, distances):
    """Geodesic distances between floor points a and b (N, 3) in polygons p and q; from row ``begin`` on.

    Returns the row at which the arrays were too small, N at the end. Each pair is searched from the end that comes
    first in x, z, y, so that distances are symmetric to the last bit.
    """
    target = np.empty(3)
    point = np.empty(3)
    for i in range(begin, len(distances)):
        if p[i] < 0 or q[i] < 0 or s.island[p[i]] != s.island[q[i]]:
            distances[i] = math.inf
            continue
        ax, ay, az, bx, by, bz = a[i, 0], a[i, 1], a[i, 2], b[i, 0], b[i, 1], b[i, 2]
        start, end = p[i], q[i]
        if (ax, az, ay) > (bx, bz, by):
            ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
            start, end = end, start
        if start == end:
            distances[i] = math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2)
            continue
        target[0], target[1], target[2] = end, bx, bz
        node = search(s, scenes[i], start, ax, ay, az, target, scratch)
        if node == FULL:
            return i
        distances[i] = math.inf
        if node >= 0:
            distances[i], _ = way(s, node, scratch, bx, by, bz, point)
    return len(distances)
