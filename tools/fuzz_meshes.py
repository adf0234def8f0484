"""Mesh files made by grammars for ``fuzz.py``: lines, headers and JSON that are nearly right, and then damaged.

Most of what a grammar makes can be read, so that the faults lie deep: an index too far, a list too long, a colour that
is no number. A file that is accepted is held against what it may be: triangles within the vertices, finite numbers.
"""

from __future__ import annotations

import base64
import copy
import io
import json
import random
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

KINDS = ("obj", "mtl", "ply", "gltf")
NUMBERS = ("0", "1", "-1", "2", "0.5", "-0.25", "1e3", "1E-3", ".5", "5.", "+1", "255", "3")
ODD = (
    "nan",
    "inf",
    "-inf",
    "1e999",
    "1e-999",
    "9" * 40,
    "0x10",
    "1,5",
    "--1",
    "1.2.3",
    "e5",
    "",
    "a",
    "1_0",
    "\0",
    "½",
)
NAMES = ("m", "n", "my mat", "é", "(null)", "", "m#1", '"m"', "x" * 300, "..", "a.mtl", "\\")
PATHS = (
    "p.png", "P.PNG", "./p.png", "sub\\p.png", "../p.png", "/etc/passwd", "C:\\p.png", "http://x/p.png", '"p.png"',
    "a.obj", "p.png # c", "gone.png", "", ".", "/dev/zero", "a" * 400, "p\0.png", "%2e%2e/p.png", "broken.png",
)  # fmt: skip
OPTIONS = (
    "-s 1 1 1", "-s 2", "-s -1 1", "-o 0.5", "-o 0 0 0", "-t 1 1 1", "-mm 0 1", "-mm 0.2 nan", "-mm 1e9 -1e9", "-bm 1",
    "-clamp on", "-clamp off", "-blendu on", "-texres 16", "-imfchan r", "-type sphere", "-unknown 1", "-s", "-o a",
    "-s 1e30 1e30", "-o 1e30",
)  # fmt: skip


def picture() -> bytes:
    """A PNG of four texels."""
    stream = io.BytesIO()
    Image.fromarray(np.arange(12, dtype=np.uint8).reshape(2, 2, 3) * 20).save(stream, "PNG")
    return stream.getvalue()


def read_mesh(path: Path, data: bytes, kind: str) -> str:
    """Load a made file with what lies beside it; what came of it."""
    beside = {"p.png": picture(), "broken.png": b"\x89PNG no", "a.mtl": b"newmtl m\nKd 1 0 0\nmap_Kd p.png\n"}
    beside["b.mtl"] = b"newmtl n\nmap_Kd -clamp on -s 3 3 p.png\n"
    mesh = path.with_suffix(f".{kind}")
    if kind == "mtl":
        beside["a.mtl"], mesh = data, path.with_suffix(".obj")
        data = OBJ_OF_MTL
    for name, content in {**beside, mesh.name: data}.items():
        (path.parent / name).write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        scene = load_mesh(read_source(mesh))
    assert np.isfinite(scene.vertices).all() and np.isfinite(scene.uvs).all()
    assert scene.faces.min() >= 0 and scene.faces.max() < len(scene.vertices)
    assert all(note and "\n" not in note for note in scene.notes), f"notes {scene.notes!r}"
    return "accepted"


OBJ_OF_MTL = (
    b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0 1 0 0\nvt 0 0\nvt 3 0\nvt 0 -2\nusemtl m\nf 1/1 2/2 3/3\n"
    b"usemtl n\nf 2 4 3\nusemtl my mat\nf 1/1 2/1 4/3\n"
)


def _number(draw: random.Random) -> str:
    return draw.choice(ODD) if draw.random() < 0.01 else draw.choice(NUMBERS)


def _some(draw: random.Random, usual: int, least: int, most: int) -> list[str]:
    count = usual if draw.random() < 0.9 else draw.randint(least, most)
    return [_number(draw) for _ in range(count)]


