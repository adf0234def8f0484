"""Height detail: a triangulation of each polygon that follows the floor's height (Recast's detail mesh).

A polygon's outline and inside are sampled on the cells of its region; samples that lie farther from the triangles than
allowed become vertices. Outlines are sampled alike from both sides, so that no seams open. Coordinates here are metres
from the lower bound.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.navmesh.compact import CompactField
from prnav.navmesh.polygons import GridPolygons
from prnav.navmesh.settings import NavMeshSettings

MAX_VERTICES = 127  # of one polygon; Detour counts them in a byte
MAX_EDGE_SAMPLES = 31
MAX_TRIANGLES = 254
NO_HEIGHT = 0x3FFFFFFF
UNKNOWN = -1  # side of an edge that no triangle has taken
HULL = -2  # side of an edge outside of the polygon


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
    distance = settings.detail_sample_dist
    return HeightDetail(
        *_detail(
            polygons.vertices,
            polygons.corners,
            polygons.region,
            field.width,
            field.depth,
            field.start,
            field.floor,
            field.connected,
            region,
            float(settings.cell_size),
            float(settings.cell_height),
            0.0 if distance < 0.9 else settings.cell_size * distance,
            float(settings.cell_height * settings.detail_sample_max_error),
            max(1, math.ceil(settings.edge_max_error)),
        )
    )


@njit(cache=True, nogil=True)
def _step(direction):
    """Offset in x and z of a direction."""
    return (direction == 2) * 1 - (direction == 0) * 1, (direction == 1) * 1 - (direction == 3) * 1


@njit(cache=True, nogil=True)
def _centre_seed(corners, vertices, polygon, count, box, start, floor, connected, width, heights, queue):
    """Cell at a polygon's centre, reached from near a corner; -1 if there is none. For polygons without own cells."""
    x0, z0, wide, long = box
    best = NO_HEIGHT
    seed = -1
    centre_x = 0
    centre_z = 0
    for k in range(count):
        v = corners[polygon, k]
        centre_x += vertices[v, 0]
        centre_z += vertices[v, 2]
        for dz in range(-1, 2):
            for dx in range(-1, 2):
                x = vertices[v, 0] + dx
                z = vertices[v, 2] + dz
                if x < x0 or z < z0 or x >= x0 + wide or z >= z0 + long:
                    continue
                for i in range(start[x + z * width], start[x + z * width + 1]):
                    gap = abs(floor[i] - vertices[v, 1])
                    if gap < best:
                        best = gap
                        seed = i
                        queue[0, 0] = x
                        queue[0, 1] = z
                        queue[0, 2] = i
    if seed < 0:
        return False
    centre_x //= count
    centre_z //= count
    visited = np.zeros(wide * long, np.bool_)
    visited[queue[0, 0] - x0 + (queue[0, 1] - z0) * wide] = True
    stack = 1
    x = queue[0, 0]
    z = queue[0, 1]
    while stack > 0:  # depth first, towards the centre
        stack -= 1
        x = queue[stack, 0]
        z = queue[stack, 1]
        seed = queue[stack, 2]
        if x == centre_x and z == centre_z:
            break
        if x == centre_x:
            direct = 1 if centre_z > z else 3
        else:
            direct = 2 if centre_x > x else 0
        for turn in range(1, 5):
            direction = (direct + turn) % 4  # the direct one last, on top of the stack
            dx, dz = _step(direction)
            j = connected[seed, direction]
            if j < 0 or x + dx < x0 or z + dz < z0 or x + dx >= x0 + wide or z + dz >= z0 + long:
                continue
            place = x + dx - x0 + (z + dz - z0) * wide
            if visited[place]:
                continue
            visited[place] = True
            queue[stack, 0] = x + dx
            queue[stack, 1] = z + dz
            queue[stack, 2] = j
            stack += 1
    queue[0, 0] = x
    queue[0, 1] = z
    queue[0, 2] = seed
    heights[x - x0 + (z - z0) * wide] = floor[seed]
    return True


