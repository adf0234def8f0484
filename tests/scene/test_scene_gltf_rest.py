"""glTF's corners: wrap modes, hidden nodes, base64, materials that glow, and what is left out."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest
from mesh_cases import BLUE, GREEN, RED, UPRIGHT, YELLOW, colour_at, load, picture

from prnav.errors import SceneError
from prnav.scene.gltf_unread import NOT_READ


def textured(quad, sampler, uvs, image=None):
    """A quad under a picture of four quarters."""
    quad.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = quad.accessor(np.array(uvs, np.float32))
    quad.add("images", {"bufferView": quad.view(picture()), "mimeType": "image/png"} if image is None else image)
    quad.add("samplers", sampler)
    quad.add("textures", {"source": 0, "sampler": 0})
    quad.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    quad.document["meshes"][0]["primitives"][0]["material"] = 0
    return quad


def corners_of(scene):
    """Colours of the unit square's quarters: upper left, upper right, lower left, lower right."""
    return tuple(colour_at(scene, x, y) for x, y in ((0.24, 0.74), (0.76, 0.74), (0.24, 0.24), (0.76, 0.24)))


SQUARE_UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)  # v down, as the quad's corners go


@pytest.mark.parametrize(
    ("sampler", "uvs", "expected"),
    [
        ({}, SQUARE_UVS, UPRIGHT),
        ({"wrapS": 10497, "wrapT": 10497}, 3 * SQUARE_UVS - 1, None),
        ({"wrapS": 33071, "wrapT": 33071}, 3 * SQUARE_UVS - 1, UPRIGHT),
        ({"wrapS": 33071, "wrapT": 33071}, SQUARE_UVS, UPRIGHT),
        ({"wrapS": 33071, "wrapT": 33071}, SQUARE_UVS + [5, -7], (GREEN,) * 4),
        ({"wrapS": 33071}, SQUARE_UVS + [1.5, 0], (GREEN, GREEN, YELLOW, YELLOW)),
        ({"wrapT": 33071}, SQUARE_UVS + [0.5, 2], (YELLOW, BLUE, YELLOW, BLUE)),
        ({"wrapS": 33648, "wrapT": 10497}, SQUARE_UVS + [1, 0], (GREEN, RED, YELLOW, BLUE)),
        ({"wrapS": 33648, "wrapT": 10497}, SQUARE_UVS + [2, 5], UPRIGHT),
        ({"wrapS": 33648, "wrapT": 33648}, SQUARE_UVS + [-1, 1], (YELLOW, BLUE, GREEN, RED)),
        ({"wrapS": 33071, "wrapT": 33648}, SQUARE_UVS + [-3, 1], (BLUE, BLUE, RED, RED)),
    ],
)
def test_wrap_modes(quad, tmp_path, sampler, uvs, expected):
    scene = load(textured(quad, sampler, uvs).write(tmp_path / "a.glb"))
    if expected is None:
        assert (scene.uvs.max(), scene.atlas.num_textures, len(scene.faces)) == (2.0, 2, 2)
        return
    assert corners_of(scene) == expected
    a, b, c = (scene.vertices[scene.faces[:, k]].astype(float) for k in range(3))
    normals = np.cross(b - a, c - a)
    assert normals.sum(axis=0) == pytest.approx([0, 0, 2]) and (normals[:, 2] > 0).all()


def test_a_clamped_texture_holds_vertex_colours(quad, tmp_path):
    textured(quad, {"wrapS": 33071, "wrapT": 33071}, 3 * SQUARE_UVS - 1)
    colors = np.array([[0, 0, 0], [255, 255, 255], [255, 255, 255], [0, 0, 0]], np.uint8)  # from left to right
    quad.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = quad.accessor(colors, normalized=True)
    scene = load(quad.write(tmp_path / "a.glb"))
    for x in (0.1, 0.4, 0.6, 0.9):
        color = colour_at(scene, x, 0.21)
        assert abs(max(color) - 255 * x) <= 2 and color[2 if x < 0.5 else 0] == max(color)


def test_unknown_wrap_mode(quad, tmp_path):
    with pytest.raises(SceneError, match=r"'wrapS' of textures\[0\] is 1; valid: 10497, 33071, 33648"):
        load(textured(quad, {"wrapS": 1}, SQUARE_UVS).write(tmp_path / "a.glb"))


