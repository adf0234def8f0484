"""Compressed meshes and textures: decoded where a library for it is there, refused by name where it is not."""

import base64
import io

import numpy as np
import pytest
from data_trees import QUAD, QUAD_FACES, QUAD_UVS
from PIL import Image

from prnav.errors import SceneError
from prnav.scene import decoders
from prnav.scene.images import EncodedImage
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

# 16 x 8 texels, the upper half (200, 40, 20), the lower half (20, 60, 220)
ETC1S = base64.b64decode(
    "q0tUWCAyMLsNChoKAAAAAAEAAAAQAAAACAAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAACwAAACUAAAAJAAAALgAAAAAAAAAjgAA"
    "AAAAAABGAQAAAAAAAAMAAAAAAAAAAAAAAAAAAAAsAAAAAAAAAAIAKACjAQIAAwMAAAgAAAAAAAAAAAA/AAAAAAAAAAAA/////x8A"
    "AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuMTAAAAIAAgAvAAAACQAAAC4AAAAAAAAAAAAAAAAAAAADAAAAAAAAAAAAAAAe"
    "wJQAAAAAAACyQqQBTAkAAAAAAEEHjBYQgBkAAAAAAAAkGQBTAAQAAAAAyBBWAQQAAACoqqqqAjTARAAAAAAAAOKJADABIAAAAACA"
    "OARECRgAAAAG7faSCERBAJgAEAAAAABABAKFyQE="
)
UASTC = base64.b64decode(
    "q0tUWCAyMLsNChoKAAAAAAEAAAAQAAAACAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAA"
    "AAAAAADAAAAAAAAAAIAAAAAAAAAAgAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AAAAAAAAAAAA/////x8A"
    "AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuMTAAAAQAAAB/fwAAFxmF4j+1AwAAAAAAAAAAABcZheI/tQMAAAAAAAAAAAAX"
    "GYXiP7UDAAAAAAAAAAAAFxmF4j+1AwAAAAAAAAAAAJeCh/u/MMsDAAAAAAAAAACXgof7vzDLAwAAAAAAAAAAl4KH+78wywMAAAAA"
    "AAAAAJeCh/u/MMsDAAAAAAAAAAA="
)


def needs(extension):
    library = decoders.LIBRARIES[extension]
    return pytest.mark.skipif(not decoders.available(extension), reason=f"{library} is missing: {decoders.INSTALL}")


def load(path):
    return load_mesh(read_source(path))


def draco(glb, **changes):
    """The unit square with its numbers as Draco data."""
    import DracoPy

    data = DracoPy.encode(QUAD, QUAD_FACES.reshape(-1, 3), tex_coord=QUAD_UVS.astype(float), preserve_order=True)
    ids = {a["attribute_type"]: a["unique_id"] for a in DracoPy.decode(data).attributes}
    compressed = {"bufferView": glb.view(data), "attributes": {"POSITION": ids[0], "TEXCOORD_0": ids[3]}}
    primitive = glb.document["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {**compressed, **changes}}
    for accessor in glb.document["accessors"]:
        del accessor["bufferView"]
    glb.document["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return glb


@needs("KHR_draco_mesh_compression")
def test_draco(quad, tmp_path):
    plain = load(quad.write(tmp_path / "plain.glb"))
    scene = load(draco(quad).write(tmp_path / "draco.glb"))
    assert scene.vertices[scene.faces] == pytest.approx(plain.vertices[plain.faces], abs=1e-3)


@needs("KHR_draco_mesh_compression")
@pytest.mark.parametrize("promised", [3, 5, 4_000_000_000])
def test_draco_data_rule_over_what_accessors_promise(quad, tmp_path, promised):
    plain = load(quad.write(tmp_path / "plain.glb"))
    draco(quad)
    for accessor in quad.document["accessors"]:
        accessor["count"] = promised
    scene = load(quad.write(tmp_path / "a.glb"))
    assert scene.vertices[scene.faces] == pytest.approx(plain.vertices[plain.faces], abs=1e-3)


@needs("KHR_draco_mesh_compression")
def test_broken_draco_data(quad, tmp_path):
    draco(quad)
    path = tmp_path / "a.glb"
    view = quad.document["bufferViews"][-1]
    view["byteLength"] //= 2
    with pytest.raises(SceneError, match=r"the Draco data of meshes\[0\].primitives\[0\] cannot be decoded"):
        load(quad.write(path))


def meshopt_square(glb, **changes):
    """The unit square with its positions and triangles under EXT_meshopt_compression."""
    import meshopt

    for k, (data, mode) in enumerate(((QUAD, "ATTRIBUTES"), (None, None), (QUAD_FACES.astype(np.uint32), "TRIANGLES"))):
        if data is None:
            continue
        packed = meshopt.encode_gltf_buffer(data, mode)
        stride = data.itemsize * (data.shape[1] if data.ndim == 2 else 1)
        inner = {"buffer": 0, "byteOffset": len(glb.buffer), "byteLength": len(packed)}
        inner |= {"byteStride": stride, "count": len(data), "mode": mode, **changes}
        glb.view(packed)
        view = {"buffer": 1, "byteLength": data.nbytes, "extensions": {"EXT_meshopt_compression": inner}}
        glb.document["bufferViews"][glb.document["accessors"][k]["bufferView"]] = view
        if mode == "TRIANGLES":
            glb.document["accessors"][k]["componentType"] = 5125
    fallback = {"byteLength": 10_000, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}
    glb.document["buffers"].append(fallback)
    glb.document["extensionsRequired"] = ["EXT_meshopt_compression"]
    return glb


@needs("EXT_meshopt_compression")
def test_meshopt(quad, tmp_path):
    plain = load(quad.write(tmp_path / "plain.glb"))
    scene = load(meshopt_square(quad).write(tmp_path / "packed.glb"))
    assert {tuple(map(tuple, t)) for t in scene.vertices[scene.faces].tolist()} == {
        tuple(map(tuple, t)) for t in plain.vertices[plain.faces].tolist()
    }


@needs("EXT_meshopt_compression")
@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"count": 1_000_000_000}, "cannot hold 1000000000 elements of 12 bytes"),
        ({"count": 400}, "meshopt data of bufferViews.* cannot be decoded"),
        ({"mode": "PLAIN"}, "cannot be decoded .*mode"),
        ({"byteStride": 7}, "cannot be decoded"),
        ({"byteLength": 4000}, "reaches to byte .* of a buffer that has"),
        ({"filter": "SHARPEN"}, "cannot be decoded .*filter"),
    ],
)
def test_meshopt_data_that_does_not_fit(quad, tmp_path, changes, text):
    with pytest.raises(SceneError, match=text):
        load(meshopt_square(quad, **changes).write(tmp_path / "a.glb"))