@njit(cache=True, nogil=True)
def _height_patch(corners, vertices, polygon, count, own, box, start, floor, connected, region, width, heights, queue):
    """Floor heights around a polygon: of its own region, spread from there to connected cells; fills ``heights``."""
    x0, z0, wide, long = box
    heights[: wide * long] = NO_HEIGHT
    last = 0
    found = False
    for z in range(z0, z0 + long):
        for x in range(x0, x0 + wide):
            for i in range(start[x + z * width], start[x + z * width + 1]):
                if region[i] != own:
                    continue
                heights[x - x0 + (z - z0) * wide] = floor[i]
                found = True
                for direction in range(4):
                    j = connected[i, direction]
                    if j >= 0 and region[j] != own:
                        queue[last, 0] = x
                        queue[last, 1] = z
                        queue[last, 2] = i
                        last += 1
                        break
                break
    if not found and _centre_seed(
        corners, vertices, polygon, count, box, start, floor, connected, width, heights, queue
    ):
        last = 1
    head = 0
    while head < last:
        x = queue[head, 0]
        z = queue[head, 1]
        i = queue[head, 2]
        head += 1
        for direction in range(4):
            j = connected[i, direction]
            if j < 0:
                continue
            dx, dz = _step(direction)
            px = x + dx - x0
            pz = z + dz - z0
            if px < 0 or pz < 0 or px >= wide or pz >= long or heights[px + pz * wide] != NO_HEIGHT:
                continue
            heights[px + pz * wide] = floor[j]
            queue[last, 0] = x + dx
            queue[last, 1] = z + dz
            queue[last, 2] = j
            last += 1


@njit(cache=True, nogil=True)
def _height(x, y, z, cell, cell_height, radius, box, heights):
    """Floor height at a point [m]; where its cell has none, the nearest to y of the closest ring of cells."""
    x0, z0, wide, long = box
    px = min(max(int(math.floor(x / cell + 0.01)) - x0, 0), wide - 1)
    pz = min(max(int(math.floor(z / cell + 0.01)) - z0, 0), long - 1)
    height = heights[px + pz * wide]
    if height != NO_HEIGHT:
        return height * cell_height
    for ring in range(1, radius + 1):
        nearest = np.inf
        for qz in range(max(pz - ring, 0), min(pz + ring + 1, long)):
            for qx in range(max(px - ring, 0), min(px + ring + 1, wide)):
                if max(abs(qx - px), abs(qz - pz)) != ring:
                    continue
                candidate = heights[qx + qz * wide]
                if candidate != NO_HEIGHT and abs(candidate * cell_height - y) < nearest:
                    nearest = abs(candidate * cell_height - y)
                    height = candidate
        if height != NO_HEIGHT:
            return height * cell_height
    return y


@njit(cache=True, nogil=True)
def _segment_distance(p, a, b, axes):
    """Squared distance of p to the segment ab, in the ground plane (2 axes) or in space (3)."""
    dy = b[1] - a[1] if axes == 3 else 0.0
    py = p[1] - a[1] if axes == 3 else 0.0
    dx = b[0] - a[0]
    dz = b[2] - a[2]
    px = p[0] - a[0]
    pz = p[2] - a[2]
    length = dx * dx + dy * dy + dz * dz
    t = dx * px + dy * py + dz * pz
    if length > 0:
        t /= length
    t = min(max(t, 0.0), 1.0)
    return (px - t * dx) ** 2 + (py - t * dy) ** 2 + (pz - t * dz) ** 2