def test_hidden_nodes_and_what_is_under_them(quad, tmp_path):
    hidden = {"KHR_node_visibility": {"visible": False}}
    quad.document["nodes"][0]["extensions"] = {"KHR_node_visibility": {"visible": True}}
    quad.document["extensionsRequired"] = ["KHR_node_visibility"]
    child = quad.node(mesh=0, translation=[5, 0, 0])
    quad.document["scenes"][0]["nodes"].remove(child)
    quad.node(mesh=0, translation=[9, 0, 0], extensions=hidden, children=[child])
    scene = load(quad.write(tmp_path / "a.glb"))
    assert len(scene.faces) == 2 and scene.bounds[1].tolist() == [1, 1, 0]
    quad.document["nodes"][0]["extensions"] = hidden
    with pytest.raises(SceneError, match="it has no triangles"):
        load(quad.write(tmp_path / "b.glb"))


@pytest.mark.parametrize("change", ["lines", "blanks", "no padding", "url alphabet", "percent", "case"])
def test_base64_as_people_write_it(quad, tmp_path, change):
    quad.document["nodes"][0]["translation"] = [0.1, 0.2, 0.3]
    text = base64.b64encode(quad.buffer + b"\xff\xfb\xfe").decode()
    head = "data:application/octet-stream;base64,"
    text = {
        "lines": "\r\n".join(text[k : k + 76] for k in range(0, len(text), 76)),
        "blanks": " " + text[:8] + " \t" + text[8:],
        "no padding": base64.b64encode(quad.buffer + b"1").decode().rstrip("="),
        "url alphabet": text.replace("+", "-").replace("/", "_"),
        "percent": text.replace("+", "%2B").replace("=", "%3D").replace("/", "%2F"),
        "case": text,
    }[change]
    quad.document["buffers"][0]["uri"] = (head.upper() if change == "case" else head) + text
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(quad.document))
    assert len(load(path).faces) == 2


@pytest.mark.parametrize(
    ("material", "expected"),
    [
        ({"emissiveFactor": [1, 0, 0]}, (RED,) * 4),
        ({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}, UPRIGHT),
        ({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "emissiveFactor": [0, 0, 1]}, (BLUE,) * 4),
        ({"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [0, 0, 1]}, (BLUE,) * 4),
        ({"pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1]}, "emissiveFactor": [0, 0, 1]}, (GREEN,) * 4),
        ({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "emissiveFactor": [0, 0, 1]}, UPRIGHT),
        ({"emissiveTexture": {"index": 0}}, ((255,) * 3,) * 4),
        (
            {"emissiveFactor": [0.5, 0, 0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}}},
            (RED,) * 4,
        ),
    ],
)
def test_materials_that_only_glow(quad, tmp_path, material, expected):
    textured(quad, {}, SQUARE_UVS).document["materials"][0] = material
    assert corners_of(load(quad.write(tmp_path / "a.glb"))) == expected


def test_a_missing_picture_is_a_note(quad, tmp_path):
    scene = load(textured(quad, {}, SQUARE_UVS, {"uri": "gone%20here.png"}).write(tmp_path / "a.glb"))
    assert scene.notes == ("'gone here.png' is missing, what it colours stays plain",) and scene.atlas.num_textures == 1
    (tmp_path / "gone here.png").write_bytes(picture())
    assert corners_of(load(tmp_path / "a.glb")) == UPRIGHT


def test_what_is_left_out_is_noted(quad, tmp_path):
    document = quad.document
    document["extensionsUsed"] = ["VENDOR_thing", "KHR_materials_clearcoat", "KHR_lights_punctual"]
    document["animations"], document["skins"] = [{}], [{"joints": [0]}]
    primitive = document["meshes"][0]["primitives"][0]
    document["meshes"][0]["primitives"].append({**primitive, "mode": 1})
    document["meshes"][0]["weights"] = [0.5]
    assert load(quad.write(tmp_path / "a.glb")).notes == (
        "its glTF extension 'VENDOR_thing' is not read",
        "1 primitive of points or lines left out",
        "1 animation left at rest",
        "1 skin not applied, its vertices stay as they are stored",
        "morph targets left at rest, though weights are set",
    )


def test_the_table_of_what_is_not_read():
    text = (Path(__file__).parents[2] / "docs" / "data.md").read_text()
    table = text[text.index("### Parts of glTF that are not read") :].split("\n\n")[1]
    rows = [tuple(cell.strip().replace("`", "") for cell in line.split("|")[1:3]) for line in table.splitlines()[2:]]
    assert dict(rows) == NOT_READ and len(rows) == len(NOT_READ)
