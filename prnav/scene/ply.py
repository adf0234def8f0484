"""PLY files as parts: polygons or triangle strips, colours of vertices and faces, one or several textures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.scene.images import EncodedImage
from prnav.scene.parts import Part, Textures, check_triangles
from prnav.scene.ply_file import Header, ListColumn, Rows, read_header, read_tables
from prnav.scene.real_colors import color_range
from prnav.scene.source import MeshSource
from prnav.scene.triangulate import MAX_CORNERS, triangulate

_FACES, _STRIPS = ("face", "faces", "polygon"), ("tristrips", "tristrip")
_INDICES = ("vertex_indices", "vertex_index", "vertex_ids", "indices")
_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"), ("tex_u", "tex_v"))
_COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_READ_PAST = {
    "nx", "ny", "nz", "normal_x", "normal_y", "normal_z", "alpha", "a", "diffuse_alpha", "flags", "quality",
    "confidence",
    "ambient_red", "ambient_green", "ambient_blue", "specular_red", "specular_green", "specular_blue",
    "specular_coeff", "specular_power", "curvature", "radius", "intensity",
}  # fmt: skip
"""Columns that have nothing to do with colour, or with what a scene is made of."""


class _Surface(NamedTuple):
    """Triangles of a PLY by the corners of its polygons."""

    vertex: NDArray[np.int64]
    """Vertex of each corner, (C,)."""
    triangles: NDArray[np.int64]
    """Corners of each triangle, (F, 3)."""
    polygons: NDArray[np.int64]
    """Row of the face element that each triangle is of, (F,)."""


def ply_parts(source: MeshSource, textures: Textures, notes: list[str]) -> list[Part]:
    """Parts of a PLY file in its own frame; images go into ``textures``, what was left out into ``notes``.

    The colour of a point is vertex colour times face colour times texel.

    Raises:
        SceneError: the file is broken.
    """
    path, data = source.path, source.data
    header = read_header(path, data)
    tables = read_tables(path, data, header, ("vertex", *_FACES, *_STRIPS))
    vertex = tables.get("vertex")
    if vertex is None or not all(axis in vertex.scalars for axis in "xyz"):
        raise SceneError(f"scene {path}: its PLY header has no vertices with x, y and z; export it again")
    _note_elements(header, notes)
    positions = np.stack([vertex.scalars[axis] for axis in "xyz"], axis=1)
    vertex_colors = _colors(vertex, "vertices", notes)
    parts: list[Part] = []
    for name, table in tables.items():
        if name != "vertex" and table.rows:
            surface = _surface(source, name, table, positions, notes)
            check_triangles(path, len(surface.triangles))
            parts += _textured_parts(source, surface, positions, vertex_colors, vertex, table, header, textures, notes)
    if vertex.rows:
        _note_columns(vertex, "vertices", notes)
    return parts


def _note_elements(header: Header, notes: list[str]) -> None:
    known = ("vertex", *_FACES, *_STRIPS, "edge", "camera")
    others = [element.name for element in header.elements if element.name not in known and element.count]
    if others:
        notes.append(f"elements not read: {', '.join(sorted(others))}")


def _note_columns(table: Rows, what: str, notes: list[str]) -> None:
    read = {"x", "y", "z", "texnumber", "texcoord", *_READ_PAST, *_INDICES}
    for names in (*_UVS, *_COLORS):
        read.update(names)
    others = sorted(name for name in (*table.scalars, *table.lists) if name not in read)
    if others:
        notes.append(f"properties of {what} not read: {', '.join(others)}")


def _colors(table: Rows, what: str, notes: list[str]) -> NDArray[np.float64] | None:
    """Colours 0..1 (n, 3); None where the element has none."""
    for names in _COLORS:
        present = [name for name in names if name in table.scalars]
        if len(present) == 3:
            values = np.stack([table.scalars[name] for name in names], axis=1)
            return _unit(values, table.types[names[0]])
        if present and names is not _COLORS[2]:
            notes.append(f"colours of {what} not read: they have {', '.join(present)} alone")
    return None


def _unit(values: NDArray[np.float64], kind: str) -> NDArray[np.float64]:
    """Colours 0..1 of numbers of a type; wide whole numbers that stay under 256 are taken for bytes."""
    if kind[0] == "f":
        return values / color_range(values)
    if kind == "i1":
        return np.where(values < 0, values + 256.0, values) / 255.0
    top = float(values.max(initial=0.0))
    return values / (255.0 if top <= 255.0 else 65535.0 if top <= 65535.0 else 2.0**32 - 1.0)


def _surface(source: MeshSource, name: str, table: Rows, positions: NDArray[np.float64], notes: list[str]) -> _Surface:
    path = source.path
    column = next((table.lists[key] for key in _INDICES if key in table.lists), None)
    if column is None:
        raise SceneError(f"scene {path}: its {name} element has no list {' or '.join(_INDICES[:2])}; export it again")
    strips = name in _STRIPS
    values = column.values
    bad = ~((values >= (-1 if strips else 0)) & (values < len(positions)) & (values == np.floor(values)))
    if bad.any():
        found = values[bad][0]
        raise SceneError(
            f"scene {path}: a {name} refers to vertex {found:.15g}, valid are 0..{len(positions) - 1}; export it again"
        )
    vertex = values.astype(np.int64)
    if strips:
        triangles, rows = _strip_triangles(vertex, column.sizes)
        return _Surface(np.maximum(vertex, 0), triangles, rows)
    if len(column.sizes) and column.sizes.max() > MAX_CORNERS:
        raise SceneError(
            f"scene {path}: a polygon of {column.sizes.max()} corners; at most {MAX_CORNERS} are taken: triangulate "
            "it and export again"
        )
    if short := int((column.sizes < 3).sum()):
        notes.append(f"{short} faces of fewer than 3 corners are left out")
    fill = triangulate(positions[vertex], column.sizes)
    if fill.crossing:
        notes.append(f"{fill.crossing} polygons cross themselves; what is inside of them is not defined")
    return _Surface(vertex, fill.corners, fill.polygons)


def _strip_triangles(
    vertex: NDArray[np.int64], sizes: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles of strips that -1 and the end of each list break, (F, 3), and the list each is of, (F,)."""
    row = np.repeat(np.arange(len(sizes)), sizes)
    breaks = vertex < 0
    begin = np.ones(len(vertex), bool)
    begin[1:] = breaks[:-1] | (row[1:] != row[:-1])
    place = np.arange(len(vertex))
    first = np.maximum.accumulate(np.where(begin, place, 0))
    good = np.flatnonzero((place - first >= 2) & ~breaks)
    turned = (good - first[good]) % 2 == 1  # every second triangle turns the other way
    triangles = np.stack([good - 2, good - 1, good], axis=1)
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    a, b, c = vertex[triangles].T
    whole = (a != b) & (b != c) & (a != c)  # repeated corners only turn a strip round
    return triangles[whole], row[good][whole]


