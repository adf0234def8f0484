"""Small files that ask for much: refused before the memory or the time is spent."""

import io
import subprocess
import sys
import time

import numpy as np
import pytest
from PIL import Image

from prnav.errors import SceneError
from prnav.scene import images
from prnav.scene.images import EncodedImage
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

PEAK = """
import resource, sys
from prnav.errors import SceneError
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    load_mesh(read_source(sys.argv[1]))
except SceneError as error:
    print(error)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024)
"""


def peak(path):
    """Megabytes that loading a file takes in a process of its own, and what is said."""
    run = subprocess.run([sys.executable, "-c", PEAK, path], capture_output=True, text=True, check=True, timeout=120)
    *said, megabytes = run.stdout.splitlines()
    return int(megabytes), "\n".join(said)


def encoded(image, kind="PNG", **options):
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


def with_image(quad, data):
    quad.add("images", {"bufferView": quad.view(data)})
    quad.add("textures", {"source": len(quad.document["images"]) - 1})
    quad.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": len(quad.document["textures"]) - 1}}})
    quad.document["meshes"][0]["primitives"][0]["material"] = len(quad.document["materials"]) - 1
    return quad


def refused(path, match):
    start = time.process_time()
    with pytest.raises(SceneError, match=match):
        load_mesh(read_source(path))
    assert time.process_time() - start < 10.0


def test_a_png_of_some_kilobytes_is_decoded_within_memory(quad, tmp_path):
    data = encoded(Image.new("1", (8192, 8192), 1))
    assert len(data) < 30_000
    megabytes, said = peak(with_image(quad, data).write(tmp_path / "a.glb"))
    assert not said and megabytes < 450


@pytest.mark.parametrize("mode", ["L", "P"])
def test_a_png_of_more_pixels_is_refused_before_it_is_decoded(quad, tmp_path, mode):
    path = with_image(quad, encoded(Image.new(mode, (16000, 10000)), compress_level=1)).write(tmp_path / "a.glb")
    megabytes, said = peak(path)
    assert "has 16000 x 10000 pixels; at most 67108864 are decoded: shrink it to 8192 a side" in said
    assert megabytes < 50


def test_a_big_jpeg_is_decoded_smaller(monkeypatch):
    monkeypatch.setattr(images, "MAX_PIXELS", 64 * 64)
    ramp = np.broadcast_to(np.linspace(0, 255, 128, dtype=np.uint8)[:, None, None], (128, 96, 3))
    image = EncodedImage(encoded(Image.fromarray(ramp.copy()), "JPEG", quality=95), "it")
    exact = ramp.reshape(32, 4, 24, 4, 3).mean(axis=(1, 3))
    assert np.abs(image.decode(4)[..., :3] - exact).max() < 4
    with pytest.raises(SceneError, match="has 96 x 128 pixels; at most 4096 are decoded"):
        image.decode(1)


@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB", "RGBA", "LA", "I;16"])
@pytest.mark.parametrize("factor", [1, 2, 4])
def test_strips_change_nothing(monkeypatch, mode, factor):
    noise = np.random.default_rng(0).integers(0, 256, (37, 23, 4), dtype=np.uint8)
    if mode == "I;16":
        image = Image.fromarray(noise[..., 0].astype(np.uint16) * 200)
    else:
        image = Image.fromarray(noise).convert("RGB" if mode in ("1", "L", "P") else mode).convert(mode)
    whole = EncodedImage(encoded(image), "it").decode(factor)
    monkeypatch.setattr(images, "_STRIP", 23 * 4)
    np.testing.assert_array_equal(EncodedImage(encoded(image), "it").decode(factor), whole)


def test_many_empty_pictures_are_refused_together(quad, tmp_path):
    for size in range(8000, 8006):
        with_image(quad, encoded(Image.new("1", (size, 8192))))
        quad.document["meshes"][0]["primitives"].append(dict(quad.document["meshes"][0]["primitives"][0]))
    refused(quad.write(tmp_path / "a.glb"), "and the images before it have .* pixels in .* bytes; at most")


def test_numbers_without_bytes_are_bounded_by_the_file(quad, tmp_path):
    part = {"bufferView": 0, "componentType": 5121}  # of the square's corners, as if they were indices
    sparse = {"count": 1, "indices": part, "values": part}
    quad.document["accessors"][0].pop("bufferView")
    quad.document["accessors"][0] |= {"count": 40_000, "sparse": sparse}
    quad.document["meshes"][0]["primitives"] *= 2
    path = quad.write(tmp_path / "a.glb")
    assert path.stat().st_size < 1500
    refused(path, r"asks for 80000 accessor elements without bytes of their own; a file of \d+ bytes may have")


def test_primitives_that_share_a_strip_are_counted_one_by_one(quad, tmp_path):
    order = np.arange(400_000, dtype=np.uint32) % 4
    primitive = quad.document["meshes"][0]["primitives"][0] | {"indices": quad.accessor(order), "mode": 5}
    quad.document["meshes"][0]["primitives"] = [primitive] * 110
    refused(quad.write(tmp_path / "a.glb"), "vertex indices, primitives that share them counted one by one")


def test_a_million_nodes_are_refused_at_once(quad, tmp_path):
    quad.document["nodes"] = [{"mesh": 0}] * 300_000
    quad.document["scenes"][0]["nodes"] = list(range(300_000))
    refused(quad.write(tmp_path / "a.glb"), "asks for 300000 nodes; a file of .* bytes may have 100000")


def test_a_million_primitives_are_refused_at_once(quad, tmp_path):
    quad.document["meshes"][0]["primitives"] *= 300_000
    refused(quad.write(tmp_path / "a.glb"), "asks for 300000 primitives")


def test_instances_of_a_large_mesh_are_bounded_by_the_file(quad, tmp_path):
    order = np.zeros(300_000, np.uint32)
    quad.document["meshes"][0]["primitives"][0] |= {"indices": quad.accessor(order), "mode": 5}
    for _ in range(60):
        quad.node(mesh=0)
    refused(quad.write(tmp_path / "a.glb"), "triangles, instances counted one by one; a file of .* bytes may have")


def test_many_instances_of_a_small_mesh_are_fine(quad, tmp_path):
    for k in range(2000):
        quad.node(mesh=0, translation=[k, 0, 0])
    assert len(load_mesh(read_source(quad.write(tmp_path / "a.glb"))).faces) == 2 * 2001
