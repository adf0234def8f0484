"""The floors of one or more scenes as flat arrays: what every query kernel reads.

A *corner* is one polygon's visit to a vertex, and stands for the edge from there to the polygon's next corner too.
Two polygons that meet share an edge, and its two corners are *twins*. The corners around a vertex that can be reached
from each other across edges form a *fan*; where two rooms touch in a single point, the vertex has two fans, and no way
leads from one to the other. Shortest paths turn at fans whose walkable angle is above 180 degrees, nowhere else.

Polygons that cannot be walked keep their place but have no neighbours, no cells and no island. Several scenes lie one
after another, so that one compiled call serves agents in any mix of them.

Before: :mod:`.polymesh`. After: :mod:`.locate`, the first of the compiled queries.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.navmesh.boxes import coarse_boxes
from prnav.navmesh.polymesh import FLAG_WALK, PolyMesh
from prnav.navmesh.settings import NavMeshSettings

CELL = 0.5  #: side of a grid cell for point location [m]
MAX_CELLS_PER_SIDE = 1024  #: larger scenes get larger cells
ENTRIES_PER_POLYGON = 64  #: on average; more than this (and a million) and cells become coarser
MIN_POLYGON_AREA = 1e-5  #: Habitat disables smaller polygons [m2]
TURN = 1e-9  #: a fan turns where its angle exceeds pi by this [rad]


class Surface(NamedTuple):
    """Arrays over all scenes: C corners, P polygons, F fans, T detail triangles, S scenes."""

    corner: NDArray[np.float64]  #: position, (C, 3) [m]
    following: NDArray[np.int32]  #: next corner of the same polygon, counter-clockwise, (C,)
    twin: NDArray[np.int32]  #: corner of the neighbour's same edge, (C,); -1 at a wall
    polygon: NDArray[np.int32]  #: polygon of a corner, (C,)
    fan: NDArray[np.int32]  #: fan of a corner, (C,)
    turn: NDArray[np.bool_]  #: whether shortest paths can turn at a fan, (F,)
    walls: NDArray[
        np.float64
    ]  #: x and z of the wall edge that leaves a turning fan, then of the one that arrives, (F, 4)
    start: NDArray[np.int32]  #: first corner of each polygon, (P + 1,)
    island: NDArray[np.int32]  #: island of a polygon within its scene, (P,); -1 where it cannot be walked
    box: NDArray[np.float64]  #: bounds, lower then upper, (P, 6) [m]
    coarse_box: NDArray[np.int32]  #: the same in Detour's units, from the scene's origin, (P, 6)
    detail_start: NDArray[np.int32]  #: first detail triangle of each polygon, (P + 1,)
    detail: NDArray[np.float64]  #: corners of detail triangles, (T, 9) [m]
    outline: NDArray[np.uint8]  #: bits 0, 1, 2: edge 01, 12, 20 of a triangle lies on its polygon's outline, (T,)
    cell_start: NDArray[np.int32]  #: CSR offsets of grid cells into cell_polygon, scene by scene, row by row
    cell_polygon: NDArray[np.int32]  #: polygons whose bounds touch a cell, ascending
    grid: NDArray[np.float64]  #: per scene: x and z of the grid's corner, cell size, (S, 3) [m]
    grid_shape: NDArray[np.int64]  #: per scene: columns along x, rows along z, first entry of cell_start, (S, 3)
    scene_polygon: NDArray[np.int32]  #: first polygon of each scene, (S + 1,)
    scene_fan: NDArray[np.int32]  #: first fan of each scene, (S + 1,)
    scene_box: NDArray[np.float64]  #: bounds of the mesh each scene was built from, (S, 6) [m]
    scene_unit: NDArray[np.float64]  #: per scene: Detour's units per metre, climb [m], (S, 2)


def build_surface(mesh: PolyMesh, settings: NavMeshSettings) -> Surface:
    """Query arrays of one scene."""
    corners = len(mesh.polygon_vertices)
    start = mesh.polygon_start.astype(np.int32)
    polygon = mesh.polygon_of_corner()
    following = np.arange(1, corners + 1, dtype=np.int32)
    following[start[1:] - 1] = start[:-1]
    detail, outline, detail_start = _detail(mesh)
    triangle_polygon = np.repeat(np.arange(mesh.num_polygons), np.diff(detail_start))
    area = np.bincount(triangle_polygon, weights=triangle_areas(detail), minlength=mesh.num_polygons)
    walk = ((mesh.flags & FLAG_WALK) != 0) & (area >= MIN_POLYGON_AREA)
    twin = _twins(mesh, following, polygon, walk)
    position = mesh.vertices[mesh.polygon_vertices].reshape(-1, 3)
    fan, turn, walls = _fans(position, following, twin, polygon)
    box = _boxes(detail, detail_start, mesh.num_polygons)
    cell_start, cell_polygon, grid, shape = _grid(box, walk)
    return Surface(
        corner=np.ascontiguousarray(position, dtype=np.float64),
        following=following,
        twin=twin,
        polygon=polygon,
        fan=fan,
        turn=turn,
        walls=walls,
        start=start,
        island=_islands(twin, polygon, walk, mesh.num_polygons),
        box=box,
        coarse_box=coarse_boxes(mesh, settings.cell_size, settings.cell_height),
        detail_start=detail_start,
        detail=detail,
        outline=outline,
        cell_start=cell_start,
        cell_polygon=cell_polygon,
        grid=grid[None],
        grid_shape=np.array([[*shape, 0]], dtype=np.int64),
        scene_polygon=np.array([0, mesh.num_polygons], np.int32),
        scene_fan=np.array([0, len(turn)], np.int32),
        scene_box=mesh.bounds.reshape(1, 6).astype(np.float64),
        scene_unit=np.array([[1.0 / settings.cell_size, settings.agent_max_climb]]),
    )


def concatenate_surfaces(surfaces: Sequence[Surface]) -> Surface:
    """One surface of many scenes, in the order given."""
    if len(surfaces) == 1:
        return surfaces[0]
    offset = {
        "corner": _offsets([len(s.corner) for s in surfaces]),
        "polygon": _offsets([len(s.island) for s in surfaces]),
        "fan": _offsets([len(s.turn) for s in surfaces]),
        "detail": _offsets([len(s.detail) for s in surfaces]),
        "cell": _offsets([len(s.cell_polygon) for s in surfaces]),
        "row": _offsets([len(s.cell_start) for s in surfaces]),
    }

    def shifted(name: str, by: str) -> NDArray[np.int32]:
        parts = [getattr(s, name) + o for s, o in zip(surfaces, offset[by], strict=False)]
        return np.concatenate(parts).astype(np.int32)

    def plain(name: str) -> NDArray:
        return np.concatenate([getattr(s, name) for s in surfaces])

    def csr(name: str, by: str) -> NDArray[np.int32]:
        parts = [getattr(s, name)[:-1] + o for s, o in zip(surfaces, offset[by], strict=False)]
        return np.concatenate([*parts, offset[by][-1:]]).astype(np.int32)

    twins = [np.where(s.twin < 0, -1, s.twin + o) for s, o in zip(surfaces, offset["corner"], strict=False)]
    shapes = plain("grid_shape")
    shapes[:, 2] = offset["row"][:-1]
    return Surface(
        corner=plain("corner"),
        following=shifted("following", "corner"),
        twin=np.concatenate(twins).astype(np.int32),
        polygon=shifted("polygon", "polygon"),
        fan=shifted("fan", "fan"),
        turn=plain("turn"),
        walls=plain("walls"),
        start=csr("start", "corner"),
        island=plain("island"),
        box=plain("box"),
        coarse_box=plain("coarse_box"),
        detail_start=csr("detail_start", "detail"),
        detail=plain("detail"),
        outline=plain("outline"),
        cell_start=shifted("cell_start", "cell"),
        cell_polygon=shifted("cell_polygon", "polygon"),
        grid=plain("grid"),
        grid_shape=shapes,
        scene_polygon=offset["polygon"].astype(np.int32),
        scene_fan=offset["fan"].astype(np.int32),
        scene_box=plain("scene_box"),
        scene_unit=plain("scene_unit"),
    )


def triangle_areas(detail: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of detail triangles (T, 9) in space, (T,) [m2]."""
    a, b, c = detail[:, 0:3], detail[:, 3:6], detail[:, 6:9]
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _offsets(counts: list[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _detail(mesh: PolyMesh) -> tuple[NDArray[np.float64], NDArray[np.uint8], NDArray[np.int32]]:
    """Detail triangles with their outline bits; polygons without any get a triangle fan."""
    counts = np.diff(mesh.detail_start)
    flags = mesh.detail_flags.astype(np.uint8)
    bits = (flags & 1) | ((flags >> 1) & 2) | ((flags >> 2) & 4)
    triangles, start = mesh.detail_triangles.reshape(-1, 3), mesh.detail_start
    if (counts == 0).any():
        parts, part_bits, sizes = [], [], []
        for p in range(mesh.num_polygons):
            rows = triangles[start[p] : start[p + 1]]
            row_bits = bits[start[p] : start[p + 1]]
            if not len(rows):
                v = mesh.polygon_vertices[mesh.polygon_start[p] : mesh.polygon_start[p + 1]]
                rows = np.stack([np.full(len(v) - 2, v[0]), v[1:-1], v[2:]], axis=1)
                row_bits = np.full(len(rows), 2, np.uint8)
                row_bits[0] |= 1
                row_bits[-1] |= 4
            parts.append(rows)
            part_bits.append(row_bits)
            sizes.append(len(rows))
        triangles, bits = np.concatenate(parts), np.concatenate(part_bits)
        start = _offsets(sizes).astype(np.int32)
    detail = mesh.all_vertices[triangles].reshape(-1, 9)
    return np.ascontiguousarray(detail, dtype=np.float64), bits.astype(np.uint8), start.astype(np.int32)


def _twins(
    mesh: PolyMesh, following: NDArray[np.int32], polygon: NDArray[np.int32], walk: NDArray[np.bool_]
) -> NDArray[np.int32]:
    """Corner of the neighbour that names the same edge, where both polygons can be walked."""
    corners = len(following)
    twin = np.full(corners, -1, np.int32)
    linked = (mesh.neighbours >= 0) & walk[polygon]
    linked[linked] &= walk[mesh.neighbours[linked]]
    edge = np.flatnonzero(linked)
    here = np.stack([polygon[edge], mesh.neighbours[edge]], axis=1)
    a, b = mesh.polygon_vertices[edge], mesh.polygon_vertices[following[edge]]
    by_key = {(p, n, i, j): int(e) for (p, n), i, j, e in zip(here.tolist(), a.tolist(), b.tolist(), edge, strict=True)}
    for (p, n), i, j, e in zip(here.tolist(), a.tolist(), b.tolist(), edge, strict=True):
        twin[e] = by_key.get((n, p, j, i), -1)
    return twin


def _fans(
    position: NDArray[np.float64], following: NDArray[np.int32], twin: NDArray[np.int32], polygon: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.bool_], NDArray[np.float64]]:
    """Fan of each corner, which fans a shortest path can turn at, and the walls there."""
    corners = len(following)
    previous = np.empty(corners, np.int32)
    previous[following] = np.arange(corners, dtype=np.int32)
    outward = position[following] - position
    inward = position[previous] - position
    cross = outward[:, 2] * inward[:, 0] - outward[:, 0] * inward[:, 2]
    angle = np.arctan2(cross, outward[:, 0] * inward[:, 0] + outward[:, 2] * inward[:, 2])
    fan = np.full(corners, -1, np.int32)
    turn: list[bool] = []
    walls: list[list[float]] = []
    for first in range(corners):
        if fan[first] >= 0:
            continue
        corner, members, closed = first, [first], False
        while True:  # across the edge that leaves the vertex: the neighbour's corner after its twin edge
            other = twin[corner]
            corner = following[other] if other >= 0 else -1
            if corner < 0 or corner == first or len(members) > corners:
                closed = corner == first
                break
            members.append(int(corner))
        corner = first
        while not closed:  # across the edge that arrives
            other = twin[previous[corner]]
            if other < 0 or fan[other] >= 0 or other in members:
                break
            corner = other
            members.append(int(corner))
        fan[members] = len(turn)
        turn.append(not closed and math.fsum(angle[members]) > math.pi + TURN)
        sides = [0.0] * 4
        for corner in members:
            if twin[corner] < 0:
                sides[0], sides[1] = outward[corner, 0], outward[corner, 2]
            if twin[previous[corner]] < 0:
                sides[2], sides[3] = inward[corner, 0], inward[corner, 2]
        walls.append(sides)
    return fan, np.array(turn, dtype=np.bool_), np.array(walls, dtype=np.float64).reshape(-1, 4)


def _boxes(detail: NDArray[np.float64], start: NDArray[np.int32], polygons: int) -> NDArray[np.float64]:
    if not polygons:
        return np.zeros((0, 6))
    points = detail.reshape(-1, 3)
    low = np.minimum.reduceat(points, 3 * start[:-1].astype(np.int64))
    high = np.maximum.reduceat(points, 3 * start[:-1].astype(np.int64))
    return np.concatenate([low, high], axis=1)


def _islands(
    twin: NDArray[np.int32], polygon: NDArray[np.int32], walk: NDArray[np.bool_], polygons: int
) -> NDArray[np.int32]:
    """Connected components of the polygons that can be walked, numbered by their first polygon."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edge = np.flatnonzero(twin >= 0)
    graph = coo_array((np.ones(len(edge), np.int8), (polygon[edge], polygon[twin[edge]])), shape=(polygons, polygons))
    label = connected_components(graph, directed=False)[1] if polygons else np.zeros(0, np.int32)
    island = np.full(polygons, -1, np.int32)
    _, first, number = np.unique(label[walk], return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int32)
    rank[np.argsort(first)] = np.arange(len(first), dtype=np.int32)
    island[walk] = rank[number]
    return island


def _grid(
    box: NDArray[np.float64], walk: NDArray[np.bool_]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64], tuple[int, int]]:
    """Uniform grid of cells in the ground plane with the polygons whose bounds touch each."""
    rows = np.flatnonzero(walk)
    if not len(rows):
        return np.zeros(2, np.int32), np.zeros(0, np.int32), np.array([0.0, 0.0, CELL]), (1, 1)
    low, high = box[rows][:, [0, 2]], box[rows][:, [3, 5]]
    origin, span = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
    cell = max(CELL, float(span.max()) / MAX_CELLS_PER_SIDE)
    while True:
        columns, lines = (int(n) for n in np.floor(span / cell).astype(np.int64) + 1)
        first = np.floor((low - origin) / cell).astype(np.int64)
        last = np.minimum(np.floor((high - origin) / cell).astype(np.int64), [columns - 1, lines - 1])
        size = last - first + 1
        counts = size[:, 0] * size[:, 1]
        if counts.sum() <= ENTRIES_PER_POLYGON * len(rows) + 1_000_000:
            break
        cell *= 2.0  # many large polygons on top of each other: coarser cells keep memory bounded
    member = np.repeat(np.arange(len(rows)), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    cells = (first[member, 1] + within // size[member, 0]) * columns + first[member, 0] + within % size[member, 0]
    order = np.argsort(cells, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(cells, minlength=columns * lines))])
    return (
        start.astype(np.int32),
        rows[member[order]].astype(np.int32),
        np.array([*origin, cell]),
        (columns, lines),
    )
