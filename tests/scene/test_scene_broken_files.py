"""Whatever is wrong with a file is one SceneError of one line that names the file; nothing else is ever raised."""

import base64
import copy
import io
import json
import re

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from prnav.errors import SceneError
from prnav.scene import load_scene
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source


@pytest.fixture(autouse=True)
def no_decoders(monkeypatch):
    """What a compressed file says must not depend on what is installed here."""
    monkeypatch.setattr("prnav.scene.decoders.available", lambda extension: False)


def refuse(path, *texts):
    with pytest.raises(SceneError) as caught:
        load_mesh(read_source(path))
    message = str(caught.value)
    assert "\n" not in message and str(path) in message
    for text in texts:
        assert re.search(text, message), message
    return message


def spoil(glb, path, *keys_and_value):
    """Write the GLB with one value of its JSON replaced (or removed: ...)."""
    *keys, last, value = keys_and_value
    table = glb.document
    for key in keys:
        table = table[key]
    if value is ...:
        del table[last]
    else:
        table[last] = value
    return glb.write(path / "broken.glb")


def test_missing_file(tmp_path):
    refuse(tmp_path / "no.glb", "no such file; give the path of a mesh")
    refuse(tmp_path / "no" / "such.obj", "no such file")


def test_folder(tmp_path):
    (tmp_path / "folder.glb").mkdir()
    refuse(tmp_path / "folder.glb", "cannot be read .*directory")


