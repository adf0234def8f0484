"""Small glTF files made by hand, so that any number in them can be wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from data_trees import QUAD, QUAD_FACES, QUAD_UVS


class Glb:
    """A GLB under construction: JSON that tests may spoil, and one buffer."""

    def __init__(self):
        self.buffer = b""
        self.document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "buffers": [{"byteLength": 0}],
        }

    def view(self, data: bytes, **extra) -> int:
        views = self.document["bufferViews"]
        views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data), **extra})
        self.buffer += data + b"\0" * (-len(data) % 4)
        self.document["buffers"][0]["byteLength"] = len(self.buffer)
        return len(views) - 1

    def accessor(self, array, **extra) -> int:
        array = np.asarray(array)
        code = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125, "i1": 5120, "i2": 5122}[array.dtype.str[1:]]
        kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
        entry = {"bufferView": self.view(array.tobytes()), "componentType": code, "count": len(array), "type": kind}
        self.document["accessors"].append({**entry, **extra})
        return len(self.document["accessors"]) - 1

    def mesh(self, *primitives) -> int:
        self.document["meshes"].append({"primitives": list(primitives)})
        return len(self.document["meshes"]) - 1

    def node(self, **node) -> int:
        self.document["nodes"].append(node)
        self.document["scenes"][0]["nodes"].append(len(self.document["nodes"]) - 1)
        return len(self.document["nodes"]) - 1

    def add(self, kind: str, entry) -> int:
        self.document.setdefault(kind, []).append(entry)
        return len(self.document[kind]) - 1

    def bytes(self) -> bytes:
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        body = len(text).to_bytes(4, "little") + b"JSON" + text
        body += len(self.buffer).to_bytes(4, "little") + b"BIN\0" + self.buffer
        return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body

    def write(self, path: Path) -> Path:
        path.write_bytes(self.bytes())
        return path


@pytest.fixture
def quad() -> Glb:
    """A unit square that faces +z, without material."""
    glb = Glb()
    attributes = {"POSITION": glb.accessor(QUAD), "TEXCOORD_0": glb.accessor(QUAD_UVS)}
    glb.mesh({"attributes": attributes, "indices": glb.accessor(QUAD_FACES)})
    glb.node(mesh=0)
    return glb