@njit(cache=True, nogil=True)
def _plane_distance(a, b):
    """Distance in the ground plane."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[2] - b[2]) ** 2)


@njit(cache=True, nogil=True)
def _cross(a, b, c):
    """Twice the signed area of a triangle in the ground plane."""
    return (b[0] - a[0]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[0] - a[0])


@njit(cache=True, nogil=True)
def _smallest_extent(points, count):
    """Width of a polygon across its narrowest side."""
    smallest = np.inf
    for i in range(count):
        following = (i + 1) % count
        largest = 0.0
        for j in range(count):
            if j != i and j != following:
                largest = max(largest, _segment_distance(points[j], points[i], points[following], 2))
        smallest = min(smallest, largest)
    return math.sqrt(smallest)


@njit(cache=True, nogil=True)
def _hull_triangles(points, hull, num_hull, num_corners, triangles):
    """Triangles of an outline without inner points: from the smallest ear on, the shorter side first."""
    start, left, right = 0, 1, num_hull - 1
    smallest = np.inf
    for i in range(num_hull):
        if hull[i] >= num_corners:
            continue  # on an edge: no ear
        before = hull[(i + num_hull - 1) % num_hull]
        after = hull[(i + 1) % num_hull]
        length = (
            _plane_distance(points[before], points[hull[i]])
            + _plane_distance(points[hull[i]], points[after])
            + _plane_distance(points[after], points[before])
        )
        if length < smallest:
            smallest = length
            start, left, right = i, (i + 1) % num_hull, (i + num_hull - 1) % num_hull
    triangles[0, 0], triangles[0, 1], triangles[0, 2] = hull[start], hull[left], hull[right]
    count = 1
    while (left + 1) % num_hull != right:
        next_left = (left + 1) % num_hull
        next_right = (right + num_hull - 1) % num_hull
        by_left = _plane_distance(points[hull[left]], points[hull[next_left]]) + _plane_distance(
            points[hull[next_left]], points[hull[right]]
        )
        by_right = _plane_distance(points[hull[right]], points[hull[next_right]]) + _plane_distance(
            points[hull[left]], points[hull[next_right]]
        )
        triangles[count, 0], triangles[count, 2] = hull[left], hull[right]
        if by_left < by_right:
            triangles[count, 1] = hull[next_left]
            left = next_left
        else:
            triangles[count, 1] = hull[next_right]
            right = next_right
        count += 1
    return count


@njit(cache=True, nogil=True)
def _circle(a, b, c):
    """Centre x, z and radius of the circle through three points; radius 0 where they are in line."""
    bx, bz, cx, cz = b[0] - a[0], b[2] - a[2], c[0] - a[0], c[2] - a[2]
    cross = bx * cz - bz * cx
    if abs(cross) <= 1e-6:
        return a[0], a[2], 0.0
    b2 = bx * bx + bz * bz
    c2 = cx * cx + cz * cz
    x = (b2 * cz - c2 * bz) / (2 * cross)
    z = (c2 * bx - b2 * cx) / (2 * cross)
    return a[0] + x, a[2] + z, math.sqrt(x * x + z * z)


@njit(cache=True, nogil=True)
def _find_edge(edges, count, a, b):
    """Row of the edge between two points, -1 if there is none."""
    for k in range(count):
        if (edges[k, 0] == a and edges[k, 1] == b) or (edges[k, 0] == b and edges[k, 1] == a):
            return k
    return -1


@njit(cache=True, nogil=True)
def _crosses_edges(points, edges, count, a, b):
    """Whether the segment ab crosses an edge that does not end at a or b."""
    for k in range(count):
        c = edges[k, 0]
        d = edges[k, 1]
        if a == c or a == d or b == c or b == d:
            continue
        first = _cross(points[c], points[d], points[b])
        second = _cross(points[c], points[d], points[a])
        if first * second < 0:
            third = _cross(points[a], points[b], points[c])
            if third * (third + second - first) < 0:
                return True
    return False


@njit(cache=True, nogil=True)
def _set_face(edges, count, a, b, face):
    """Give the side of edge a-b to the left of that direction to a face; adds the edge. Returns the number of edges."""
    row = _find_edge(edges, count, a, b)
    if row < 0:
        if count < len(edges):
            edges[count, 0], edges[count, 1], edges[count, 2], edges[count, 3] = a, b, face, UNKNOWN
            count += 1
    elif edges[row, 0] == a and edges[row, 2] == UNKNOWN:
        edges[row, 2] = face
    elif edges[row, 0] == b and edges[row, 3] == UNKNOWN:
        edges[row, 3] = face
    return count


@njit(cache=True, nogil=True)
def _delaunay(points, num_points, hull, num_hull, edges, triangles):
    """Delaunay triangles of points inside an outline; returns their number."""
    count = 0
    before = num_hull - 1
    for i in range(num_hull):
        edges[count, 0], edges[count, 1], edges[count, 2], edges[count, 3] = hull[before], hull[i], HULL, UNKNOWN
        count += 1
        before = i
    faces = 0
    current = 0
    while current < count:
        for side in range(2, 4):
            if edges[current, side] != UNKNOWN:
                continue
            s = edges[current, 0] if side == 2 else edges[current, 1]
            t = edges[current, 1] if side == 2 else edges[current, 0]
            best = -1
            x, z, radius = 0.0, 0.0, 0.0
            for u in range(num_points):
                if u == s or u == t or _cross(points[s], points[t], points[u]) <= 1e-5:
                    continue
                if best >= 0:
                    d = math.sqrt((points[u, 0] - x) ** 2 + (points[u, 2] - z) ** 2)
                    if d > radius * 1.001:
                        continue
                    if d >= radius * 0.999 and (
                        _crosses_edges(points, edges, count, s, u) or _crosses_edges(points, edges, count, t, u)
                    ):
                        continue
                best = u
                x, z, radius = _circle(points[s], points[t], points[u])
            if best < 0:
                edges[current, side] = HULL
                continue
            edges[current, side] = faces
            count = _set_face(edges, count, best, s, faces)
            count = _set_face(edges, count, t, best, faces)
            faces += 1
        # a face from the edges that have it on a side
        current += 1
    faces = min(faces, len(triangles))
    triangles[:faces] = -1
    for k in range(count):
        for side in range(2, 4):
            face = edges[k, side]
            if face < 0 or face >= faces:
                continue
            a = edges[k, 0] if side == 3 else edges[k, 1]
            b = edges[k, 1] if side == 3 else edges[k, 0]
            if triangles[face, 0] < 0:
                triangles[face, 0] = a
                triangles[face, 1] = b
            elif triangles[face, 0] == b:
                triangles[face, 2] = a
            elif triangles[face, 1] == a:
                triangles[face, 2] = b
    kept = 0
    for face in range(faces):
        if triangles[face, 0] >= 0 and triangles[face, 1] >= 0 and triangles[face, 2] >= 0:
            triangles[kept] = triangles[face]
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _mesh_distance(p, points, triangles, count):
    """Smallest vertical distance of p to the triangles above or below it, -1 if there are none."""
    nearest = np.inf
    for k in range(count):
        a, b, c = points[triangles[k, 0]], points[triangles[k, 1]], points[triangles[k, 2]]
        v0x, v0z, v1x, v1z = c[0] - a[0], c[2] - a[2], b[0] - a[0], b[2] - a[2]
        v2x, v2z = p[0] - a[0], p[2] - a[2]
        dot00 = v0x * v0x + v0z * v0z
        dot01 = v0x * v1x + v0z * v1z
        dot11 = v1x * v1x + v1z * v1z
        scale = dot00 * dot11 - dot01 * dot01
        if scale <= 0:
            continue
        dot02 = v0x * v2x + v0z * v2z
        dot12 = v1x * v2x + v1z * v2z
        u = (dot11 * dot02 - dot01 * dot12) / scale
        v = (dot00 * dot12 - dot01 * dot02) / scale
        if u >= -1e-4 and v >= -1e-4 and u + v <= 1 + 1e-4:
            nearest = min(nearest, abs(a[1] + (c[1] - a[1]) * u + (b[1] - a[1]) * v - p[1]))
    return nearest if nearest < np.inf else -1.0


@njit(cache=True, nogil=True)
def _outline_distance(points, count, p):
    """Squared distance of p to a polygon's outline in the ground plane, negative inside."""
    nearest = np.inf
    inside = False
    before = count - 1
    for i in range(count):
        a = points[i]
        b = points[before]
        if (a[2] > p[2]) != (b[2] > p[2]) and p[0] < (b[0] - a[0]) * (p[2] - a[2]) / (b[2] - a[2]) + a[0]:
            inside = not inside
        nearest = min(nearest, _segment_distance(p, b, a, 2))
        before = i
    return -nearest if inside else nearest