def test_suffix(tmp_path):
    (tmp_path / "a.fbx").write_bytes(b"x")
    refuse(tmp_path / "a.fbx", r"suffix '\.fbx' .*valid: \.glb, \.gltf, \.obj, \.ply")


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj", ".ply"])
def test_empty_and_pointer_files(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"")
    refuse(path, r"empty \(0 bytes\)")
    path.write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    refuse(path, "Git LFS pointer.*git lfs pull")


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj", ".ply"])
def test_other_bytes(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(bytes(range(256)) * 4)
    refuse(path)
    path.write_bytes(b"\x89PNG and more bytes than a header has")
    refuse(
        path,
        {".glb": r"starts with b'\\x89PNG'", ".gltf": "JSON cannot be read", ".ply": "no PLY header"}.get(suffix, ""),
    )


def test_glb_header(quad, tmp_path):
    data = bytearray(quad.bytes())
    path = tmp_path / "a.glb"
    for start, value, text in (
        (4, 1, "GLB version 1"),
        (8, len(data) + 1, f"promises {len(data) + 1} bytes, it has {len(data)}: cut off"),
        (12, 2**32 - 1, "chunk b'JSON' promises 4294967295 bytes"),
    ):
        spoilt = bytearray(data)
        spoilt[start : start + 4] = value.to_bytes(4, "little")
        path.write_bytes(spoilt)
        refuse(path, text)
    path.write_bytes(data + b"trailing bytes are left alone")
    assert len(load_mesh(read_source(path)).faces) == 2


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_prefix_of_a_glb_is_refused(quad, tmp_path, data):
    whole = quad.bytes()
    path = tmp_path / "prefix.glb"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    refuse(path)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_changed_bytes_load_or_are_refused(quad, tmp_path, data):
    whole = bytearray(quad.bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / "changed.glb"
    path.write_bytes(whole)
    try:
        load_mesh(read_source(path))
    except SceneError as error:
        assert "\n" not in str(error)


values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=4,
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_value_anywhere_in_the_json_loads_or_is_refused(quad, tmp_path, data):
    document = json.loads(json.dumps(quad.document))
    document["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "baseColorTexture": {"index": 0}}}
    ]
    document["meshes"][0]["primitives"][0]["material"] = 0
    places = []

    def walk(owner):
        for key, value in list(owner.items() if isinstance(owner, dict) else enumerate(owner)):
            places.append((owner, key))
            if isinstance(value, dict | list):
                walk(value)

    walk(document)
    owner, key = data.draw(st.sampled_from(range(len(places))).map(places.__getitem__))
    owner[key] = data.draw(values)
    changed = copy.copy(quad)
    changed.document = document
    try:
        load_mesh(read_source(changed.write(tmp_path / "changed.glb")))
    except SceneError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("keys", "value", "text"),
    [
        (("accessors", 0, "count"), 4_000_000_000, "promises 4000000000 elements, 48000000000 bytes, where .* has 48"),
        (("accessors", 0, "bufferView"), ..., "has no data: it names no bufferView"),
        (("accessors", 0, "bufferView"), 99, r"refers to bufferViews\[99\] where there are 3"),
        (("accessors", 0, "byteOffset"), 4, "promises 4 elements, 52 bytes"),
        (("accessors", 0, "count"), -1, "'count' of .* is -1, not a whole number >= 0"),
        (("accessors", 0, "componentType"), 5124, "componentType 5124; valid: 5120"),
        (("accessors", 0, "type"), "VEC2", "is of type 'VEC2' where 3 columns are needed|"),
        (("bufferViews", 0, "byteLength"), 10**12, "reaches to byte 1000000000000 of a buffer that has"),
        (("buffers", 0, "byteLength"), 10**12, "promises 1000000000000 bytes and has .*: it is cut off"),
        (("meshes", 0, "primitives", 0, "attributes", "POSITION"), 17, r"refers to accessors\[17\] where there are 3"),
        (("meshes", 0, "primitives", 0, "mode"), 9, "'mode' of .* is 9; valid: 0 to 6"),
        (("meshes", 0, "primitives"), [], "no triangles; give a mesh with faces"),
        (("meshes", 0, "primitives", 0, "mode"), 1, "no triangles"),
        (("nodes", 0, "children"), [0], r"nodes\[0\] is reached twice"),
        (("nodes", 0, "mesh"), 4, r"nodes\[0\] refers to meshes\[4\] where there are 1"),
        (("nodes", 0, "scale"), [1, 1], "'scale' of .* not a list of 3 finite numbers"),
        (("nodes", 0, "matrix"), [float("nan")] * 16, "'matrix' of .* not a list of 16 finite numbers"),
        (("nodes", 0, "rotation"), [0, 0, 0, 0], "'rotation' of .* not a unit quaternion"),
        (("nodes", 0, "translation"), [1e12, 0, 0], "4 of 4 vertices are farther out than 1000 km.*in metres"),
        (("scenes", 0, "nodes"), [], "no triangles"),
        (("asset",), {"version": "1.0"}, "glTF version '1.0'; export it as glTF 2.0"),
        (("extensionsRequired",), ["EXT_meshopt_compression"], "EXT_meshopt_compression.*gltfpack: without -c and -cc"),
        (("extensionsRequired",), ["KHR_draco_mesh_compression"], "KHR_draco_mesh_compression.*without Draco"),
        (("extensionsRequired",), ["KHR_texture_basisu"], "KHR_texture_basisu.*PNG or JPEG"),
        (("extensionsRequired",), ["VENDOR_thing"], "VENDOR_thing.*export it without this extension"),
        (("nodes", 0, "extensions"), {"EXT_mesh_gpu_instancing": {"a": 1}}, "EXT_mesh_gpu_instancing.*one node per"),
    ],
)
def test_what_the_json_gets_wrong(quad, tmp_path, keys, value, text):
    refuse(spoil(quad, tmp_path, *keys, value), text)


def test_sparse_accessor_out_of_nothing_is_bounded(quad, tmp_path):
    part = {"bufferView": 0, "componentType": 5125}
    sparse = {"count": 1, "indices": part, "values": part}
    quad.document["accessors"][0] = {"componentType": 5126, "type": "VEC3", "count": 4_000_000_000, "sparse": sparse}
    refuse(
        quad.write(tmp_path / "a.glb"),
        "4000000000 accessor elements without bytes of their own; a file of .* bytes may have",
    )


def test_many_instances_of_a_mesh_are_bounded(quad, tmp_path, monkeypatch):
    monkeypatch.setattr("prnav.scene.parts.MAX_TRIANGLES", 5)
    for _ in range(2):
        quad.node(mesh=0)
    refuse(quad.write(tmp_path / "a.glb"), "6 triangles; at most 5 are loaded: simplify the mesh")


def test_index_out_of_range(quad, tmp_path):
    quad.document["meshes"][0]["primitives"][0]["indices"] = quad.accessor(np.array([0, 1, 4], np.uint16))
    refuse(quad.write(tmp_path / "a.glb"), r"an index of meshes\[0\].primitives\[0\] is 4; its vertices are 0\.\.3")


def test_lonely_indices(quad, tmp_path):
    quad.document["meshes"][0]["primitives"][0]["indices"] = quad.accessor(np.array([0, 1, 2, 3], np.uint16))
    refuse(quad.write(tmp_path / "a.glb"), "has 4 indices, not a multiple of 3")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertices_that_are_not_finite(quad, tmp_path, value):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, value, 0], [0, 1, 0]], np.float32)
    quad.document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = quad.accessor(points)
    path = quad.write(tmp_path / "a.glb")
    refuse(
        path,
        r"1 of 4 vertices of meshes\[0\].primitives\[0\] are not finite, the first is number 2: \[1.0, -?(nan|inf)",
    )


