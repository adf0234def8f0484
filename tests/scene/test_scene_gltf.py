import base64
import io
import json

import numpy as np
import pytest
import trimesh
from PIL import Image

from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

RED_GREEN = np.array([[[200, 10, 20], [30, 220, 40]], [[50, 60, 230], [70, 80, 90]]], np.uint8)


def png(array, mode=None, **options):
    stream = io.BytesIO()
    Image.fromarray(np.asarray(array), mode).save(stream, "PNG", **options)
    return stream.getvalue()


def load(path, **options):
    return load_mesh(read_source(path), **options)


def material(glb, **table):
    glb.add("materials", {"pbrMetallicRoughness": table})
    glb.document["meshes"][0]["primitives"][0]["material"] = len(glb.document["materials"]) - 1


def textured(glb, image, **info):
    glb.add("images", {"bufferView": glb.view(image), "mimeType": "image/png"})
    glb.add("textures", {"source": len(glb.document["images"]) - 1})
    material(glb, baseColorTexture={"index": len(glb.document["textures"]) - 1, **info})


def texel(scene, face, corner):
    """Nearest texel times colour at a corner, 0..255, moved a little into the face."""
    indices = scene.faces[face]
    weights = np.full(3, 0.01)
    weights[corner] = 0.98
    u, v = weights @ scene.uvs[indices].astype(float)
    image = scene.atlas.image(scene.face_texture[face])
    height, width = image.shape[:2]
    found = image[int(v % 1.0 * height), int(u % 1.0 * width), :3]
    return found * (scene.colors[indices[corner]] / 255.0)


def corner_of(scene, point, face=0):
    return int(np.argmin(np.abs(scene.vertices[scene.faces[face]] - point).sum(axis=1)))


def test_plain_square(quad, tmp_path):
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert scene.name == "quad.glb"
    assert scene.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert scene.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]
    assert (scene.colors == 255).all() and (scene.face_texture == 0).all()
    assert scene.atlas.num_textures == 1


def test_texture_has_its_top_row_at_v_0(quad, tmp_path):
    textured(quad, png(RED_GREEN))
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert (scene.face_texture == 1).all()
    for point, color in (
        ([0, 1, 0], RED_GREEN[0, 0]),
        ([0, 0, 0], RED_GREEN[1, 0]),
        ([1, 1, 0], RED_GREEN[0, 1]),
        ([1, 0, 0], RED_GREEN[1, 1]),
    ):
        face = 0 if point == [1, 0, 0] else 1 if point == [0, 1, 0] else 0
        assert texel(scene, face, corner_of(scene, point, face)) == pytest.approx(color)


def test_factor_times_vertex_colour(quad, tmp_path):
    colors = np.array([[0, 128, 255, 9], [255, 255, 255, 9], [10, 20, 30, 9], [255, 0, 0, 9]], np.uint8)
    attributes = quad.document["meshes"][0]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = quad.accessor(colors, normalized=True)
    material(quad, baseColorFactor=[0.5, 1.0, 0.25, 0.1])
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert scene.colors.tolist() == np.floor(colors[:, :3] * [0.5, 1.0, 0.25] + 0.5).astype(int).tolist()


@pytest.mark.parametrize(
    "colors",
    [
        np.full((4, 3), 0.2, np.float32),
        np.full((4, 4), 13107, np.uint16),
        np.full((4, 3), 51, np.uint8),
    ],
)
def test_vertex_colours_of_any_type(quad, tmp_path, colors):
    attributes = quad.document["meshes"][0]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = quad.accessor(colors, **({"normalized": True} if colors.dtype != np.float32 else {}))
    assert (load(quad.write(tmp_path / "quad.glb")).colors == 51).all()


@pytest.mark.parametrize(
    ("image", "expected"),
    [
        (png(np.full((2, 2), 77, np.uint8)), [77, 77, 77, 255]),
        (png(np.full((2, 2, 4), [1, 2, 3, 0], np.uint8)), [1, 2, 3, 0]),
        (png(np.full((2, 2, 2), [9, 128], np.uint8)), [9, 9, 9, 128]),
        (png(np.full((2, 2), 40000, np.uint16)), [156, 156, 156, 255]),
        (png(np.ones((2, 2), bool)), [255, 255, 255, 255]),
    ],
)
def test_images_of_any_kind_of_pixel(quad, tmp_path, image, expected):
    textured(quad, image)
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert scene.atlas.image(1).reshape(-1, 4).tolist() == [expected] * 4


def test_palette_image(quad, tmp_path):
    picture = Image.fromarray(RED_GREEN).quantize(4)
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    textured(quad, stream.getvalue())
    assert np.array_equal(load(quad.write(tmp_path / "quad.glb")).atlas.image(1)[..., :3], RED_GREEN)


