"""OBJ and PLY files as parts, parsed by trimesh from bytes in memory.

In trimesh v points up from the texture's bottom row; here, as in glTF, it points down.
"""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.scene.images import EncodedImage
from prnav.scene.parts import Part, Textures, check_triangles
from prnav.scene.source import MeshSource

_PLY_BYTES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2, "float16": 2,
    "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4,
    "int64": 8, "uint64": 8, "double": 8, "float64": 8,
}  # fmt: skip


def polygon_parts(source: MeshSource, textures: Textures) -> list[Part]:
    """Parts of an OBJ or PLY file in its own frame; images go into ``textures``.

    A missing material or image file is a warning, as these files are often passed on without: its surfaces are plain.

    Raises:
        SceneError: the file is broken.
    """
    import trimesh

    if source.suffix == ".ply":
        _check_ply(source)
    resolver = _SideFiles(source)
    images = {
        name: EncodedImage(source.side[name], f"scene {source.path}: image {name!r}")
        for name in source.images
        if name in source.side
    }
    for image in images.values():
        _ = image.size  # what is no image is refused, used or not
    parts: list[Part] = []
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = trimesh.load_scene(
                io.BytesIO(source.data),
                file_type=source.suffix[1:],
                resolver=resolver,  # type: ignore[arg-type]
                process=False,
            )
            meshes = [(mesh, loaded.geometry[mesh]) for mesh in loaded.geometry]
            for _, mesh in sorted(meshes, key=lambda item: item[0]):
                if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                    parts.append(_part(source, mesh, images, textures))
    except SceneError:
        raise
    except Exception as error:  # whatever a parser trips over in a broken file
        reason = str(error).strip().split("\n")[0] or type(error).__name__
        kind = source.suffix[1:].upper()
        raise SceneError(
            f"scene {source.path}: not a {kind} that can be read ({reason:.300}); triangulate and export it again"
        ) from error
    for name in resolver.missing:
        warnings.warn(f"scene {source.path}: {name!r} is missing, what it colours stays plain", stacklevel=2)
    return parts


class _SideFiles:
    """What trimesh asks for by name, out of memory."""

    def __init__(self, source: MeshSource) -> None:
        self._source = source
        self.missing: list[str] = []

    def get(self, name: str) -> bytes:
        if name.strip() not in self._source.side:
            if name.strip() not in self.missing:
                self.missing.append(name.strip())
            raise FileNotFoundError(name)
        return self._source.side[name.strip()]

    __getitem__ = get

    def namespaced(self, namespace: str) -> _SideFiles:
        return self

    def keys(self) -> list[str]:
        return list(self._source.side)


def _part(source: MeshSource, mesh: Any, images: dict[str, EncodedImage], textures: Textures) -> Part:
    check_triangles(source.path, len(mesh.faces))
    vertices = np.asarray(mesh.vertices, np.float64)
    faces = np.asarray(mesh.faces, np.int64)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise SceneError(f"scene {source.path}: its vertices are {vertices.shape}, not x, y and z; export it again")
    if faces.min() < 0 or faces.max() >= len(vertices):
        found = faces.min() if faces.min() < 0 else faces.max()
        raise SceneError(
            f"scene {source.path}: a face refers to vertex {found}, valid are 0..{len(vertices) - 1}; export it again"
        )
    visual = mesh.visual
    if visual.kind == "face":
        colors = np.repeat(np.asarray(visual.face_colors)[:, :3] / 255.0, 3, axis=0)
        return Part.of(vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), None, colors, 0)
    if visual.kind == "vertex":
        return Part.of(vertices, faces, None, np.asarray(visual.vertex_colors)[:, :3] / 255.0, 0)
    material = getattr(visual, "material", None)
    if visual.kind != "texture" or material is None:
        return Part.of(vertices, faces, None, np.ones(3), 0)
    image = getattr(material, "image", None)
    # the name as an MTL gives it; a PLY has at most one image
    name = str(image.info.get("file_path", "")) if image is not None else ""
    if source.suffix == ".ply" and source.images:
        name = source.images[-1]
    color = _diffuse(source.path, material)
    uvs = None if visual.uv is None else np.asarray(visual.uv, np.float64)
    if name not in images or uvs is None or uvs.ndim != 2 or len(uvs) != len(vertices) or uvs.shape[1] < 2:
        return Part.of(vertices, faces, None, color, 0)
    if not color.any():
        color = np.ones(3)  # exporters write a black Kd where the image says it all
    return Part.of(vertices, faces, np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1), color, textures.add(images[name]))


def _diffuse(path: Path, material: Any) -> NDArray[np.float64]:
    """Kd of an MTL, 0..1 (3,); white where there is none."""
    value = getattr(material, "kwargs", {}).get("kd")
    if value is None:
        return np.ones(3)
    color = np.atleast_1d(np.asarray(value, np.float64))
    if color.shape not in ((1,), (3,)) or not np.isfinite(color).all():
        raise SceneError(f"scene {path}: Kd of a material is {value!r}; it must be three numbers 0..1")
    return np.broadcast_to(color, (3,))


def _check_ply(source: MeshSource) -> None:
    """Hold what a PLY header promises against the size of the file, before anything is allocated."""
    path, data = source.path, source.data
    end = re.search(rb"\nend_header\r?\n", data)
    if not re.match(rb"ply\r?\n", data) or end is None:
        raise SceneError(f"scene {path}: no PLY header (it starts with {data[:8]!r}); copy or export the file again")
    header = data[: end.start()].decode("utf-8", errors="replace").splitlines()
    ascii_lines = any(line.startswith("format ascii") for line in header)
    promised = 0
    elements: list[list[int]] = []  # count and least bytes of each
    for line in header:
        words = line.split()
        if words[:1] == ["element"]:
            if len(words) != 3 or not words[2].isdigit() or len(words[2]) > 18:
                raise SceneError(
                    f"scene {path}: PLY header line {line!r:.80} is not element NAME COUNT; export it again"
                )
            elements.append([int(words[2]), 0])
        elif words[:1] == ["property"] and elements:
            kind = words[2] if words[1:2] == ["list"] and len(words) == 5 else words[1] if len(words) == 3 else ""
            if kind not in _PLY_BYTES:
                raise SceneError(f"scene {path}: PLY header line {line!r:.80} cannot be read; export it again")
            elements[-1][1] += _PLY_BYTES[kind]
    body = data[end.end() :]
    if ascii_lines:
        promised, found, unit = sum(count for count, _ in elements), len(body.splitlines()), "lines"
    else:
        promised, found, unit = sum(count * size for count, size in elements), len(body), "bytes"
    if promised > found:
        raise SceneError(
            f"scene {path}: its PLY header promises at least {promised} {unit}, it has {found}: cut off; copy it again"
        )