@njit(cache=True, nogil=True)
def _outline(points, count, sampling, max_error, cell, cell_height, radius, box, heights, hull):
    """Add the vertices that the outline's height needs; fills ``hull``, returns the numbers of points and of hull."""
    num_points = count
    num_hull = 0
    edge = np.empty((MAX_EDGE_SAMPLES + 1, 3))
    chosen = np.empty(MAX_EDGE_SAMPLES + 1, np.int64)
    before = count - 1
    for i in range(count):
        a = points[before]
        b = points[i]
        swapped = a[2] > b[2] if abs(a[0] - b[0]) < 1e-6 else a[0] > b[0]
        if swapped:  # the same order from both sides of an edge
            a, b = b, a
        length = _plane_distance(a, b)
        parts = min(1 + int(math.floor(length / sampling)), MAX_EDGE_SAMPLES)
        parts = min(parts, MAX_VERTICES - 1 - num_points)
        hull[num_hull] = before
        num_hull += 1
        before = i
        if parts < 2:
            continue
        for k in range(parts + 1):
            for axis in range(3):
                edge[k, axis] = a[axis] + (b[axis] - a[axis]) * (k / parts)
            edge[k, 1] = _height(edge[k, 0], edge[k, 1], edge[k, 2], cell, cell_height, radius, box, heights)
        chosen[0] = 0
        chosen[1] = parts
        num = 2
        k = 0
        while k < num - 1:
            largest = 0.0
            farthest = -1
            for m in range(chosen[k] + 1, chosen[k + 1]):
                deviation = _segment_distance(edge[m], edge[chosen[k]], edge[chosen[k + 1]], 3)
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
            points[num_points] = edge[chosen[num - 1 - k if swapped else k]]
            hull[num_hull] = num_points
            num_hull += 1
            num_points += 1
    return num_points, num_hull


