"""Habitat's navigation mesh files, read.

A file is input from strangers: every count is held against the bytes that are there before anything is allocated,
and whatever does not fit together is a :class:`~prnav.errors.NavMeshError` that names the file and the fault.

Before: a file; :mod:`.detour_format`, its layout. After: :mod:`.stitch` for several tiles, then :mod:`.polymesh`.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array, JSONObject, Untyped
from prnav.errors import NavMeshError
from prnav.navmesh.detour_format import (
    CONNECTION_SIZE,
    DETAIL,
    EXTERNAL,
    LINK,
    NODE,
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
from prnav.navmesh.stitch import BorderEdge, Loop, stitch

MAX_COORDINATE = 1e5  #: larger coordinates are taken for a broken file [m]
HABITAT_DISABLED = 4  #: polygon flag of Habitat for polygons of no area


@dataclass(frozen=True, eq=False)
class Tile:
    """One Detour tile, its sections as arrays of the file's own types."""

    header: Untyped
    verts: NDArray[np.float64]
    polys: Array
    details: Array
    detail_verts: NDArray[np.float64]
    detail_tris: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class NavMeshFile:
    """What a ``.navmesh`` file holds."""

    mesh: PolyMesh
    settings: NavMeshSettings
    data: bytes  #: everything after the settings: the tiles as they stand in the file
    header: bytes  #: the set header
    tiles: int  #: number of tiles in ``data``