def test_texture_budget_reduces_by_exact_means(quad, tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (16, 8, 4), dtype=np.uint8)
    textured(quad, png(image))
    path = quad.write(tmp_path / "quad.glb")
    assert load(path, max_texture_size=16).atlas.image(1).shape == (16, 8, 4)
    small = load(path, max_texture_size=5).atlas.image(1)
    expected = image.reshape(4, 4, 2, 4, 4).mean(axis=(1, 3))
    assert small.shape == (4, 2, 4) and np.abs(small - expected).max() <= 0.5


def test_shared_image_is_stored_once(quad, tmp_path):
    textured(quad, png(RED_GREEN))
    textured(quad, png(RED_GREEN))  # the same bytes a second time
    textured(quad, png(255 - RED_GREEN))
    primitive = quad.document["meshes"][0]["primitives"][0]
    for k in range(2):
        quad.document["meshes"][0]["primitives"].append({**primitive, "material": k})
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert scene.atlas.num_textures == 3
    assert scene.face_texture.tolist() == [1, 1, 2, 2, 2, 2]


def test_instances_keep_transform_and_mirrors_keep_fronts(quad, tmp_path):
    half = np.sqrt(0.5)
    quad.node(mesh=0, translation=[10, 0, 0], rotation=[0, half, 0, half], scale=[2, 1, 1])  # a left turn
    quad.node(mesh=0, matrix=[-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1])
    scene = load(quad.write(tmp_path / "quad.glb"))
    corners = scene.vertices[scene.faces].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert normals / np.linalg.norm(normals, axis=1)[:, None] == pytest.approx(
        np.repeat([[0, 0, 1], [1, 0, 0], [0, 0, 1]], 2, axis=0), abs=1e-6
    )
    assert corners[2:4].reshape(-1, 3).min(axis=0) == pytest.approx([10, 0, -2], abs=1e-6)
    assert corners[4:].reshape(-1, 3).min(axis=0) == pytest.approx([-1, 5, 0])


def test_children_are_under_their_parents(quad, tmp_path):
    quad.document["nodes"] = [{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [1, 0, 0]}]
    assert load(quad.write(tmp_path / "quad.glb")).bounds.tolist() == [[2, 0, 0], [4, 2, 0]]
    del quad.document["scenes"], quad.document["scene"]
    assert load(quad.write(tmp_path / "roots.glb")).bounds.tolist() == [[2, 0, 0], [4, 2, 0]]


def test_z_up_file_is_turned(quad, tmp_path):
    scene = load(quad.write(tmp_path / "quad.glb"), up="z")
    assert scene.bounds.tolist() == [[0, 0, -1], [1, 0, 0]]  # y of the file goes to -z


def test_strips_fans_and_lines(quad, tmp_path):
    attributes = quad.document["meshes"][0]["primitives"][0]["attributes"]
    strip = quad.accessor(np.array([0, 1, 3, 2], np.uint8))
    fan = quad.accessor(np.array([0, 1, 2, 3], np.uint32))
    quad.document["meshes"][0]["primitives"] = [
        {"attributes": attributes, "indices": strip, "mode": 5},
        {"attributes": attributes, "indices": fan, "mode": 6},
        {"attributes": attributes, "mode": 1},
        {"attributes": attributes, "mode": 0},
    ]
    scene = load(quad.write(tmp_path / "quad.glb"))
    corners = scene.vertices[scene.faces].astype(float)
    assert np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).tolist() == [[0, 0, 1]] * 4


def test_quantised_interleaved_and_sparse_accessors(quad, tmp_path):
    rows = np.zeros(4, [("position", "<i2", 3), ("pad", "<i2"), ("uv", "<u2", 2)])
    rows["position"] = [[0, 0, 0], [32767, 0, 0], [32767, 32767, 0], [0, 32767, 0]]
    rows["uv"] = [[0, 65535], [65535, 65535], [65535, 0], [0, 0]]
    view = quad.view(rows.tobytes(), byteStride=12)
    shared = {"bufferView": view, "count": 4, "normalized": True}
    position = quad.add("accessors", {**shared, "componentType": 5122, "type": "VEC3"})
    uv = quad.add("accessors", {**shared, "componentType": 5123, "type": "VEC2", "byteOffset": 8})
    quad.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    quad.document["meshes"][0]["primitives"][0]["attributes"] = {"POSITION": position, "TEXCOORD_0": uv}
    textured(quad, png(RED_GREEN))
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert scene.bounds == pytest.approx(np.array([[0, 0, 0], [1, 1, 0]]))
    assert scene.uvs.tolist() == [[0, 1], [1, 1], [1, 0], [0, 0]]
    quad.document["accessors"][position]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": quad.view(np.array([2], np.uint16).tobytes()), "componentType": 5123},
        "values": {"bufferView": quad.view(np.array([[32767, 32767, 32767]], np.int16).tobytes())},
    }
    assert load(quad.write(tmp_path / "sparse.glb")).bounds[1] == pytest.approx([1, 1, 1])


