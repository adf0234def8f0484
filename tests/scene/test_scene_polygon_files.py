import numpy as np
import pytest
import trimesh
from PIL import Image

from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

PICTURE = np.array([[[200, 10, 20], [30, 220, 40]], [[50, 60, 230], [70, 80, 90]]], np.uint8)


def load(path, **options):
    return load_mesh(read_source(path), **options)


OBJ = """mtllib my materials.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl painted
f 1/1 2/2 3/3 4/4
v 0 0 1
v 1 0 1
v 1 1 1
usemtl red
f 5 6 7
usemtl nowhere
f 5 7 6
"""


def test_obj_with_materials(tmp_path):
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "my materials.mtl").write_text(
        "newmtl painted\nKd 0.5 1 1\nmap_Kd pictures\\p.png\n\nnewmtl red\nKd 1 0 0.2\n"
    )
    (tmp_path / "pictures").mkdir()
    Image.fromarray(PICTURE).save(tmp_path / "pictures" / "p.png")
    scene = load(tmp_path / "a.obj")
    assert len(scene.faces) == 4 and scene.atlas.num_textures == 2
    assert np.array_equal(scene.atlas.image(1)[..., :3], PICTURE)
    painted = scene.face_texture == 1
    assert painted.sum() == 2
    corners = np.unique(scene.faces[painted])
    found = {tuple(scene.vertices[k]): (tuple(scene.uvs[k]), tuple(scene.colors[k])) for k in corners}
    assert found == {  # v down: the picture's top row is at y = 1
        (0, 0, 0): ((0, 1), (128, 255, 255)),
        (1, 0, 0): ((1, 1), (128, 255, 255)),
        (1, 1, 0): ((1, 0), (128, 255, 255)),
        (0, 1, 0): ((0, 0), (128, 255, 255)),
    }
    plain = {tuple(scene.colors[face[0]]) for face in scene.faces[~painted]}
    assert plain == {(255, 0, 51), (255, 255, 255)}


def test_obj_with_a_black_kd_under_its_image(tmp_path):
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "my materials.mtl").write_text("newmtl painted\nKd 0 0 0\nmap_Kd p.png\n")
    Image.fromarray(PICTURE).save(tmp_path / "p.png")
    scene = load(tmp_path / "a.obj")
    assert (scene.colors[scene.faces[scene.face_texture == 1]] == 255).all()


def test_obj_without_its_materials_is_plain_and_says_so(tmp_path):
    (tmp_path / "a.obj").write_text(OBJ)
    scene = load(tmp_path / "a.obj")
    assert "'my materials.mtl' is missing, what it colours stays plain" in scene.notes
    assert len(scene.faces) == 4 and (scene.colors == 255).all() and scene.atlas.num_textures == 1
    (tmp_path / "my materials.mtl").write_text("newmtl painted\nKd 0.2 0.2 0.2\nmap_Kd p.png\n")
    assert "'p.png' is missing, what it colours stays plain" in load(tmp_path / "a.obj").notes


def test_obj_polygons_and_vertex_colours(tmp_path):
    (tmp_path / "a.obj").write_text(
        "v 0 0 0 1 0 0\nv 2 0 0 1 0 0\nv 3 1 0 0 1 0\nv 1 2 0 0 0 1\nv -1 1 0 0 0 1\nf 1 2 3 4 5\nf 1 2 4\n"
    )
    scene = load(tmp_path / "a.obj")
    corners = scene.vertices[scene.faces].astype(float)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert len(scene.faces) == 4 and areas.sum() == pytest.approx(5.0 + 2.0)
    colors = {tuple(v): tuple(c) for v, c in zip(scene.vertices.tolist(), scene.colors.tolist(), strict=True)}
    assert colors[(0, 0, 0)] == (255, 0, 0) and colors[(3, 1, 0)] == (0, 255, 0) and colors[(-1, 1, 0)] == (0, 0, 255)


@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_ply_vertex_colours(tmp_path, encoding):
    box = trimesh.creation.box()
    box.visual.vertex_colors = np.random.default_rng(0).integers(0, 256, (8, 4), dtype=np.uint8)
    path = tmp_path / "a.ply"
    path.write_bytes(box.export(file_type="ply", encoding=encoding))
    scene = load(path)
    assert np.array_equal(scene.vertices, box.vertices.astype(np.float32))
    assert np.array_equal(scene.faces, box.faces)
    assert np.array_equal(scene.colors, box.visual.vertex_colors[:, :3])


def test_ply_face_colours(tmp_path):
    box = trimesh.creation.box()
    box.visual.face_colors = np.random.default_rng(0).integers(0, 256, (12, 4), dtype=np.uint8)
    path = tmp_path / "a.ply"
    path.write_bytes(box.export(file_type="ply"))
    scene = load(path)
    assert np.array_equal(scene.vertices[scene.faces], box.triangles.astype(np.float32))
    assert np.array_equal(scene.colors[scene.faces], np.repeat(box.visual.face_colors[:, None, :3], 3, axis=1))


def test_ply_with_a_texture(tmp_path):
    header = ["ply", "format ascii 1.0", "comment TextureFile p.png", "element vertex 3"]
    header += [f"property float {name}" for name in "xyzst"]
    header += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    body = ["0 0 0 0 0", "1 0 0 1 0", "0 1 0 0 1", "3 0 1 2"]
    path = tmp_path / "a.ply"
    path.write_text("\n".join(header + body) + "\n")
    Image.fromarray(PICTURE).save(tmp_path / "p.png")
    scene = load(path)
    assert scene.face_texture.tolist() == [1] and np.array_equal(scene.atlas.image(1)[..., :3], PICTURE)
    uvs = {tuple(v): tuple(uv) for v, uv in zip(scene.vertices.tolist(), scene.uvs.tolist(), strict=True)}
    assert uvs == {(0, 0, 0): (0, 1), (1, 0, 0): (1, 1), (0, 1, 0): (0, 0)}


def test_up_axis(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(trimesh.creation.box(extents=[1, 2, 4]).export(file_type="ply"))
    assert np.ptp(load(path).bounds, axis=0).tolist() == [1, 2, 4]
    assert np.ptp(load(path, up="z").bounds, axis=0).tolist() == [1, 4, 2]
