"""Habitat's navigation mesh files, written: MSET version 2 with one Detour tile.

Before: :mod:`.polymesh`. After: a file.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from prnav.errors import NavMeshError
from prnav.navmesh.boxes import coarse_boxes
from prnav.navmesh.detour_format import (
    DETAIL,
    LINK,
    NODE,
    NULL_LINK,
    POLYGON,
    SET_HEADER,
    SET_MAGIC,
    SETTINGS,
    TILE_ENTRY,
    TILE_HEADER,
    TILE_MAGIC,
    TILE_VERSION,
    VERTS_PER_POLYGON,
)
from prnav.navmesh.polymesh import PolyMesh
from prnav.navmesh.settings import NavMeshSettings


def navmesh_bytes(mesh: PolyMesh, settings: NavMeshSettings, tiles: tuple[int, bytes, bytes] | None = None) -> bytes:
    """A ``.navmesh`` file.

    Args:
        mesh: The polygons; used where ``tiles`` is None.
        settings: Written into the file.
        tiles: Number of tiles, set header and tiles of the file that the mesh was read from, written as they are.

    Raises:
        NavMeshError: the mesh is larger than a tile can be.
    """
    values = np.zeros(1, SETTINGS)
    for field in dataclasses.fields(settings):
        values[field.name] = getattr(settings, field.name)
    if tiles is not None:
        count, stored, body = tiles
        header = np.frombuffer(stored, SET_HEADER, 1).copy()
        header["version"], header["tiles"] = 2, count
        return header.tobytes() + values.tobytes() + body
    tile = _tile_bytes(mesh, settings)
    header = np.zeros(1, SET_HEADER)
    header["magic"], header["version"], header["tiles"] = SET_MAGIC, 2, 1
    header["origin"] = mesh.bounds[0]
    low, high = mesh.bounds.astype(np.float32)
    header["tile_width"], header["tile_height"] = high[0] - low[0], high[2] - low[2]
    header["max_tiles"], header["max_polys"] = 1, mesh.num_polygons
    entry = np.zeros(1, TILE_ENTRY)
    # a reference is salt | tile | polygon; the first tile has number 0, salt 1 and as many polygon bits as needed
    entry["reference"] = 1 << max(mesh.num_polygons - 1, 0).bit_length()
    entry["size"] = len(tile)
    return header.tobytes() + values.tobytes() + entry.tobytes() + tile


def _tile_bytes(mesh: PolyMesh, settings: NavMeshSettings) -> bytes:
    count = mesh.num_polygons
    sizes = np.diff(mesh.polygon_start)
    extra, triangles = np.diff(mesh.detail_vertex_start), np.diff(mesh.detail_start)
    limits = {
        "vertices": (len(mesh.vertices), 0xFFFE),
        "polygons": (count, 0x7FFF),
        "corners of a polygon": (int(sizes.max(initial=0)), VERTS_PER_POLYGON),
        "detail vertices of a polygon": (int(extra.max(initial=0)), 255 - VERTS_PER_POLYGON),
        "detail triangles of a polygon": (int(triangles.max(initial=0)), 255),
    }
    for what, (value, most) in limits.items():
        if value > most:
            raise NavMeshError(f"navmesh has {value} {what}, a Detour tile holds {most}; use a larger cell_size")
    polys = np.zeros(count, POLYGON)
    polys["count"], polys["flags"] = sizes, mesh.flags
    polygon = mesh.polygon_of_corner()
    place = np.arange(len(polygon)) - mesh.polygon_start[polygon]
    polys["verts"][polygon, place] = mesh.polygon_vertices
    polys["neighbours"][polygon, place] = mesh.neighbours + 1
    links = _links(mesh, polys, polygon, place)
    details = np.zeros(count, DETAIL)
    details["vert_base"], details["verts"] = mesh.detail_vertex_start[:-1], extra
    details["tri_base"], details["tris"] = mesh.detail_start[:-1], triangles
    nodes = _bounding_tree(mesh, settings)
    header = np.zeros(1, TILE_HEADER)
    fields = {
        "magic": TILE_MAGIC,
        "version": TILE_VERSION,
        "polys": count,
        "verts": len(mesh.vertices),
        "links": len(links),
        "details": count,
        "detail_verts": len(mesh.detail_vertices),
        "detail_tris": len(mesh.detail_triangles),
        "nodes": len(nodes),
        "connection_base": count,
        "walkable_height": settings.agent_height,
        "walkable_radius": settings.agent_radius,
        "walkable_climb": settings.agent_max_climb,
        "low": mesh.bounds[0],
        "high": mesh.bounds[1],
        "quantisation": 1.0 / settings.cell_size,
    }
    for name, value in fields.items():
        header[name] = value
    return b"".join(
        part.tobytes()
        for part in (
            header,
            mesh.vertices.astype("<f4"),
            polys,
            links,
            details,
            mesh.detail_vertices.astype("<f4"),
            _detail_triangles(mesh),
            nodes,
        )
    )


def _links(mesh: PolyMesh, polys: NDArray, polygon: NDArray[np.int32], place: NDArray[np.int64]) -> NDArray:
    """Links to neighbours in Detour's order: each polygon's list starts with its last edge's."""
    reference = 1 << max(mesh.num_polygons - 1, 0).bit_length()
    linked = np.flatnonzero(mesh.neighbours >= 0)
    order = linked[np.lexsort((-place[linked], polygon[linked]))]
    links = np.zeros(len(polygon), LINK)
    used = len(order)
    links["next"][used:] = np.arange(used + 1, len(polygon) + 1)
    links["next"][-1:] = NULL_LINK
    polys["first_link"] = NULL_LINK
    if used:
        links["polygon"][:used] = reference | mesh.neighbours[order]
        links["edge"][:used] = place[order]
        links["side"][:used] = 0xFF
        last = np.append(polygon[order][1:] != polygon[order][:-1], True)
        links["next"][:used] = np.where(last, NULL_LINK, np.arange(1, used + 1))
        first = np.append(True, last[:-1])
        polys["first_link"][polygon[order][first]] = np.flatnonzero(first)
    return links