@needs("EXT_meshopt_compression")
def test_real_meshopt_file_is_the_plain_one(real_data):
    folder = real_data / "scenes/dream_apartment"
    packed, plain = (load(folder / name) for name in ("dream_apartment_meshopt.glb", "dream_apartment.glb"))
    assert len(packed.faces) == len(plain.faces) == 177_934
    assert packed.bounds == pytest.approx(plain.bounds, abs=1e-3)


def with_basis(glb, data, extension="KHR_texture_basisu"):
    glb.add("images", {"bufferView": glb.view(data), "mimeType": "image/ktx2"})
    glb.add("textures", {"extensions": {extension: {"source": 0}}})
    glb.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    glb.document["meshes"][0]["primitives"][0]["material"] = 0
    glb.document["extensionsRequired"] = [extension]
    return glb


@needs("KHR_texture_basisu")
@pytest.mark.parametrize("data", [ETC1S, UASTC], ids=["etc1s", "uastc"])
@pytest.mark.parametrize("extension", ["KHR_texture_basisu", "GOOGLE_texture_basis"])
def test_basis_textures(quad, tmp_path, data, extension):
    scene = load(with_basis(quad, data, extension).write(tmp_path / "a.glb"))
    image = scene.atlas.image(1)
    assert image.shape == (8, 16, 4)
    assert np.abs(image[:4, :, :3].astype(int) - [200, 40, 20]).max() <= 6
    assert np.abs(image[4:, :, :3].astype(int) - [20, 60, 220]).max() <= 6
    small = EncodedImage(data, "x").decode(8)
    assert small.shape == (1, 2, 4) and np.abs(small[0, 0, :3].astype(int) - [110, 50, 120]).max() <= 6


@needs("KHR_texture_basisu")
@pytest.mark.parametrize("data", [ETC1S, UASTC], ids=["etc1s", "uastc"])
def test_broken_basis_textures(data):
    for cut in range(13, len(data), 23):
        with pytest.raises(SceneError, match="x is a Basis texture that cannot be read"):
            EncodedImage(data[:cut], "x").decode()
    huge = bytearray(data)
    huge[20:28] = (60_000).to_bytes(4, "little") * 2
    with pytest.raises(SceneError, match="60000 x 60000 pixels|cannot be read"):
        EncodedImage(bytes(huge), "x").decode()
    generator = np.random.default_rng(0)
    for _ in range(300):
        spoilt = bytearray(data)
        for place in generator.integers(12, len(data), 3):
            spoilt[place] = generator.integers(256)
        try:
            EncodedImage(bytes(spoilt), "x").decode()
        except SceneError:
            pass


def test_basis_texture_without_a_decoder(quad, tmp_path, monkeypatch):
    monkeypatch.setattr(decoders, "available", lambda extension: False)
    path = with_basis(quad, ETC1S).write(tmp_path / "a.glb")
    with pytest.raises(SceneError, match=r'KHR_texture_basisu.*pip install "prnav\[data\]", or .* PNG or JPEG'):
        load(path)
    del quad.document["extensionsRequired"]
    quad.document["textures"][0] = {"source": 0}
    with pytest.raises(SceneError, match=r"KTX 2 / Basis Universal texture, and no decoder .*prnav\[data\]"):
        load(quad.write(path))


def test_texture_with_a_plain_twin_needs_no_decoder(quad, tmp_path, monkeypatch):
    monkeypatch.setattr(decoders, "available", lambda extension: False)
    with_basis(quad, ETC1S)
    del quad.document["extensionsRequired"]
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (1, 2, 3)).save(stream, "PNG")
    quad.document["images"].append({"bufferView": quad.view(stream.getvalue())})
    quad.document["textures"][0]["source"] = 1
    assert load(quad.write(tmp_path / "a.glb")).atlas.image(1)[0, 0].tolist() == [1, 2, 3, 255]


def test_libraries_are_those_of_the_extra():
    from importlib import metadata

    try:
        requires = " ".join(metadata.requires("prnav") or [])
    except metadata.PackageNotFoundError:
        pytest.skip("prnav is not installed; install it to see its extras")
    if "extra == 'data'" not in requires and 'extra == "data"' not in requires:
        pytest.skip("prnav was installed before it had the extra 'data'; install it again")
    assert all(library.lower() in requires.lower().replace("-", "_") for library in decoders.LIBRARIES.values())