def read_navmesh(path: str | Path) -> NavMeshFile:
    """Read a ``.navmesh`` file of MSET version 1 or 2, with any number of tiles.

    Version 1 has no settings: those of the tiles (height, radius, climb, cell size) are taken, defaults for the rest.

    Raises:
        NavMeshError: the file is missing, no MSET file, or broken.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise NavMeshError(f"navmesh {path}: cannot be read ({error.strerror}); give a .navmesh file") from error
    return parse_navmesh(data, str(path))


def parse_navmesh(data: bytes, source: str) -> NavMeshFile:
    """Content of a ``.navmesh`` file from its bytes; ``source`` names it in errors."""
    if len(data) < SET_HEADER.itemsize:
        raise NavMeshError(f"navmesh {source}: {len(data)} bytes are too few for a header; the file is truncated")
    header = np.frombuffer(data, SET_HEADER, 1)[0]
    if header["magic"] != SET_MAGIC:
        raise NavMeshError(
            f"navmesh {source}: the magic number is {int(header['magic']):#010x}, not {SET_MAGIC:#010x} (MSET); "
            "only tile sets as Habitat writes them can be read"
        )
    version, tiles = int(header["version"]), int(header["tiles"])
    if version not in (1, 2):
        raise NavMeshError(f"navmesh {source}: MSET version {version} is not known; valid: 1 and 2")
    offset = SET_HEADER.itemsize
    stored = None
    if version == 2:
        if len(data) < offset + SETTINGS.itemsize:
            raise NavMeshError(f"navmesh {source}: the settings end after {len(data)} bytes; the file is truncated")
        stored = np.frombuffer(data, SETTINGS, 1, offset)[0]
        offset += SETTINGS.itemsize
    body = offset
    if tiles < 0 or tiles * (TILE_ENTRY.itemsize + TILE_HEADER.itemsize) > len(data) - offset:
        raise NavMeshError(f"navmesh {source}: {tiles} tiles do not fit into {len(data)} bytes; the file is broken")
    parts: list[Tile] = []
    for number in range(tiles):
        where = f"navmesh {source}: tile {number}"
        if len(data) - offset < TILE_ENTRY.itemsize:
            raise NavMeshError(f"{where} starts past the end of the file; it is truncated")
        entry = np.frombuffer(data, TILE_ENTRY, 1, offset)[0]
        offset += TILE_ENTRY.itemsize
        size = int(entry["size"])
        if not entry["reference"] or not size:
            break  # as Habitat does: an empty entry ends the set
        if size < 0 or size > len(data) - offset:
            raise NavMeshError(f"{where} has {size} bytes, {len(data) - offset} are left; the file is truncated")
        parts.append(_tile(data[offset : offset + size], where))
        offset += size
    if not parts:
        raise NavMeshError(f"navmesh {source}: it has no tiles; build it anew")
    settings = _settings(stored, parts, source)
    return NavMeshFile(
        mesh=_mesh(parts, source),
        settings=settings,
        data=data[body:offset],
        header=data[: SET_HEADER.itemsize],
        tiles=len(parts),
    )


def _settings(stored: Untyped, tiles: list[Tile], source: str) -> NavMeshSettings:
    header = tiles[0].header
    quantisation = float(header["quantisation"])
    values: JSONObject = {
        "cell_size": 1.0 / quantisation if np.isfinite(quantisation) and quantisation > 1e-3 else 0.05,
        "agent_height": float(header["walkable_height"]),
        "agent_radius": float(header["walkable_radius"]),
        "agent_max_climb": float(header["walkable_climb"]),
    }
    if stored is not None:
        values = {
            field.name: bool(stored[field.name]) if stored.dtype[field.name].kind == "u" else float(stored[field.name])
            for field in dataclasses.fields(NavMeshSettings)
        }
    # float32 on file: 0.05 is meant where 0.05000000074505806 stands
    values = {k: v if isinstance(v, bool) or not np.isfinite(v) else float(f"{v:.7g}") for k, v in values.items()}
    try:
        return NavMeshSettings(**values)
    except ValueError as error:
        raise NavMeshError(f"navmesh {source}: its settings are broken: {error}") from error


def _tile(data: bytes, where: str) -> Tile:
    if len(data) < TILE_HEADER.itemsize:
        raise NavMeshError(f"{where} has {len(data)} bytes, too few for its header; the file is broken")
    header = np.frombuffer(data, TILE_HEADER, 1)[0]
    if header["magic"] != TILE_MAGIC or header["version"] != TILE_VERSION:
        raise NavMeshError(
            f"{where} has magic {int(header['magic']):#010x}, version {int(header['version'])}; "
            f"valid: {TILE_MAGIC:#010x} (DNAV), version {TILE_VERSION}"
        )
    sections = {
        "verts": 12,
        "polys": POLYGON.itemsize,
        "links": LINK.itemsize,
        "details": DETAIL.itemsize,
        "detail_verts": 12,
        "detail_tris": 4,
        "nodes": NODE.itemsize,
        "connections": CONNECTION_SIZE,
    }
    offset, at = TILE_HEADER.itemsize, {}
    for name, size in sections.items():
        count = int(header[name])
        if count < 0 or count * size > len(data) - offset:
            raise NavMeshError(f"{where}: {count} {name} do not fit into its {len(data)} bytes; the file is broken")
        at[name] = offset
        offset += count * size
    if header["connections"]:
        raise NavMeshError(f"{where} has {int(header['connections'])} off-mesh connections; they are not supported")
    if header["details"] != header["polys"]:
        raise NavMeshError(f"{where}: {int(header['details'])} detail meshes for {int(header['polys'])} polygons")

    def section(name: str, kind: Untyped, width: int = 1) -> Array:
        return np.frombuffer(data, kind, int(header[name]) * width, at[name])

    def points(name: str) -> NDArray[np.float64]:
        with np.errstate(invalid="ignore"):  # what is not finite is refused below
            return section(name, "<f4", 3).reshape(-1, 3).astype(np.float64)

    tile = Tile(
        header=header,
        verts=points("verts"),
        polys=section("polys", POLYGON),
        details=section("details", DETAIL),
        detail_verts=points("detail_verts"),
        detail_tris=section("detail_tris", "u1", 4).reshape(-1, 4),
    )
    _check(tile, where)
    return tile


def _check(tile: Tile, where: str) -> None:
    """Refuse a tile whose numbers point outside it, or whose polygons are not convex."""
    with np.errstate(invalid="ignore"):
        bounds = np.concatenate([tile.header["low"], tile.header["high"]]).astype(np.float64)
    for name, values in (("vertices", tile.verts), ("detail vertices", tile.detail_verts), ("bounds", bounds)):
        if not (np.abs(values) <= MAX_COORDINATE).all():  # also refuses NaN
            raise NavMeshError(f"{where}: {name} are not finite or beyond {MAX_COORDINATE:g} m; the file is broken")
    if (bounds[:3] > bounds[3:]).any():
        raise NavMeshError(f"{where}: the bounds are upside down; the file is broken")
    climb = float(tile.header["walkable_climb"])
    if not 0.0 <= climb <= MAX_COORDINATE:
        raise NavMeshError(f"{where}: the climb is {climb} m; the file is broken")
    counts = tile.polys["count"].astype(np.int64)
    if ((counts < 3) | (counts > VERTS_PER_POLYGON)).any():
        bad = int(np.flatnonzero((counts < 3) | (counts > VERTS_PER_POLYGON))[0])
        raise NavMeshError(f"{where}: polygon {bad} has {counts[bad]} corners; valid: 3 to {VERTS_PER_POLYGON}")
    if (tile.polys["area_and_type"] >> 6).any():
        raise NavMeshError(f"{where} has off-mesh connections among its polygons; they are not supported")
    used = np.arange(VERTS_PER_POLYGON) < counts[:, None]
    corners = tile.polys["verts"].astype(np.int64)
    if (corners[used] >= len(tile.verts)).any():
        raise NavMeshError(f"{where}: a polygon names a vertex beyond the {len(tile.verts)} there are")
    neighbours = tile.polys["neighbours"].astype(np.int64)
    inner = used & ((neighbours & EXTERNAL) == 0)
    if (neighbours[inner] > len(tile.polys)).any():
        raise NavMeshError(f"{where}: a polygon names a neighbour beyond the {len(tile.polys)} there are")
    details = tile.details
    extra, triangles = details["verts"].astype(np.int64), details["tris"].astype(np.int64)
    if ((details["vert_base"] + extra)[extra > 0] > len(tile.detail_verts)).any():
        raise NavMeshError(f"{where}: a detail mesh names vertices beyond the {len(tile.detail_verts)} there are")
    if ((details["tri_base"] + triangles)[triangles > 0] > len(tile.detail_tris)).any():
        raise NavMeshError(f"{where}: a detail mesh names triangles beyond the {len(tile.detail_tris)} there are")


def _mesh(tiles: list[Tile], source: str) -> PolyMesh:
    """One polygon mesh of all tiles, joined along their borders."""
    vertex_base = np.concatenate([[0], np.cumsum([len(t.verts) for t in tiles])])
    polygon_base = np.concatenate([[0], np.cumsum([len(t.polys) for t in tiles])])
    vertices = np.concatenate([t.verts for t in tiles])
    loops: list[Loop] = []
    border: list[BorderEdge] = []
    detail_counts, triangle_counts, detail_verts, triangles, outline, flags = [], [], [], [], [], []
    # in a set of several tiles corners may move onto each other, so the detail keeps corners of its own
    own = len(tiles) > 1
    detail_base = int(vertex_base[-1])
    for number, tile in enumerate(tiles):
        v0, p0 = int(vertex_base[number]), int(polygon_base[number])
        for i, (poly, detail) in enumerate(zip(tile.polys, tile.details, strict=True)):
            count = int(poly["count"])
            corner = [v0 + int(v) for v in poly["verts"][:count]]
            across = [int(n) for n in poly["neighbours"][:count]]
            for k, n in enumerate(across):
                if n & EXTERNAL:
                    border.append(BorderEdge(number, p0 + i, k, n & 0xFF))
            loops.append(Loop(corner, [-1 if n == 0 or n & EXTERNAL else p0 + n - 1 for n in across]))
            base, extra = int(detail["vert_base"]), int(detail["verts"])
            mine = tile.detail_verts[base : base + extra]
            if own:
                mine = np.concatenate([vertices[corner], mine])
            rows = tile.detail_tris[int(detail["tri_base"]) :][: int(detail["tris"])]
            if (rows[:, :3] >= count + extra).any():
                raise NavMeshError(f"navmesh {source}: tile {number}: a detail triangle of polygon {i} names no vertex")
            local = np.concatenate([[] if own else corner, detail_base + np.arange(len(mine))]).astype(np.int32)
            triangles.append(local[rows[:, :3]])
            outline.append(rows[:, 3])
            detail_verts.append(mine)
            detail_counts.append(len(mine))
            triangle_counts.append(len(rows))
            detail_base += len(mine)
        flags.append(tile.polys["flags"].astype(np.uint16))
    vertices, loops = stitch(vertices, loops, border, [t.header for t in tiles], source)
    low = np.min([t.header["low"] for t in tiles], axis=0)
    high = np.max([t.header["high"] for t in tiles], axis=0)
    mesh = PolyMesh(
        vertices=vertices,
        polygon_start=_csr([len(loop.vertices) for loop in loops]),
        polygon_vertices=np.array([v for loop in loops for v in loop.vertices], np.int32),
        neighbours=np.array([n for loop in loops for n in loop.neighbours], np.int32),
        flags=np.concatenate(flags),
        detail_vertices=_rows(detail_verts, np.float64),
        detail_vertex_start=_csr(detail_counts),
        detail_triangles=_rows(triangles, np.int32),
        detail_flags=np.concatenate([*outline, np.zeros(0, np.uint8)]).astype(np.uint8),
        detail_start=_csr(triangle_counts),
        bounds=np.stack([low, high]).astype(np.float64),
    )
    _check_convex(mesh, source)
    return mesh


def _check_convex(mesh: PolyMesh, source: str) -> None:
    polygon = mesh.polygon_of_corner()
    following = np.arange(1, len(polygon) + 1)
    following[mesh.polygon_start[1:] - 1] = mesh.polygon_start[:-1]
    position = mesh.vertices[mesh.polygon_vertices].reshape(-1, 3)
    edge = position[following] - position
    after = edge[following]
    cross = edge[:, 2] * after[:, 0] - edge[:, 0] * after[:, 2]
    size = np.hypot(edge[:, 0], edge[:, 2]) * np.hypot(after[:, 0], after[:, 2])
    bad = cross < -np.maximum(0.02 * size, 1e-6)
    if bad.any():
        where = int(polygon[np.flatnonzero(bad)[0]])
        raise NavMeshError(f"navmesh {source}: polygon {where} is not convex and counter-clockwise; the file is broken")


def _csr(counts: list[int]) -> NDArray[np.int32]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)


def _rows(parts: list[Array], kind: Untyped) -> Array:
    return np.concatenate([*parts, np.zeros((0, 3), kind)]).astype(kind)