def _detail_triangles(mesh: PolyMesh) -> NDArray[np.uint8]:
    """Triangles with Detour's numbering: the polygon's own corners, then its detail vertices."""
    rows = np.zeros((len(mesh.detail_triangles), 4), np.uint8)
    rows[:, 3] = mesh.detail_flags
    corners = len(mesh.vertices)
    for p in range(mesh.num_polygons):
        first, end = mesh.detail_start[p], mesh.detail_start[p + 1]
        own = mesh.polygon_vertices[mesh.polygon_start[p] : mesh.polygon_start[p + 1]].tolist()
        number = {v: i for i, v in enumerate(own)}
        base = corners + int(mesh.detail_vertex_start[p]) - len(own)
        for t in range(first, end):
            for k, v in enumerate(mesh.detail_triangles[t].tolist()):
                rows[t, k] = number[v] if v < corners else v - base
    return rows


def _bounding_tree(mesh: PolyMesh, settings: NavMeshSettings) -> NDArray:
    """Detour's tree of bounding boxes, in units of cells from the lower corner; nodes stand before their children."""
    count = mesh.num_polygons
    boxes = coarse_boxes(mesh, settings.cell_size, settings.cell_height).astype(np.uint16)
    low, high = boxes[:, :3], boxes[:, 3:]
    nodes = np.zeros(2 * count, NODE)
    used = 0
    waiting = [(np.arange(count), -1)]  # polygons of a subtree; -1, or the inner node whose subtree ends before it
    while waiting:
        rows, parent = waiting.pop()
        if parent >= 0:
            nodes["index"][parent] = -(used - parent)
            continue
        node, used = used, used + 1
        nodes["low"][node], nodes["high"][node] = low[rows].min(axis=0), high[rows].max(axis=0)
        if len(rows) == 1:
            nodes["index"][node] = rows[0]
            continue
        axis = int(np.argmax(nodes["high"][node].astype(int) - nodes["low"][node].astype(int)))
        rows = rows[np.argsort(low[rows, axis], kind="stable")]
        half = len(rows) // 2
        waiting += [(rows[:0], node), (rows[half:], -1), (rows[:half], -1)]
    return nodes