def with_image(glb, path, data):
    glb.add("images", {"bufferView": glb.view(data), "mimeType": "image/png"})
    glb.add("textures", {"source": 0})
    glb.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    glb.document["meshes"][0]["primitives"][0]["material"] = 0
    return glb.write(path / "a.glb")


def png(size, mode="RGB"):
    stream = io.BytesIO()
    Image.new(mode, size).save(stream, "PNG")
    return stream.getvalue()


def test_broken_image(quad, tmp_path):
    refuse(
        with_image(quad, tmp_path, b"GIFs are not"), r"images\[0\] is not an image .*starts with b'GIFs are'.*PNG, JPEG"
    )


def test_cut_image(quad, tmp_path):
    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)).save(stream, "PNG")
    refuse(with_image(quad, tmp_path, stream.getvalue()[:2000]), r"images\[0\] is not an image that can be read")


def test_gigantic_images(quad, tmp_path):
    refuse(
        with_image(quad, tmp_path, png((16385, 1), "1")), r"16385 x 1 pixels; valid are 1 to 16384 a side: shrink it"
    )


def test_decompression_bomb(quad, tmp_path):
    refuse(with_image(quad, tmp_path, png((15000, 15000), "1")), "too big to decode.*shrink it")


def test_texture_of_an_extension_alone(quad, tmp_path):
    with_image(quad, tmp_path, png((1, 1)))
    quad.document["textures"][0] = {"extensions": {"KHR_texture_basisu": {"source": 0}}}
    refuse(quad.write(tmp_path / "a.glb"), "KHR_texture_basisu.*PNG or JPEG")
    quad.document["textures"][0] = {}
    refuse(quad.write(tmp_path / "a.glb"), r"textures\[0\] names no image")


@pytest.mark.parametrize(
    "uri", ["../out.bin", "/etc/hostname", "a/../../out.bin", "%2e%2e/out.bin", "C:\\out.bin", "http://a.b/c"]
)
def test_buffers_outside_the_folder_are_refused(quad, tmp_path, uri):
    (tmp_path / "out.bin").write_bytes(quad.buffer)
    (tmp_path / "in").mkdir()
    quad.document["buffers"][0]["uri"] = uri
    path = tmp_path / "in" / "a.gltf"
    path.write_text(json.dumps(quad.document))
    with pytest.raises(SceneError, match="outside its folder; put that file beside the mesh"):
        read_source(path)


@pytest.mark.parametrize("uri", ["../out.png", "/etc/hostname", "a/../../out.png", "%2e%2e/out.png", "C:\\out.png"])
def test_images_outside_the_folder_are_not_read_and_refuse_no_mesh(quad, tmp_path, uri):
    (tmp_path / "out.png").write_bytes(png((2, 2), "RGB"))
    (tmp_path / "in").mkdir()
    quad.document["buffers"][0]["uri"] = "data:;base64," + base64.b64encode(quad.buffer).decode()
    quad.document["images"] = [{"uri": uri}]
    quad.document["textures"] = [{"source": 0}]
    quad.document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    quad.document["meshes"][0]["primitives"][0]["material"] = 0
    path = tmp_path / "in" / "a.gltf"
    path.write_text(json.dumps(quad.document))
    scene = load_mesh(read_source(path))
    assert len(scene.faces) == 2 and scene.atlas.num_textures == 1 and (scene.colors == 255).all()
    assert any("is not read, what it colours stays plain" in n or "is missing, what it" in n for n in scene.notes)