def make_obj(draw: random.Random) -> bytes:
    """An OBJ of random lines."""
    lines = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 2) for z in (0, 3)] + ["vt 0 0", "vt 1 0", "vt 0 1"]
    vertices, uvs = 8, 3
    if draw.random() < 0.7:
        lines.append(draw.choice(("mtllib a.mtl", "mtllib a.mtl b.mtl", "mtllib gone.mtl", "mtllib", 'mtllib "a.mtl"')))
    for _ in range(draw.randint(1, 30)):
        kind = draw.randrange(12)
        if kind < 2:
            vertices += 1
            lines.append("v " + " ".join(_some(draw, draw.choice((3, 3, 4, 6, 7)), 0, 9)))
        elif kind == 2:
            uvs += 1
            lines.append("vt " + " ".join(_some(draw, draw.choice((1, 2, 3)), 0, 5)))
        elif kind < 9:
            style, corners = draw.choice(("v", "vt", "vn", "vtn", "v/")), draw.choice((3, 3, 4, 5, 8, 1, 40))
            lines.append("f " + " ".join(_corner(draw, style, vertices, uvs) for _ in range(corners)))
        elif kind == 9:
            lines.append(f"usemtl {draw.choice(NAMES)}")
        elif kind == 10:
            lines.append(
                draw.choice(("# comment", "g a", "s off", "o b", "l 1 2", "p 1", "vn 0 0 1", "surf 0 1 0 1 1 2", ""))
            )
        else:
            lines.append(
                draw.choice(("call x", "\\", "f", "v", "vt", "mtllib b.mtl", "\0", "f 1 2 \\", "#\\", "usemtl"))
            )
    return _encode(lines, draw)


def _corner(draw: random.Random, style: str, vertices: int, uvs: int) -> str:
    if draw.random() < 0.01:
        return draw.choice(
            ("0", "/", "1/", "//1", "1/a", "1.5", "9" * 30, "-99", "1/99", "99", "1//", "1/1/1/1", "-", "1/0")
        )
    v = draw.randint(1, vertices) if draw.random() < 0.6 else -draw.randint(1, vertices)
    t = draw.randint(1, uvs) if draw.random() < 0.6 else -draw.randint(1, uvs)
    return {"v": f"{v}", "vt": f"{v}/{t}", "vn": f"{v}//{v}", "vtn": f"{v}/{t}/7", "v/": f"{v}/"}[style]


def make_mtl(draw: random.Random) -> bytes:
    """An MTL of random lines."""
    lines = []
    for name in ("m", "n", "my mat"):
        lines.append(
            f"newmtl {name}" if draw.random() < 0.95 else draw.choice(("newmtl", "newmtl " + draw.choice(NAMES)))
        )
        for _ in range(draw.randint(0, 6)):
            kind = draw.randrange(6)
            if kind < 2:
                lines.append(draw.choice(("Kd ", "Ke ", "Kd\t", "kd ")) + " ".join(_some(draw, 3, 0, 4)))
            elif kind < 5:
                options = " ".join(draw.choice(OPTIONS) for _ in range(draw.choice((0, 0, 1, 2, 5))))
                path = draw.choice(PATHS[:3]) if draw.random() < 0.6 else draw.choice(PATHS)
                lines.append(f"{draw.choice(('map_Kd', 'map_kd', 'map_Ke', 'map_Kd'))} {options} {path}")
            else:
                lines.append(
                    draw.choice(("Ns 10", "illum 2", "d 0.5", "map_Bump x.png", "Tr 1", "# c", "Kd", "map_Kd", "\\"))
                )
    return _encode(lines, draw)


def _encode(lines: list[str], draw: random.Random) -> bytes:
    text = draw.choice(("\n", "\n", "\r\n", "\r")).join(lines) + draw.choice(("\n", ""))
    encoding = draw.choice(("utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1", "utf-16-le"))
    return text.encode(encoding, errors="replace")


TYPES = ("uchar", "char", "short", "ushort", "int", "uint", "float", "double", "int64", "float16")
CODES = {"uchar": "B", "char": "b", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
         "int64": "q", "float16": "e"}  # fmt: skip


