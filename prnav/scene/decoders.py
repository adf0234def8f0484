"""Compressed meshes and textures, decoded by libraries that are installed only where they are needed.

``pip install "prnav[data]"`` brings all of them. What a file claims is held against its size before a library is asked
to allocate it, and whatever a library raises becomes a ``ValueError`` of one line.
"""

from __future__ import annotations

import importlib
import importlib.util

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array, Untyped

LIBRARIES = {
    "KHR_draco_mesh_compression": "DracoPy",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
    "KHR_texture_basisu": "opengl_basisu",
    "GOOGLE_texture_basis": "opengl_basisu",
}
"""Python module that decodes a glTF extension."""

INSTALL = 'pip install "prnav[data]"'

MESHOPT_EXTENSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
BASIS_EXTENSIONS = ("KHR_texture_basisu", "GOOGLE_texture_basis")

_MAX_MESHOPT_RATIO = 4096
"""The codec spends at least 2 bits on 256 values, so that no more than this many bytes come out of one."""
_KTX2 = b"\xabKTX 20\xbb\r\n\x1a\n"
_BASIS = b"sB"


def available(extension: str) -> bool:
    """Whether the library for an extension is installed."""
    return extension in LIBRARIES and importlib.util.find_spec(LIBRARIES[extension]) is not None


def is_basis(data: bytes | memoryview) -> bool:
    """Whether image bytes are a KTX 2 or ``.basis`` file."""
    start = bytes(data[:12])
    return start == _KTX2 or start[:2] == _BASIS


def decode_meshopt(data: bytes | memoryview, count: int, stride: int, mode: str, filter_name: str) -> bytes:
    """Bytes (count * stride) of a bufferView of EXT_meshopt_compression.

    Raises:
        ValueError: the data is damaged, or promises more than its size can hold.
    """
    if count * stride > _MAX_MESHOPT_RATIO * max(len(data), 1):
        raise ValueError(f"{len(data)} bytes cannot hold {count} elements of {stride} bytes")
    module = importlib.import_module("meshopt")
    try:
        decoded = module.decode_gltf_buffer(
            bytes(data), count, stride, mode, None if filter_name == "NONE" else filter_name
        )
    except Exception as error:  # whatever a library raises for damaged data
        raise ValueError(_line(error)) from error
    result = np.ascontiguousarray(decoded).tobytes()
    if len(result) != count * stride:
        raise ValueError(f"it decodes to {len(result)} bytes, not {count * stride}")
    return result


def decode_draco(data: bytes | memoryview) -> tuple[NDArray[np.int64], dict[int, Array]]:
    """Triangles (F, 3) and attributes (V, n) by their unique ids, of a Draco mesh.

    Raises:
        ValueError: the data is damaged.
    """
    module = importlib.import_module("DracoPy")
    try:
        mesh = module.decode(bytes(data))
        faces = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), np.int64).reshape(-1, 3)
        attributes = {int(entry["unique_id"]): np.asarray(entry["data"]) for entry in mesh.attributes}
    except Exception as error:  # whatever a library raises for damaged data
        raise ValueError(_line(error)) from error
    return faces, attributes


def basis_size(data: bytes | memoryview) -> tuple[int, int]:
    """Width and height of a KTX 2 or ``.basis`` image.

    Raises:
        ValueError: it is damaged, or of a kind without 8-bit colours.
    """
    texture = _open_basis(data)
    return int(texture.width), int(texture.height)


def decode_basis(data: bytes | memoryview) -> NDArray[np.uint8]:
    """RGBA texels (H, W, 4) of a KTX 2 or ``.basis`` image, top row first.

    Raises:
        ValueError: it is damaged, or of a kind without 8-bit colours.
    """
    texture = _open_basis(data)
    try:
        texels = np.asarray(texture.transcode("rgba8", level=0).data, np.uint8)
    except Exception as error:  # whatever a library raises for damaged data
        raise ValueError(_line(error)) from error
    return texels[::-1] if texture.y_flipped else texels


def _open_basis(data: bytes | memoryview) -> Untyped:
    module = importlib.import_module("opengl_basisu")
    try:
        return module.open(bytes(data))
    except Exception as error:  # whatever a library raises for damaged data
        raise ValueError(_line(error)) from error


def _line(error: Exception) -> str:
    return (str(error).strip().split("\n")[0] or type(error).__name__)[:200]
