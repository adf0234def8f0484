"""A look at a glTF file before anything is allocated for it.

A loader believes what a file says of itself: 4 billion vertices are allocated before the missing bytes are noticed.
Here every length is held against the bytes that are there, and what the loader cannot decode is refused by name.
"""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from PIL import Image, UnidentifiedImageError

from prnav.errors import SceneError
from prnav.files import resolve_inside

MAX_IMAGE_SIDE = 16384
MAX_IMAGE_PIXELS = 16384 * 8192
_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_REMEDIES = {
    "EXT_meshopt_compression": "gltfpack -noq, or any glTF tool that writes uncompressed buffers",
    "KHR_draco_mesh_compression": "gltf-transform copy, or any glTF tool that writes uncompressed buffers",
    "KHR_texture_basisu": "a glTF tool that writes PNG or JPEG textures",
}
_UNDERSTOOD = {
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_ior",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_transmission",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
}


def check_gltf(path: Path) -> list[Path]:
    """Side files (buffers, images) that a .glb or .gltf refers to, after everything in it was found to be sound.

    Raises:
        SceneError: the file is truncated or not glTF 2.0, claims more data than it has, needs an extension that cannot
            be decoded, refers to a file outside its folder, or holds an image beyond 16384 x 8192 texels.
    """
    data = path.read_bytes()
    document, binary = _parse_glb(path, data) if path.suffix.lower() == ".glb" else (_parse_json(path, data), b"")
    version = _table(document, "asset", path).get("version")
    if not isinstance(version, str) or not version.startswith("2"):
        raise SceneError(f"scene {path}: glTF version {version!r}; valid: 2.0")
    _check_extensions(path, document)
    side_files: list[Path] = []
    try:
        buffers = [_buffer(path, i, b, binary, side_files) for i, b in enumerate(document.get("buffers", []))]
        views = [_view(path, i, v, buffers) for i, v in enumerate(document.get("bufferViews", []))]
        for i, accessor in enumerate(document.get("accessors", [])):
            _check_accessor(path, i, accessor, views)
        for i, image in enumerate(document.get("images", [])):
            _check_image(path, i, image, document["bufferViews"], views, buffers, side_files)
    except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
        raise SceneError(
            f"scene {path}: malformed glTF ({type(error).__name__}: {error}); re-export the mesh"
        ) from error
    return side_files


def _parse_glb(path: Path, data: bytes) -> tuple[dict[str, Any], bytes]:
    if len(data) < 20:
        raise SceneError(f"scene {path}: {len(data)} bytes are too few for a GLB; the file is truncated")
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != b"glTF":
        raise SceneError(f"scene {path}: starts with {magic!r}, not b'glTF'; it is not a GLB file")
    if version != 2:
        raise SceneError(f"scene {path}: GLB version {version}; valid: 2")
    if length > len(data):
        raise SceneError(
            f"scene {path}: the header says {length} bytes, the file has {len(data)}: it is truncated; copy it again"
        )
    chunks: dict[bytes, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, offset)
        if offset + 8 + size > length:
            raise SceneError(f"scene {path}: chunk {kind!r} at byte {offset} claims {size} bytes beyond the end")
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size + (-size % 4)
    if b"JSON" not in chunks:
        raise SceneError(f"scene {path}: the GLB has no JSON chunk; re-export the mesh")
    return _parse_json(path, chunks[b"JSON"]), chunks.get(b"BIN\0", b"")


def _parse_json(path: Path, data: bytes) -> dict[str, Any]:
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"scene {path}: its glTF JSON cannot be read ({error}); re-export the mesh") from error
    if not isinstance(document, dict):
        raise SceneError(f"scene {path}: its glTF JSON is a {type(document).__name__}, not an object")
    return document


def _table(document: dict[str, Any], key: str, path: Path) -> dict[str, Any]:
    value = document.get(key)
    if not isinstance(value, dict):
        raise SceneError(f"scene {path}: glTF key {key!r} is missing; it is not a glTF 2.0 file")
    return value