def test_texture_transform_and_second_uv_set(quad, tmp_path):
    attributes = quad.document["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_3"] = quad.accessor(np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32))
    transform = {"offset": [0.25, 0.5], "rotation": np.pi / 2, "scale": [2.0, 3.0], "texCoord": 3}
    textured(quad, png(RED_GREEN), texCoord=1, extensions={"KHR_texture_transform": transform})
    quad.document["extensionsRequired"] = ["KHR_texture_transform"]
    scene = load(quad.write(tmp_path / "quad.glb"))
    # a quarter turn counter-clockwise with v down takes +u to -v and +v to +u
    assert scene.uvs == pytest.approx(np.array([[0.25, 0.5], [0.25, -1.5], [3.25, 0.5], [3.25, -1.5]]), abs=1e-6)


def test_unused_vertices_are_left_out_even_broken_ones(quad, tmp_path):
    points = np.concatenate([np.full((2, 3), np.nan, np.float32), np.eye(3, dtype=np.float32)])
    quad.document["meshes"][0]["primitives"] = [
        {
            "attributes": {"POSITION": quad.accessor(points)},
            "indices": quad.accessor(np.array([2, 3, 4], np.uint32)),
        }
    ]
    scene = load(quad.write(tmp_path / "quad.glb"))
    assert scene.vertices.tolist() == np.eye(3).tolist() and scene.faces.tolist() == [[0, 1, 2]]


def test_gltf_with_files_beside_it_and_data_uris(quad, tmp_path):
    material(quad, baseColorTexture={"index": 0})
    quad.add("textures", {"source": 0})
    quad.add("images", {"uri": "a%20picture.png"})
    (tmp_path / "a picture.png").write_bytes(png(RED_GREEN))
    (tmp_path / "quad.bin").write_bytes(quad.buffer)
    quad.document["buffers"][0]["uri"] = "quad.bin"
    (tmp_path / "quad.gltf").write_text(json.dumps(quad.document))
    beside = load(tmp_path / "quad.gltf")
    assert np.array_equal(beside.atlas.image(1)[..., :3], RED_GREEN)
    quad.document["buffers"][0]["uri"] = (
        "data:application/octet-stream;base64," + base64.b64encode(quad.buffer).decode()
    )
    quad.document["images"][0]["uri"] = "data:image/png;base64," + base64.b64encode(png(RED_GREEN)).decode()
    (tmp_path / "inside.gltf").write_text(json.dumps(quad.document))
    assert load(tmp_path / "inside.gltf").hash == beside.hash


def test_scene_written_by_trimesh(tmp_path):
    """Two textures, vertex colours and a material colour, in parts with transforms."""
    pictures = [Image.fromarray(RED_GREEN), Image.fromarray(255 - RED_GREEN)]
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    up_uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)  # trimesh: v up
    scene = trimesh.Scene()
    for k, picture in enumerate(pictures):
        look = trimesh.visual.material.PBRMaterial(
            baseColorTexture=picture, baseColorFactor=[255, 255 - 155 * k, 255, 255]
        )
        visual = trimesh.visual.TextureVisuals(uv=up_uvs, material=look)
        part = trimesh.Trimesh(vertices, faces, visual=visual, process=False)
        scene.add_geometry(part, geom_name=f"t{k}", transform=trimesh.transformations.translation_matrix([3 * k, 0, 0]))
    colored = trimesh.Trimesh(vertices, faces, process=False)
    colored.visual = trimesh.visual.ColorVisuals(
        colored, vertex_colors=[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [9, 8, 7, 255]]
    )
    scene.add_geometry(colored, geom_name="vc", transform=trimesh.transformations.translation_matrix([6, 0, 0]))
    plain = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(baseColorFactor=[40, 80, 120, 255])
    )
    part = trimesh.Trimesh(vertices, faces, visual=plain, process=False)
    scene.add_geometry(part, geom_name="mc", transform=trimesh.transformations.translation_matrix([9, 0, 0]))
    (tmp_path / "four.glb").write_bytes(scene.export(file_type="glb"))

    mesh = load(tmp_path / "four.glb")
    assert len(mesh.faces) == 8 and mesh.atlas.num_textures == 3
    assert mesh.bounds.tolist() == [[0, 0, 0], [10, 1, 0]]

    def look_at(x, y):
        center = mesh.vertices[mesh.faces].mean(axis=1)
        face = int(np.argmin(np.abs(center - [x + (0.5 - x % 3) * 0.4, y + (0.5 - y) * 0.4, 0]).sum(axis=1)))
        return texel(mesh, face, corner_of(mesh, [x, y, 0], face))

    assert look_at(0, 1) == pytest.approx(RED_GREEN[0, 0])
    assert look_at(1, 0) == pytest.approx(RED_GREEN[1, 1])
    factor = np.array([255, 100, 255]) / 255.0
    assert look_at(3, 1) == pytest.approx((255 - RED_GREEN[0, 0]) * factor, abs=0.6)
    assert look_at(4, 0) == pytest.approx((255 - RED_GREEN[1, 1]) * factor, abs=0.6)
    assert look_at(7, 0) == pytest.approx([0, 255, 0])
    assert look_at(6, 1) == pytest.approx([9, 8, 7])
    assert look_at(10, 1) == pytest.approx([40, 80, 120])
