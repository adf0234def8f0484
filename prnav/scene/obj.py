"""OBJ files with their materials as parts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.scene.images import EncodedImage
from prnav.scene.mtl import MtlMaterial, TextureMap, find_material, library_names, parse_mtl
from prnav.scene.obj_scan import BAD_CORNER, BAD_NUMBER, EARLY_INDEX, FEW_NUMBERS, ObjFault, ObjLines, scan_obj
from prnav.scene.parts import Part, Textures, check_triangles
from prnav.scene.real_colors import color_range
from prnav.scene.side_files import side_key
from prnav.scene.source import MeshSource
from prnav.scene.text_files import decode_name, join_continued, plain_bytes
from prnav.scene.texture_wrap import CLAMP, REPEAT, AlteredImage, Wrap, wrap_part
from prnav.scene.triangulate import MAX_CORNERS, triangulate

_FREE_FORM = ("curv", "curv2", "surf")


def obj_parts(source: MeshSource, textures: Textures, notes: list[str]) -> list[Part]:
    """Parts of an OBJ file in its own frame; images go into ``textures``, what was left out into ``notes``.

    A part is what one material covers. The colour of a point is vertex colour times Kd times texel. Faces whose corners
    lack texture coordinates show no picture.

    Raises:
        SceneError: a line cannot be read, or names what is not there.
    """
    data = join_continued(plain_bytes(source.data))
    try:
        lines = scan_obj(data)
    except ObjFault as fault:
        _refuse(source.path, data, fault)
    _check_indices(source.path, lines)
    uses, libraries = _statements(data, lines, notes)
    materials = _materials(source, libraries, notes)
    used = _used_materials(uses, len(lines.sizes), materials, bool(libraries), notes)
    if short := int((lines.sizes < 3).sum()):
        notes.append(f"{short} faces of fewer than 3 corners are left out")
    fill = triangulate(lines.positions[lines.corners[:, 0]], lines.sizes)
    check_triangles(source.path, len(fill.corners))
    if fill.crossing:
        notes.append(f"{fill.crossing} polygons cross themselves; what is inside of them is not defined")
    return _parts(source, lines, fill.corners, fill.polygons, used, textures, notes)


class _Use(NamedTuple):
    """A stretch of faces with one material: None for the plain one."""

    first: int
    name: str | None


def _refuse(path: Path, data: bytes, fault: ObjFault) -> NoReturn:
    text = decode_name(data[fault.start : min(fault.end, fault.start + 60)]).strip()
    problem = {
        BAD_NUMBER: "holds what is no number",
        FEW_NUMBERS: "has too few numbers",
        BAD_CORNER: "has a corner that is none of v, v/vt, v//vn and v/vt/vn",
        EARLY_INDEX: "counts back beyond the first vertex",
    }.get(fault.kind, "has the index 0, indices start at 1")
    raise SceneError(f"scene {path}: line {fault.line}, {text!r}, {problem}; repair or export the file again")


def _check_indices(path: Path, lines: ObjLines) -> None:
    for column, count, what in ((0, len(lines.positions), "vertex"), (1, len(lines.uvs), "texture coordinate")):
        beyond = np.flatnonzero(lines.corners[:, column] >= count)
        if len(beyond):
            face = int(np.searchsorted(np.cumsum(lines.sizes), beyond[0], side="right"))
            raise SceneError(
                f"scene {path}: line {lines.face_lines[face]}, a face refers to {what} "
                f"{lines.corners[beyond[0], column] + 1} where there are {count}; repair or export the file again"
            )
    if len(lines.sizes) and lines.sizes.max() > MAX_CORNERS:
        raise SceneError(
            f"scene {path}: line {lines.face_lines[lines.sizes.argmax()]}, a polygon of {lines.sizes.max()} corners; "
            f"at most {MAX_CORNERS} are taken: triangulate it and export again"
        )


def _statements(data: bytes, lines: ObjLines, notes: list[str]) -> tuple[list[_Use], list[str]]:
    """Where materials begin, and what follows each ``mtllib``; free-form surfaces are noted."""
    uses, libraries = [_Use(0, None)], []
    free_form = 0
    for start, end, faces in lines.texts.tolist():
        words = data[start:end].replace(b"\0", b" ").split(None, 1)
        if words[0] == b"usemtl":
            uses.append(_Use(faces, decode_name(words[1]).strip() if len(words) == 2 else ""))
        elif words[0] == b"mtllib" and len(words) == 2:
            libraries.append(decode_name(words[1]).strip())
        elif words[0].decode("latin-1") in _FREE_FORM:
            free_form += 1
    if free_form:
        notes.append(f"{free_form} free-form curves and surfaces are not read")
    return uses, libraries


def _materials(source: MeshSource, statements: Sequence[str], notes: list[str]) -> dict[str, MtlMaterial]:
    """Materials by name; of several with one name the first library's counts, as the format says."""
    materials: dict[str, MtlMaterial] = {}
    keys = [name for rest in statements for way in library_names(rest) for name in way if name in source.side]
    for key in dict.fromkeys(keys):
        found, own_notes = parse_mtl(source.side[key], key)
        notes += own_notes
        for material in found:
            first = materials.setdefault(material.name, material)
            if first is not material and not _alike(first, material):
                notes.append(f"material {material.name!r} is defined twice, the first definition counts")
    return materials


