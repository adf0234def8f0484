"""Scenes written as binary glTF 2.0, so that other programs can open them."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from prnav.aliases import Array, JSONObject, Untyped
from prnav.files import write_bytes
from prnav.scene.mesh import SceneMesh

_FLOAT, _UINT, _UBYTE = 5126, 5125, 5121
_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963
_REPEAT, _LINEAR, _MIPMAP = 10497, 9729, 9987


class _Buffer:
    """The binary chunk and the views and accessors into it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[JSONObject] = []
        self.accessors: list[JSONObject] = []

    def view(self, data: bytes, target: int | None = None) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(view | ({"target": target} if target else {}))
        self.data += data
        return len(self.views) - 1

    def accessor(self, array: Array, component: int, kind: str, **more: Untyped) -> int:
        target = _ELEMENT_BUFFER if kind == "SCALAR" else _ARRAY_BUFFER
        little = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<"), copy=False)
        view = self.view(little.tobytes(), target)
        self.accessors.append(
            {"bufferView": view, "componentType": component, "count": len(array), "type": kind, **more}
        )
        return len(self.accessors) - 1


def save_glb(scene: SceneMesh, path: str | Path) -> None:
    """Write a scene as ``.glb``: y up, metres, one primitive per texture, unlit, with vertex colours as COLOR_0.

    :func:`prnav.load_scene` reads the same triangles, texels and colours back.
    """
    buffer = _Buffer()
    used = np.unique(scene.face_texture)
    images = [index for index in used.tolist() if index > 0]
    primitives, materials = [], []
    for texture in used.tolist():
        faces = scene.faces[scene.face_texture == texture]
        rows, local = np.unique(faces, return_inverse=True)
        positions = scene.vertices[rows]
        colors = np.concatenate([scene.colors[rows], np.full((len(rows), 1), 255, dtype=np.uint8)], axis=1)
        attributes = {
            "POSITION": buffer.accessor(
                positions, _FLOAT, "VEC3", min=positions.min(axis=0).tolist(), max=positions.max(axis=0).tolist()
            ),
            "COLOR_0": buffer.accessor(colors, _UBYTE, "VEC4", normalized=True),
        }
        indices = buffer.accessor(local.reshape(-1).astype(np.uint32), _UINT, "SCALAR")
        surface: JSONObject = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
        if texture > 0:
            attributes["TEXCOORD_0"] = buffer.accessor(scene.uvs[rows], _FLOAT, "VEC2")
            surface["baseColorTexture"] = {"index": images.index(texture)}
        materials.append({"pbrMetallicRoughness": surface, "extensions": {"KHR_materials_unlit": {}}})
        primitives.append({"attributes": attributes, "indices": indices, "material": len(materials) - 1})
    document: JSONObject = {
        "asset": {"version": "2.0", "generator": "prnav"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": scene.name}],
        "meshes": [{"primitives": primitives}],
        "materials": materials,
    }
    if images:
        document["images"] = [
            {"bufferView": buffer.view(_png(scene.atlas.image(index))), "mimeType": "image/png"} for index in images
        ]
        document["samplers"] = [{"magFilter": _LINEAR, "minFilter": _MIPMAP, "wrapS": _REPEAT, "wrapT": _REPEAT}]
        document["textures"] = [{"source": k, "sampler": 0} for k in range(len(images))]
    document["accessors"], document["bufferViews"] = buffer.accessors, buffer.views
    document["buffers"] = [{"byteLength": len(buffer.data)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = bytes(buffer.data) + b"\0" * (-len(buffer.data) % 4)
    length = 12 + 8 + len(text) + 8 + len(binary)
    header = struct.pack("<4sII", b"glTF", 2, length)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    write_bytes(path, header + chunks)


def _png(image: NDArray[np.uint8]) -> bytes:
    stream = io.BytesIO()
    opaque = bool((image[..., 3] == 255).all())
    Image.fromarray(np.ascontiguousarray(image[..., :3] if opaque else image)).save(stream, format="PNG")
    return stream.getvalue()
