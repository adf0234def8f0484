"""Small floors for tests: grids of cells, some of them blocked, on uneven grid lines and a slope."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from prnav.navmesh import NavMesh, NavMeshSettings, PolyMesh

SLOPE = 0.25  #: rise of the floor along x


def grid_mesh(free: np.ndarray, xs: np.ndarray, zs: np.ndarray, slope: float = SLOPE) -> PolyMesh:
    """One rectangle per free cell: ``free`` (rows along z, columns along x), grid lines ``xs`` and ``zs``."""
    rows, columns = free.shape
    index = np.full(free.shape, -1, np.int64)
    index[free] = np.arange(free.sum())
    x, z = np.meshgrid(xs, zs)
    vertices = np.stack([x.ravel(), slope * x.ravel(), z.ravel()], axis=1).astype(np.float32).astype(np.float64)
    corners, neighbours = [], []

    def at(r: int, c: int) -> int:
        return int(index[r, c]) if 0 <= r < rows and 0 <= c < columns else -1

    width = columns + 1
    for r, c in zip(*np.nonzero(free), strict=True):
        low = r * width + c
        # counter-clockwise from above: towards +z along low x, then +x, then back
        corners += [low, low + width, low + width + 1, low + 1]
        neighbours += [at(r, c - 1), at(r + 1, c), at(r, c + 1), at(r - 1, c)]
    count = int(free.sum())
    quads = np.array(corners, np.int32).reshape(count, 4)
    return PolyMesh(
        vertices=vertices,
        polygon_start=np.arange(0, 4 * count + 1, 4, dtype=np.int32),
        polygon_vertices=quads.ravel(),
        neighbours=np.array(neighbours, np.int32),
        flags=np.ones(count, np.uint16),
        detail_vertices=np.zeros((0, 3)),
        detail_vertex_start=np.zeros(count + 1, np.int32),
        detail_triangles=quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3),
        detail_flags=np.tile(np.array([1 | 4, 4 | 16], np.uint8), count),
        detail_start=np.arange(0, 2 * count + 1, 2, dtype=np.int32),
        bounds=np.stack([vertices.min(axis=0), vertices.max(axis=0)]),
    )


def random_room(seed: int, size: int = 7, blocked: float = 0.25, slope: float = SLOPE):
    """A random floor without blocked cells that touch in a corner alone: navmesh, free cells, grid lines."""
    rng = np.random.default_rng(seed)
    while True:
        free = rng.random((size, size)) >= blocked
        a, b, c, d = free[:-1, :-1], free[:-1, 1:], free[1:, :-1], free[1:, 1:]
        if free.any() and not ((a == d) & (b == c) & (a != b)).any():
            break
    xs, zs = (np.cumsum(rng.uniform(0.5, 1.5, size + 1)).astype(np.float32).astype(np.float64) for _ in range(2))
    settings = NavMeshSettings(cell_height=0.05)
    return NavMesh(grid_mesh(free, xs, zs, slope), settings), free, xs, zs


def blocked_boxes(free, xs, zs) -> np.ndarray:
    """What the blocked cells cover, as boxes (n, 4: x0 z0 x1 z1) 1e-7 smaller on every side.

    Two blocked cells side by side are a box too, so that no way leads between them, and cells at the rim reach out.
    """
    xs, zs = xs.copy(), zs.copy()
    inner = np.array([xs[0], zs[0], xs[-1], zs[-1]])
    r, c = np.nonzero(~free)
    rows, columns = [(r, c, r, c)], np.array([-1.0, -1.0, 1.0, 1.0])
    for dr, dc in ((0, 1), (1, 0)):
        pairs = ~free[: free.shape[0] - dr, : free.shape[1] - dc] & ~free[dr:, dc:]
        pr, pc = np.nonzero(pairs)
        rows.append((pr, pc, pr + dr, pc + dc))
    boxes = np.concatenate([np.stack([xs[c0], zs[r0], xs[c1 + 1], zs[r1 + 1]], axis=1) for r0, c0, r1, c1 in rows])
    return boxes + np.where(boxes == inner, columns, -1e-7 * columns)


def visible(a, b, boxes, low, high) -> bool:
    """Whether the ground segment a-b stays inside the bounds and outside the open boxes (n, 4: x0 z0 x1 z1)."""
    if (np.minimum(a, b) < low - 1e-9).any() or (np.maximum(a, b) > high + 1e-9).any():
        return False
    enter, leave = np.zeros(len(boxes)), np.ones(len(boxes))
    outside = np.zeros(len(boxes), bool)
    for axis in (0, 1):
        near, far = boxes[:, axis], boxes[:, 2 + axis]
        step = b[axis] - a[axis]
        if abs(step) < 1e-15:
            outside |= (a[axis] <= near) | (a[axis] >= far)
            continue
        t = np.sort([(near - a[axis]) / step, (far - a[axis]) / step], axis=0)
        enter, leave = np.maximum(enter, t[0]), np.minimum(leave, t[1])
    return bool((outside | (enter >= leave)).all())


def shortest_distances(points, free, xs, zs) -> np.ndarray:
    """Brute force: ground distances between points (n, 2: x z) over all corners of blocked cells; inf for no way."""
    boxes = blocked_boxes(free, xs, zs)
    low, high = np.array([xs[0], zs[0]]), np.array([xs[-1], zs[-1]])
    r, c = np.nonzero(~free)
    corners = np.unique(
        np.concatenate([np.stack([xs[c + i], zs[r + j]], axis=1) for i in (0, 1) for j in (0, 1)]), axis=0
    )
    nodes = np.concatenate([points, corners])
    graph = np.zeros((len(nodes), len(nodes)))
    for i in range(len(nodes)):
        for j in range(i):
            if visible(nodes[i], nodes[j], boxes, low, high):
                graph[i, j] = max(np.linalg.norm(nodes[i] - nodes[j]), 1e-12)
    return dijkstra(csr_array(graph), directed=False)[: len(points), : len(points)]