def _alike(a: MtlMaterial, b: MtlMaterial) -> bool:
    def key(m: MtlMaterial) -> tuple[object, ...]:
        colors = [None if value is None else value.tolist() for value in (m.diffuse, m.emission)]
        return (*map(repr, colors), m.diffuse_map, m.emission_map)

    return key(a) == key(b)


def _used_materials(
    uses: Sequence[_Use], faces: int, materials: dict[str, MtlMaterial], libraries: bool, notes: list[str]
) -> list[tuple[int, MtlMaterial | None]]:
    """First face and material of each stretch, None for the plain one."""
    result: list[tuple[int, MtlMaterial | None]] = []
    unknown: list[str] = []
    ends = [use.first for use in uses[1:]] + [faces]
    for use, end in zip(uses, ends, strict=True):
        material = None if not use.name else find_material(materials, use.name)
        if material is None and use.name and end > use.first and use.name not in unknown:
            unknown.append(use.name)
        result.append((use.first, material))
    if unknown:
        more = f" and {len(unknown) - 1} more" if len(unknown) > 1 else ""
        why = "are in none of its material files" if libraries else "are used and no material file is named"
        notes.append(f"materials {unknown[0]!r}{more} {why}, their surfaces are white")
    return result


def _parts(
    source: MeshSource,
    lines: ObjLines,
    triangles: NDArray[np.int64],
    faces: NDArray[np.int64],
    used: Sequence[tuple[int, MtlMaterial | None]],
    textures: Textures,
    notes: list[str],
) -> list[Part]:
    colors = None if lines.colors is None else _vertex_colors(lines.colors)
    distinct: dict[int, tuple[int, MtlMaterial | None]] = {}
    numbers = [distinct.setdefault(id(material), (len(distinct), material))[0] for _, material in used]
    firsts = np.array([first for first, _ in used])
    group = np.array(numbers)[np.searchsorted(firsts, faces, side="right") - 1]
    mapped = (lines.corners[triangles, 1] >= 0).all(axis=1)
    parts = []
    for number, material in distinct.values():
        rows = np.flatnonzero(group == number)
        if not len(rows):
            continue
        texture, wrap = _texture(source, material, textures)
        with_map = mapped[rows] if texture else np.zeros(len(rows), bool)
        if texture and not with_map.all():
            bare = int((~with_map).sum())
            notes.append(f"{bare} triangles have a picture and no texture coordinates, they show their colour alone")
        for textured in (True, False):
            own = rows[with_map == textured]
            if not len(own):
                continue
            factor = np.ones(3) if material is None else material.color(bool(texture))
            corners = lines.corners[triangles[own]]
            part = _part(lines, corners, colors, factor, texture if textured else 0, material)
            parts.append(wrap_part(part, wrap, textures))
    return parts


def _texture(source: MeshSource, material: MtlMaterial | None, textures: Textures) -> tuple[int, Wrap]:
    """Number of a material's picture, 0 where there is none, and how it goes on beyond its border."""
    texture = None if material is None else material.map
    if material is None or texture is None:
        return 0, REPEAT
    key = side_key(material.library, texture.name)
    if key not in source.side:
        return 0, REPEAT
    where, levels = f"scene {source.path}: image {texture.name!r}", (texture.base, texture.gain)
    data = source.side[key]
    image = EncodedImage(data, where) if levels == (0.0, 1.0) else AlteredImage(data, where, levels=levels)
    return textures.add(image), CLAMP if texture.clamp else REPEAT


def _part(
    lines: ObjLines,
    corners: NDArray[np.int64],
    colors: NDArray[np.float64] | None,
    factor: NDArray[np.float64],
    texture: int,
    material: MtlMaterial | None,
) -> Part:
    """Part of the triangles with these corners, (F, 3, 2)."""
    vertex, uv = corners[..., 0].ravel(), corners[..., 1].ravel()
    if not texture:
        rows, places = _distinct(vertex, len(lines.positions))
        faces, coordinates = places.reshape(-1, 3), None
    else:
        keys, places = np.unique(vertex * len(lines.uvs) + uv, return_inverse=True)
        rows, faces = keys // len(lines.uvs), places.reshape(-1, 3)
        picture = material.map if material is not None else None
        coordinates = _coordinates(lines.uvs[keys % len(lines.uvs)], picture)
    tint = factor if colors is None else colors[rows] * factor
    return Part.of(lines.positions[rows], faces, coordinates, tint, texture)


def _coordinates(uvs: NDArray[np.float64], picture: TextureMap | None) -> NDArray[np.float64]:
    """Texture coordinates as the picture's options move them, v down."""
    if picture is not None:
        with np.errstate(all="ignore"):  # what is not finite is refused with the mesh
            uvs = uvs * np.array(picture.scale) + np.array(picture.offset)
    return np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)


def _distinct(values: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The numbers 0..count - 1 that occur, in order, and where each value stands among them."""
    occurs = np.zeros(count, bool)
    occurs[values] = True
    return np.flatnonzero(occurs), (np.cumsum(occurs) - 1)[values]


def _vertex_colors(colors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours 0..1 of numbers that go to 1 or to 255; white where a vertex has none."""
    return np.where(np.isnan(colors), 1.0, colors / color_range(colors))
