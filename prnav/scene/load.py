"""Mesh files to :class:`SceneMesh`: GLB, glTF, OBJ and PLY with textures, vertex colours or material colours.

trimesh parses the files; here its parts become one set of arrays in the world frame.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from prnav.errors import SceneError
from prnav.files import resolve_inside
from prnav.frames import to_y_up
from prnav.scene.atlas import TextureAtlas
from prnav.scene.gltf_check import check_gltf, check_image
from prnav.scene.mesh import SceneMesh

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
LOADER_VERSION = 1
"""Raised when the same file would give other arrays."""


def load_mesh_file(path: Path, up: str = "y", max_texture_size: int = 1024) -> SceneMesh:
    """Load a mesh file; see :func:`prnav.load_scene`, which also caches.

    Every triangle of every instance counts; lines and points do not. Textures of one file are stored once, however many
    parts use them, and are reduced to ``max_texture_size`` texels a side by averaging.

    Raises:
        SceneError: the file is missing, broken, of an unknown kind, or has no triangles.
    """
    side_files(path)
    try:
        with np.errstate(all="ignore"):
            loaded = trimesh.load_scene(path, process=False, maintain_order=True, skip_materials=False)
            parts = list(_instances(loaded))
    except SceneError:
        raise
    except Exception as error:  # a parser's own exceptions are as many as its file formats
        raise SceneError(f"scene {path}: cannot be parsed ({type(error).__name__}: {error}); re-export it") from error
    return _assemble(path, parts, up, max_texture_size)


def content_key(path: Path) -> str:
    """SHA-256 of a mesh file and of the files it refers to.

    Raises:
        SceneError: as :func:`side_files`.
    """
    digest = hashlib.sha256()
    for file in [path, *side_files(path)]:
        digest.update(file.name.encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def side_files(path: Path) -> list[Path]:
    """Files that a mesh file refers to, after a first check of the file itself.

    Raises:
        SceneError: the file is missing, empty, of an unknown kind or, for glTF, unsound.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise SceneError(f"scene {path}: files of kind {path.suffix!r} are not read; valid: {', '.join(SUFFIXES)}")
    if not path.is_file():
        raise SceneError(f"scene {path}: no such file; give the path of a mesh ({', '.join(SUFFIXES)})")
    if path.stat().st_size == 0:
        raise SceneError(f"scene {path}: the file is empty; copy it again")
    if path.suffix.lower() in (".glb", ".gltf"):
        return check_gltf(path)
    return _obj_side_files(path) if path.suffix.lower() == ".obj" else []


def _obj_side_files(path: Path) -> list[Path]:
    """Material libraries of an OBJ and the textures they name."""
    files = []
    for name in _values_after(path, b"mtllib"):
        library = resolve_inside(path.parent, name, SceneError)
        if not library.is_file():
            continue  # an OBJ without its materials is a plain mesh
        files.append(library)
        for keyword in (b"map_Kd", b"map_Ka", b"map_Ks", b"map_d", b"map_Bump", b"bump"):
            for texture in _values_after(library, keyword):
                file = resolve_inside(path.parent, texture.replace("\\", "/"), SceneError)
                if keyword == b"map_Kd" and not file.is_file():
                    raise SceneError(f"scene {path}: {library.name} names the texture {texture!r}, which is not there")
                if file.is_file():
                    check_image(f"scene {path}: texture {texture}", file.read_bytes())
                    files.append(file)
    return files


def _values_after(path: Path, keyword: bytes) -> Iterator[str]:
    prefix = keyword + b" "
    with open(path, "rb") as file:
        for line in file:
            stripped = line.strip()
            if stripped.startswith(prefix):
                yield stripped[len(prefix) :].strip().decode("utf-8", "replace")


def _instances(loaded: trimesh.Scene) -> Iterator[tuple[trimesh.Trimesh, NDArray[np.float64]]]:
    """Every mesh of a trimesh scene with its transform to the file's world."""
    for node in sorted(loaded.graph.nodes_geometry):
        transform, name = loaded.graph[node]
        geometry = loaded.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            yield geometry, np.asarray(transform, np.float64)