def make_ply(draw: random.Random) -> bytes:
    """A PLY of a random header and a body that mostly keeps its promise."""
    form = draw.choice(("ascii", "binary_little_endian", "binary_big_endian"))
    header = ["ply", f"format {form} 1.0"]
    header += draw.choices(
        ("comment x", "obj_info y", "comment TextureFile p.png", "comment TextureFile gone.png"), k=draw.randint(0, 3)
    )
    elements = [
        ("vertex", draw.randint(3, 12), [(draw.choice(("float", "double", "int", "uchar")), axis) for axis in "xyz"])
    ]
    extra = ("s", "t", "red", "green", "blue", "alpha", "quality", "texture_u", "r", "texnumber", "x")
    elements[0][2].extend((draw.choice(TYPES), name) for name in draw.sample(extra, draw.randint(0, 5)))
    face = [(f"list {draw.choice(('uchar', 'int', 'ushort', 'char'))} {draw.choice(('int', 'uint', 'uchar', 'float'))}",
             draw.choice(("vertex_indices", "vertex_index")))]  # fmt: skip
    more = (
        ("list uchar float", "texcoord"),
        ("int", "texnumber"),
        ("uchar", "red"),
        ("uchar", "green"),
        ("float", "blue"),
    )
    face += draw.sample(more, draw.randint(0, 5))
    elements.append((draw.choice(("face", "face", "face", "tristrips")), draw.randint(0, 8), face))
    if draw.random() < 0.3:
        elements.insert(
            draw.randint(0, 2), ("thing", draw.randint(0, 3), [("list uchar double", "values"), ("short", "k")])
        )
    for name, count, properties in elements:
        promised = count if draw.random() < 0.97 else draw.choice((0, count + 1, 10**9, 10**17))
        header.append(f"element {name} {promised}")
        header += [f"property {kind} {key}" for kind, key in properties]
    if draw.random() < 0.05:
        header.insert(
            draw.randrange(len(header)), draw.choice(("nonsense", "property int", "element", "format x 1.0", "ply"))
        )
    ends = draw.choice(("\n", "\n", "\r\n", "\r"))
    text = ends.join([*header, "end_header", ""]).encode()
    order = ">" if "big" in form else "<"
    vertices = next(count for name, count, _ in elements if name == "vertex")
    body: list[bytes] = []
    for name, count, properties in elements:
        for _ in range(count):
            values = [value for kind, key in properties for value in _ply_values(kind, key, vertices, name, draw)]
            if form == "ascii":
                body.append((" ".join(f"{value:g}" for _, value in values) + ends).encode())
            else:
                body += [struct.pack(order + CODES[kind], _fit(kind, value)) for kind, value in values]
    return text + b"".join(body)


def _ply_values(kind: str, key: str, vertices: int, element: str, draw: random.Random) -> list[tuple[str, float]]:
    words = kind.split()
    if words[0] != "list":
        return [(kind, draw.choice((0, 1, 2, 0.5, 255, -1, 7)))]
    size = draw.choice((3, 3, 4, 5, 0, 2, 9)) if "vertex" in key else draw.choice((0, 6, 8, 3))
    low = -1 if element == "tristrips" else 0
    values = [
        draw.randint(low, vertices - 1) if draw.random() < 0.995 else draw.choice((-5, 99, 1e9)) for _ in range(size)
    ]
    return [(words[1], size), *((words[2], value) for value in values)]


def _fit(kind: str, value: float) -> float:
    if CODES[kind] in "fde":
        return value if abs(value) < 1e4 else 1e4
    low, high = (np.iinfo(np.dtype(CODES[kind])).min, np.iinfo(np.dtype(CODES[kind])).max)
    return int(min(max(value, low), high))


def gltf_seed() -> dict[str, Any]:
    """A glTF with most of what is read: a tree, a sampler, transforms, colours, sparse numbers, materials."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32).tobytes()
    uvs = np.array([[0, 2], [2, 2], [2, 0], [-1, 0]], np.float32).tobytes()
    faces, colors = np.array([0, 1, 2, 0, 2, 3], np.uint16).tobytes(), bytes(range(16))
    data = points + uvs + faces + colors
    sizes = [len(points), len(uvs), len(faces), len(colors)]
    views = [{"buffer": 0, "byteOffset": sum(sizes[:k]), "byteLength": size} for k, size in enumerate(sizes)]
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    image = "data:image/png;base64," + base64.b64encode(picture()).decode()
    accessors: list[dict[str, Any]] = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
        {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        {"bufferView": 3, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": True},
    ]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 3}
    transform = {"KHR_texture_transform": {"scale": [2, 1], "offset": [0, 0.5], "rotation": 0.3}}
    base = {"baseColorTexture": {"index": 0, "extensions": transform}, "baseColorFactor": [1, 0.5, 1, 1]}
    primitives = [
        {"attributes": attributes, "indices": 2, "material": 0},
        {"attributes": attributes, "mode": 5, "material": 1},
    ]
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "scale": [1, 2, 1]}, {"mesh": 0, "rotation": [0, 0, 0, 1], "translation": [1, 0, 0],
                  "extensions": {"KHR_node_visibility": {"visible": True}}}],
        "meshes": [{"primitives": primitives, "weights": [0]}],
        "materials": [{"pbrMetallicRoughness": base}, {"emissiveFactor": [1, 1, 0], "emissiveTexture": {"index": 1}}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 1}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648}, {"wrapS": 33648}],
        "images": [{"uri": image}, {"uri": "p.png"}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data), "uri": uri}],
        "extensionsUsed": ["KHR_texture_transform", "X"],
    }  # fmt: skip


def make_gltf(draw: random.Random, distort: Callable[[Any, random.Random], Any]) -> bytes:
    """A glTF whose JSON has some values replaced."""
    document: Any = copy.deepcopy(gltf_seed())
    for _ in range(draw.choice((0, 1, 1, 2, 3))):
        document = distort(document, draw)
    text = json.dumps(document)
    return text.encode("utf-8", "surrogatepass")