def test_missing_and_short_buffers(quad, tmp_path):
    quad.document["buffers"][0]["uri"] = "a.bin"
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(quad.document))
    refuse(path, r"buffers\[0\] is in the file 'a.bin', which is missing; put it beside the mesh")
    (tmp_path / "a.bin").write_bytes(quad.buffer[:-1])
    refuse(path, "cut off")
    quad.document["buffers"][0]["uri"] = "data:application/octet-stream;base64,####"
    path.write_text(json.dumps(quad.document))
    refuse(path, "data URI .* cannot be decoded")


def test_deep_json(tmp_path):
    path = tmp_path / "a.gltf"
    path.write_text("[" * 100_000)
    refuse(path, "JSON cannot be read")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", r"line 4, a face refers to vertex 9 where there are 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n", r"line 4, 'f 1 2 -9', counts back beyond the first vertex"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\n", "no triangles"),
        ("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "1 of 3 vertices are not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0\nvt 1 1\nf 1/1 2/2 3/1\nf 2 4 3\n", "line 4, 'v 0 0', has too few"),
        ("v 0 0 0\nv 1 0 0\nv 0 one 0\nf 1 2 3\n", "line 3, 'v 0 one 0', holds what is no number"),
        ("v 0 0 0\nv 1 0 0\nv 0 1,5 0\nf 1 2 3\n", "line 3, 'v 0 1,5 0', holds what is no number"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "line 4, 'f 1 2 x', has a corner that is none of"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4, 'f 0 1 2', has the index 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", "line 4, a face refers to texture coordinate 1 where"),
    ],
)
def test_broken_obj(tmp_path, text, problem):
    path = tmp_path / "a.obj"
    path.write_text(text)
    refuse(path, problem)


@pytest.mark.parametrize("name", ["../m.mtl", "/m.mtl"])
def test_obj_with_materials_outside(tmp_path, name):
    path = tmp_path / "a.obj"
    (tmp_path / "m.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / "a.obj"
    path.write_text(f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    scene = load_mesh(read_source(path))
    assert (scene.colors == 255).all() and "what it colours stays plain" in scene.notes[0]


def test_obj_with_a_broken_texture(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    (tmp_path / "a.png").write_bytes(b"no picture")
    refuse(path, "image 'a.png' is not an image that can be read")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0, 0.999))
@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_any_prefix_of_a_ply_is_refused(tmp_path, encoding, share):
    whole = trimesh.creation.box().export(file_type="ply", encoding=encoding).rstrip(b"\n")
    path = tmp_path / "a.ply"
    lines = whole.splitlines(keepends=True)
    cut = whole[: int(share * len(whole))] if encoding == "binary" else b"".join(lines[: int(share * len(lines))])
    path.write_bytes(cut)
    refuse(path)


def test_ply_that_promises_too_much(tmp_path):
    path = tmp_path / "a.ply"
    whole = trimesh.creation.box().export(file_type="ply")
    path.write_bytes(whole.replace(b"element vertex 8", b"element vertex 4000000000"))
    refuse(path, "promises at least 48000000012 bytes, it has .*: cut off")


def test_unknown_axis_and_budget(quad, tmp_path):
    path = quad.write(tmp_path / "a.glb")
    with pytest.raises(SceneError, match="up axis 'x' is not known; valid: y, z"):
        load_scene(path, up="x")
    with pytest.raises(SceneError, match="max_texture_size 0 is not a number of texels >= 1"):
        load_scene(path, max_texture_size=0)


def test_nothing_is_cached_of_a_broken_file(quad, tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "a.glb"
    path.write_bytes(quad.bytes()[:-1])
    with pytest.raises(SceneError):
        load_scene(path)
    assert not (tmp_path / "cache").exists()