@njit(cache=True, nogil=True)
def _jitter(i, factor):
    """A fixed pseudo-random number in -1..1."""
    return ((i * factor) & 0xFFFF) / 65535.0 * 2.0 - 1.0


@njit(cache=True, nogil=True)
def _inside(
    points,
    count,
    num_points,
    hull,
    num_hull,
    sampling,
    max_error,
    cell,
    cell_height,
    radius,
    box,
    heights,
    triangles,
    num,
):
    """Add inner samples, the worst first, until none errs too much; the numbers of points and triangles."""
    low_x, high_x = points[0, 0], points[0, 0]
    low_y, high_y = points[0, 1], points[0, 1]
    low_z, high_z = points[0, 2], points[0, 2]
    for k in range(1, count):
        low_x, high_x = min(low_x, points[k, 0]), max(high_x, points[k, 0])
        low_y, high_y = min(low_y, points[k, 1]), max(high_y, points[k, 1])
        low_z, high_z = min(low_z, points[k, 2]), max(high_z, points[k, 2])
    x0, x1 = int(math.floor(low_x / sampling)), int(math.ceil(high_x / sampling))
    z0, z1 = int(math.floor(low_z / sampling)), int(math.ceil(high_z / sampling))
    samples = np.empty(((x1 - x0) * (z1 - z0), 3))
    num_samples = 0
    point = np.empty(3)
    for z in range(z0, z1):
        for x in range(x0, x1):
            point[0], point[1], point[2] = x * sampling, (low_y + high_y) / 2, z * sampling
            if _outline_distance(points, count, point) > -sampling / 2:
                continue
            point[1] = _height(point[0], point[1], point[2], cell, cell_height, radius, box, heights)
            # off the grid by a little: symmetric points triangulate badly
            point[0] += _jitter(num_samples, 0x8DA6B343) * cell * 0.1
            point[2] += _jitter(num_samples, 0xD8163841) * cell * 0.1
            samples[num_samples] = point
            num_samples += 1
    added = np.zeros(num_samples, np.bool_)
    edges = np.empty((10 * MAX_VERTICES, 4), np.int64)
    while num_points < MAX_VERTICES:
        largest = 0.0
        best = -1
        for i in range(num_samples):
            if added[i]:
                continue
            error = _mesh_distance(samples[i], points, triangles, num)
            if error > largest:
                largest = error
                best = i
        if best < 0 or largest <= max_error:
            break
        added[best] = True
        points[num_points] = samples[best]
        num_points += 1
        num = _delaunay(points, num_points, hull, num_hull, edges, triangles)
    return num_points, num