def _textured_parts(
    source: MeshSource,
    surface: _Surface,
    positions: NDArray[np.float64],
    vertex_colors: NDArray[np.float64] | None,
    vertex: Rows,
    faces: Rows,
    header: Header,
    textures: Textures,
    notes: list[str],
) -> list[Part]:
    face_colors = _colors(faces, "faces", notes)
    uvs, mapped = _corner_uvs(source, surface, vertex, faces, notes)
    picture = _pictures(surface, vertex, faces, header, notes)
    _note_columns(faces, "faces", notes)
    if header.textures and not mapped.any():
        notes.append("it names pictures and has no texture coordinates, it shows its colours alone")
    parts = []
    for number in np.unique(picture).tolist():
        rows = np.flatnonzero(picture == number)
        texture = _texture(source, header, number, textures)
        if texture and (bare := int((~mapped[rows]).sum())) and mapped.any():
            notes.append(f"{bare} triangles have a picture and no texture coordinates, they show their colour alone")
        for textured in (True, False):
            own = rows[mapped[rows] == textured] if texture else rows if not textured else rows[:0]
            if len(own):
                parts.append(
                    _part(surface, own, positions, vertex_colors, face_colors, uvs if textured else None, texture)
                )
    return parts


def _corner_uvs(
    source: MeshSource, surface: _Surface, vertex: Rows, faces: Rows, notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Texture coordinates of corners (C, 2), v up, and the triangles that have them (F,)."""
    column = faces.lists.get("texcoord")
    indices = next((faces.lists[key] for key in _INDICES if key in faces.lists), None)
    if column is not None and indices is not None and column.sizes.any():
        return _face_uvs(source, surface, column, indices)
    for u, v in _UVS:
        if u in vertex.scalars and v in vertex.scalars:
            uvs = np.stack([vertex.scalars[u], vertex.scalars[v]], axis=1)[surface.vertex]
            return uvs, np.ones(len(surface.triangles), bool)
    return np.zeros((len(surface.vertex), 2)), np.zeros(len(surface.triangles), bool)


def _face_uvs(
    source: MeshSource, surface: _Surface, column: ListColumn, indices: ListColumn
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    has = column.sizes > 0
    wrong = np.flatnonzero(has & (column.sizes != 2 * indices.sizes))
    if len(wrong):
        raise SceneError(
            f"scene {source.path}: face {wrong[0]} has {indices.sizes[wrong[0]]} corners and {column.sizes[wrong[0]]} "
            "numbers of texture coordinates, not two for each corner; export it again"
        )
    uvs = np.zeros((len(surface.vertex), 2))
    uvs[np.repeat(has, indices.sizes)] = column.values.reshape(-1, 2)
    return uvs, has[surface.polygons]


def _pictures(surface: _Surface, vertex: Rows, faces: Rows, header: Header, notes: list[str]) -> NDArray[np.int64]:
    """Number of the picture of each triangle, -1 for none, (F,)."""
    count = len(header.textures)
    if "texnumber" in faces.scalars:
        numbers = faces.scalars["texnumber"][surface.polygons]
    elif "texnumber" in vertex.scalars:
        numbers = vertex.scalars["texnumber"][surface.vertex[surface.triangles[:, 0]]]
    else:
        numbers = np.zeros(len(surface.triangles))
        if count > 1:
            notes.append(f"it names {count} pictures and no texnumber that says which is where, the first one is taken")
    result = np.where(np.isfinite(numbers) & (numbers >= 0) & (numbers < count), numbers, -1).astype(np.int64)
    beyond = int((numbers >= count).sum()) if count or "texnumber" in (*faces.scalars, *vertex.scalars) else 0
    if beyond:
        notes.append(
            f"{beyond} triangles name a picture beyond the {count} that it names, they show their colour alone"
        )
    return result


def _texture(source: MeshSource, header: Header, number: int, textures: Textures) -> int:
    if number < 0 or header.textures[number] not in source.side:
        return 0
    name = header.textures[number]
    return textures.add(EncodedImage(source.side[name], f"scene {source.path}: image {name!r}"))


def _part(
    surface: _Surface,
    own: NDArray[np.int64],
    positions: NDArray[np.float64],
    vertex_colors: NDArray[np.float64] | None,
    face_colors: NDArray[np.float64] | None,
    uvs: NDArray[np.float64] | None,
    texture: int,
) -> Part:
    """Part of some triangles; without ``uvs`` it has no texture."""
    corners = surface.triangles[own].ravel()
    rows = surface.vertex[corners]
    if face_colors is None and uvs is None:
        occurs = np.zeros(len(positions), bool)
        occurs[rows] = True
        faces = (np.cumsum(occurs) - 1)[rows].reshape(-1, 3)
        colors = np.ones(3) if vertex_colors is None else vertex_colors[occurs]
        return Part.of(positions[occurs], faces, None, colors, 0)
    colors = np.ones((len(rows), 3)) if vertex_colors is None else vertex_colors[rows]
    if face_colors is not None:
        colors = colors * np.repeat(face_colors[surface.polygons[own]], 3, axis=0)
    coordinates = None if uvs is None else np.stack([uvs[corners, 0], 1.0 - uvs[corners, 1]], axis=1)
    faces = np.arange(len(rows)).reshape(-1, 3)
    return Part.of(positions[rows], faces, coordinates, colors, texture if uvs is not None else 0)