def _check_extensions(path: Path, document: dict[str, Any]) -> None:
    required = document.get("extensionsRequired", [])
    if not isinstance(required, list):
        raise SceneError(f"scene {path}: extensionsRequired is {required!r}; it must be a list")
    for extension in required:
        if extension not in _UNDERSTOOD:
            remedy = _REMEDIES.get(extension, "a glTF tool that writes plain glTF 2.0")
            raise SceneError(
                f"scene {path}: needs the extension {extension}, which is not decoded; convert with {remedy}"
            )


def _side_file(path: Path, uri: str, side_files: list[Path]) -> bytes:
    if uri.startswith("data:"):
        return uri.encode()
    file = resolve_inside(path.parent, unquote(uri), SceneError)
    if not file.is_file():
        raise SceneError(f"scene {path}: refers to {uri!r}, which is not beside it; copy that file too")
    side_files.append(file)
    return file.read_bytes()


def _buffer(path: Path, index: int, buffer: dict[str, Any], binary: bytes, side_files: list[Path]) -> bytes:
    uri, length = buffer.get("uri"), int(buffer["byteLength"])
    if isinstance(uri, str) and uri.startswith("data:"):
        return bytes(length) if length <= len(uri) else _short(path, index, length, len(uri))
    content = _side_file(path, uri, side_files) if uri is not None else binary
    if not 0 <= length <= len(content) + 3:
        return _short(path, index, length, len(content))
    return content


def _short(path: Path, index: int, length: int, there: int) -> bytes:
    raise SceneError(f"scene {path}: buffer {index} claims {length} bytes, {there} are there; the file is truncated")


def _view(path: Path, index: int, view: dict[str, Any], buffers: list[bytes]) -> tuple[int, int, int]:
    start, length = int(view.get("byteOffset", 0)), int(view["byteLength"])
    buffer = int(view["buffer"])
    if start < 0 or length < 0 or start + length > len(buffers[buffer]) + 3:
        raise SceneError(
            f"scene {path}: buffer view {index} covers bytes {start} to {start + length} of a buffer of "
            f"{len(buffers[buffer])}; re-export the mesh"
        )
    return buffer, start, length


def _check_accessor(path: Path, index: int, accessor: dict[str, Any], views: list[tuple[int, int, int]]) -> None:
    count = int(accessor["count"])
    size = _COMPONENT_BYTES[accessor["componentType"]] * _COMPONENTS[accessor["type"]]
    start = int(accessor.get("byteOffset", 0))
    there = views[int(accessor["bufferView"])][2] if "bufferView" in accessor else 1 << 20
    if count < 0 or start < 0 or start + count * size > there:
        raise SceneError(
            f"scene {path}: accessor {index} claims {count} items of {size} bytes, {max(there - start, 0)} are there; "
            "re-export the mesh"
        )


def _check_image(
    path: Path,
    index: int,
    image: dict[str, Any],
    raw_views: list[dict[str, Any]],
    views: list[tuple[int, int, int]],
    buffers: list[bytes],
    side_files: list[Path],
) -> None:
    if "uri" in image:
        content = _side_file(path, image["uri"], side_files)
        if content.startswith(b"data:"):
            return
    else:
        buffer, start, length = views[int(image["bufferView"])]
        content = buffers[buffer][start : start + length]
    check_image(f"scene {path}: image {index}", content)


def check_image(what: str, content: bytes) -> None:
    """Refuse image bytes that are no image or too large, from the header alone.

    Raises:
        SceneError: as said.
    """
    try:
        with Image.open(io.BytesIO(content)) as opened:
            width, height = opened.size
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        raise SceneError(f"{what} cannot be decoded ({error}); valid: PNG, JPEG, WebP, BMP, TGA") from error
    if max(width, height) > MAX_IMAGE_SIDE or width * height > MAX_IMAGE_PIXELS:
        raise SceneError(f"{what} has {width} x {height} texels; valid: up to {MAX_IMAGE_SIDE} x {MAX_IMAGE_SIDE // 2}")