@njit(cache=True, nogil=True)
def _detail(
    vertices,
    corners,
    owner,
    width,
    depth,
    start,
    floor,
    connected,
    region,
    cell,
    cell_height,
    sampling,
    max_error,
    radius,
):
    num_polygons = len(corners)
    most = corners.shape[1]
    boxes = np.zeros((num_polygons, 4), np.int64)
    largest = 1
    for p in range(num_polygons):
        x0, z0, x1, z1 = width, depth, 0, 0
        for k in range(most):
            if corners[p, k] >= 0:
                v = corners[p, k]
                x0, x1 = min(x0, vertices[v, 0]), max(x1, vertices[v, 0])
                z0, z1 = min(z0, vertices[v, 2]), max(z1, vertices[v, 2])
        x0, z0 = max(x0 - 1, 0), max(z0 - 1, 0)
        x1, z1 = min(x1 + 1, width), min(z1 + 1, depth)
        boxes[p, 0], boxes[p, 1], boxes[p, 2], boxes[p, 3] = x0, z0, x1 - x0, z1 - z0
        largest = max(largest, (x1 - x0) * (z1 - z0))
    if sampling == 0:
        largest = 1
    heights = np.empty(largest, np.int32)
    queue = np.empty((largest, 3), np.int32)
    points = np.empty((MAX_VERTICES + 1, 3))
    hull = np.empty(MAX_VERTICES + 1, np.int64)
    triangles = np.empty((MAX_TRIANGLES, 3), np.int64)
    outline = np.empty(MAX_VERTICES + 1, np.int64)
    vertex_start = np.zeros(num_polygons + 1, np.int32)
    triangle_start = np.zeros(num_polygons + 1, np.int32)
    all_points = np.empty((256, 3))
    all_triangles = np.empty((4 * num_polygons + 256, 3), np.int32)
    all_flags = np.empty(4 * num_polygons + 256, np.uint8)
    num_all = 0
    num_all_triangles = 0
    for p in range(num_polygons):
        count = 0
        while count < most and corners[p, count] >= 0:
            v = corners[p, count]
            points[count, 0] = vertices[v, 0] * cell
            points[count, 1] = vertices[v, 1] * cell_height
            points[count, 2] = vertices[v, 2] * cell
            hull[count] = count
            count += 1
        num_points = count
        num_hull = count
        if sampling > 0:
            box = (boxes[p, 0], boxes[p, 1], boxes[p, 2], boxes[p, 3])
            _height_patch(
                corners, vertices, p, count, owner[p], box, start, floor, connected, region, width, heights, queue
            )
            num_points, num_hull = _outline(
                points, count, sampling, max_error, cell, cell_height, radius, box, heights, hull
            )
        num = _hull_triangles(points, hull, num_hull, count, triangles)
        if sampling > 0 and _smallest_extent(points, count) >= 2 * sampling:
            num_points, num = _inside(
                points,
                count,
                num_points,
                hull,
                num_hull,
                sampling,
                max_error,
                cell,
                cell_height,
                radius,
                box,
                heights,
                triangles,
                num,
            )
        while num_all + num_points - count > len(all_points):
            larger_points = np.empty((2 * len(all_points), 3))
            larger_points[:num_all] = all_points[:num_all]
            all_points = larger_points
        while num_all_triangles + num > len(all_triangles):
            larger_triangles = np.empty((2 * len(all_triangles), 3), np.int32)
            larger_triangles[:num_all_triangles] = all_triangles[:num_all_triangles]
            all_triangles = larger_triangles
            larger_flags = np.empty(len(all_triangles), np.uint8)
            larger_flags[:num_all_triangles] = all_flags[:num_all_triangles]
            all_flags = larger_flags
        outline[:num_points] = -1
        for k in range(num_hull):
            outline[hull[k]] = k
        for t in range(num):
            flag = 0
            for k in range(3):
                a = triangles[t, k]
                b = triangles[t, (k + 1) % 3]
                if outline[a] >= 0 and outline[b] >= 0 and outline[b] == (outline[a] + 1) % num_hull:
                    flag |= 1 << (2 * k)
                all_triangles[num_all_triangles, k] = (
                    corners[p, a] if a < count else len(vertices) + num_all + a - count
                )
            all_flags[num_all_triangles] = flag
            num_all_triangles += 1
        for k in range(count, num_points):
            all_points[num_all] = points[k]
            all_points[num_all, 1] += cell_height  # Recast lifts the detail by one cell
            num_all += 1
        vertex_start[p + 1] = num_all
        triangle_start[p + 1] = num_all_triangles
    return (
        all_points[:num_all].copy(),
        vertex_start,
        all_triangles[:num_all_triangles].copy(),
        triangle_start,
        all_flags[:num_all_triangles].copy(),
    )