def _assemble(path: Path, parts: list[Any], up: str, max_texture_size: int) -> SceneMesh:
    if not parts:
        raise SceneError(f"scene {path}: it has no triangles; give a mesh with faces")
    vertices, uvs, colors, faces, textures = [], [], [], [], []
    images: list[NDArray[np.uint8]] = []
    rows: dict[bytes, int] = {}
    seen: dict[int, tuple[Any, int]] = {}
    offset = 0
    for geometry, transform in parts:
        points = np.asarray(geometry.vertices, np.float64)
        triangles = np.asarray(geometry.faces, np.int64)
        if triangles.min() < 0 or triangles.max() >= len(points):
            raise SceneError(
                f"scene {path}: a face refers to a vertex outside 0..{len(points) - 1}; re-export the mesh"
            )
        with np.errstate(all="ignore"):
            points = points @ transform[:3, :3].T + transform[:3, 3]
            mirrored = np.linalg.det(transform[:3, :3]) < 0
        part_uvs, part_colors, image, triangles, points = _appearance(geometry, triangles, points)
        row = 0
        if image is not None:
            if id(image) not in seen:
                pixels = _pixels(image, max_texture_size)
                digest = hashlib.sha256(repr(pixels.shape).encode() + pixels.tobytes()).digest()
                if digest not in rows:
                    images.append(pixels)
                    rows[digest] = len(images)
                seen[id(image)] = (image, rows[digest])
            row = seen[id(image)][1]
        vertices.append(points)
        uvs.append(part_uvs)
        colors.append(part_colors)
        faces.append((triangles[:, ::-1] if mirrored else triangles) + offset)
        textures.append(np.full(len(triangles), row, np.int32))
        offset += len(points)
    with np.errstate(over="ignore", invalid="ignore"):
        world = to_y_up(np.concatenate(vertices), up).astype(np.float32)
    return SceneMesh(
        name=str(path),
        vertices=world,
        uvs=np.concatenate(uvs).astype(np.float32),
        colors=np.concatenate(colors),
        faces=np.concatenate(faces).astype(np.int32),
        face_texture=np.concatenate(textures),
        atlas=TextureAtlas.from_images(images),
    )


def _appearance(
    geometry: trimesh.Trimesh, faces: NDArray[np.int64], points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.uint8], Any, NDArray[np.int64], NDArray[np.float64]]:
    """Texture coordinates (V, 2), colours (V, 3), image or None, faces and points (split where faces have colours)."""
    visual = geometry.visual
    count = len(points)
    uvs = np.zeros((count, 2))
    colors = np.full((count, 3), 255, np.uint8)
    if visual.kind == "texture":
        material = visual.material
        image = getattr(material, "baseColorTexture", None)
        factor = getattr(material, "baseColorFactor", None)
        if image is None:
            image = getattr(material, "image", None)
        if factor is None and image is None:
            factor = getattr(material, "diffuse", None)
        uv = None if visual.uv is None else np.asarray(visual.uv, np.float64)
        if image is not None and uv is not None and uv.shape == (count, 2):
            uvs = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)
        else:
            image = None
        stored = visual.vertex_attributes.get("color")
        if stored is not None and len(stored) == count:
            colors = _bytes(stored)
        return uvs, _times(colors, factor), image, faces, points
    if visual.kind == "vertex":
        return uvs, _bytes(visual.vertex_colors), None, faces, points
    if visual.kind == "face":
        corner = faces.ravel()
        split_colors = np.repeat(_bytes(visual.face_colors), 3, axis=0)
        split_faces = np.arange(len(corner)).reshape(-1, 3)
        return np.zeros((len(corner), 2)), split_colors, None, split_faces, points[corner]
    return uvs, colors, None, faces, points


def _bytes(colors: Any) -> NDArray[np.uint8]:
    """Colours (V, 3 or more) as 8-bit RGB; floats are 0..1, 16-bit integers are scaled."""
    array = np.asarray(colors)[:, :3]
    if array.dtype == np.uint8:
        return np.ascontiguousarray(array)
    if array.dtype.kind == "f":
        return (np.clip(np.nan_to_num(array), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return (array // (np.iinfo(array.dtype).max // 255)).astype(np.uint8)


def _times(colors: NDArray[np.uint8], factor: Any) -> NDArray[np.uint8]:
    """Vertex colours times a material's base colour (as trimesh has it: 8-bit, or floats 0..1)."""
    if factor is None:
        return colors
    material = np.asarray(factor)
    scale = material[:3].astype(np.float64) / (1.0 if material.dtype.kind == "f" else 255.0)
    return (np.clip(colors * scale, 0.0, 255.0) + 0.5).astype(np.uint8)


def _pixels(image: Image.Image, max_size: int) -> NDArray[np.uint8]:
    """RGBA pixels of an image, its sides at most ``max_size``."""
    rgba = image.convert("RGBA")
    if max(rgba.size) > max_size:
        scale = max_size / max(rgba.size)
        rgba = rgba.resize(
            (max(1, round(rgba.width * scale)), max(1, round(rgba.height * scale))), Image.Resampling.BOX
        )
    return np.asarray(rgba, np.uint8)
