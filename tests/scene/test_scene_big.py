"""A million triangles in a thousand parts, from a file and from the cache, and the memory that takes."""

import io
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

MEASURE = """
import resource, sys
import trimesh  # what both sides of the comparison have imported
from prnav.scene import load_scene
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
scene = load_scene(sys.argv[1])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
size = sum(array.nbytes for array in scene.to_arrays().values())
print(len(scene.faces), scene.atlas.num_textures - 1, peak * 1024 / size, scene.hash)
"""


def write_big(path, parts, squares, textures, side):
    """A GLB of ``parts`` wavy floors of 2 * squares^2 triangles each, with noisy pictures on them."""
    generator = np.random.default_rng(0)
    buffer, views, accessors = bytearray(), [], []

    def view(data):
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
        buffer.extend(data + b"\0" * (-len(data) % 4))
        return len(views) - 1

    def accessor(array, kind, component):
        entry = {"bufferView": view(array.tobytes()), "componentType": component, "count": len(array), "type": kind}
        accessors.append(entry)
        return len(accessors) - 1

    line = np.linspace(0, 1, squares + 1)
    plane = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2).astype(np.float32)
    corner = (np.arange(squares)[:, None] * (squares + 1) + np.arange(squares)).ravel()
    steps = np.array([0, 1, squares + 2, 0, squares + 2, squares + 1])
    faces = (corner[:, None] + steps).astype(np.uint32).ravel()
    images = []
    for _ in range(textures):
        coarse = generator.integers(0, 256, (side // 8, side // 8, 3), dtype=np.uint8)
        stream = io.BytesIO()
        Image.fromarray(coarse).resize((side, side)).save(stream, "JPEG")
        images.append({"bufferView": view(stream.getvalue()), "mimeType": "image/jpeg"})
    meshes = []
    for part in range(parts):
        points = np.zeros((len(plane), 3), np.float32)
        points[:, [0, 2]] = 2 * plane + [part % 32 * 2, part // 32 * 2]
        points[:, 1] = generator.normal(0, 0.02, len(plane))
        attributes = {"POSITION": accessor(points, "VEC3", 5126), "TEXCOORD_0": accessor(plane, "VEC2", 5126)}
        indices = accessor(faces, "SCALAR", 5125)
        meshes.append({"primitives": [{"attributes": attributes, "indices": indices, "material": part % textures}]})
    surfaces = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}} for k in range(textures)]
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": k} for k in range(parts)],
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "images": images,
        "textures": [{"source": k} for k in range(textures)],
        "materials": surfaces,
        "buffers": [{"byteLength": len(buffer)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = len(text).to_bytes(4, "little") + b"JSON" + text + len(buffer).to_bytes(4, "little") + b"BIN\0" + buffer
    path.write_bytes(b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(("textures", "side"), [(1, 64), (60, 1024)], ids=["geometry", "textures"])
def test_memory_is_at_most_four_times_the_scene(tmp_path, textures, side):
    path = write_big(tmp_path / "big.glb", 1000, 23, textures, side)
    environment = {**os.environ, "PRNAV_CACHE": str(tmp_path / "cache")}
    answers = []
    for _ in range(2):  # from the file, then from the cache
        answer = subprocess.run(
            [sys.executable, "-c", MEASURE, str(path)], env=environment, capture_output=True, text=True, check=True
        ).stdout.split()
        assert (int(answer[0]), int(answer[1])) == (1_058_000, textures)
        assert float(answer[2]) <= 4.0
        answers.append(answer[3])
    assert answers[0] == answers[1]


def test_each_look_at_a_list_costs_the_same_however_long_it_is(tmp_path, monkeypatch):
    """Reading a thousand parts must not go over the lists of the file a thousand times."""
    from prnav.scene.gltf import GltfFile
    from prnav.scene.source import read_source

    file = GltfFile(read_source(write_big(tmp_path / "parts.glb", 50, 1, 1, 8)))
    assert file.items("accessors") is file.items("accessors")
    file.document["accessors"].append("no object")
    assert len(file.items("accessors")) == 151  # checked once, not again
