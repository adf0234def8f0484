"""Real meshes: their sizes, and the same triangles as trimesh finds."""

import numpy as np
import pytest
import trimesh

from prnav.errors import SceneError
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

SCENES = {  # triangles, size [m], textures
    "aws_small_house/small_house.glb": (146_482, (19.0, 3.0, 11.4), 64),
    "aws_hospital/hospital_two_floors.glb": (293_758, (25.1, 9.0, 57.0), 28),
    "aws_bookstore/bookstore.glb": (100_809, (15.7, 3.7, 14.6), 23),
    "osrf_servicesim/servicesim_office.glb": (204_246, (49.5, 3.0, 22.5), 15),
    "pal_home/home.glb": (11_704, (15.5, 2.5, 17.7), 8),
    "iai_apartment/apartment.glb": (366_104, (19.1, 3.1, 5.4), 1),
    "dream_apartment/dream_apartment.glb": (177_934, (12.4, 2.8, 11.3), 0),
    "quest_rooms/living_room.glb": (62_102, (6.1, 3.9, 4.6), 0),
    "quest_rooms/music_room.glb": (86_786, (5.0, 3.8, 6.7), 0),
    "quest_rooms/meeting_room.glb": (16_704, (4.3, 2.9, 5.5), 0),
    "quest_rooms/office_large.glb": (22_188, (3.3, 2.4, 5.5), 0),
    "quest_rooms/office_small.glb": (3_822, (2.5, 2.8, 2.4), 0),
    "recast_demo/dungeon.obj": (10_133, (74.3, 40.2, 98.9), 0),
    "recast_demo/nav_test.obj": (1_612, (91.4, 21.9, 77.3), 0),
    "habitat_simple_room/simple_room.glb": (84, (10.5, 2.2, 10.9), 0),
}


@pytest.mark.filterwarnings("ignore:.*nav_test.mtl' is missing")
@pytest.mark.parametrize("name", SCENES)
def test_size_and_textures(real_data, name):
    triangles, size, textures = SCENES[name]
    scene = load_mesh(read_source(real_data / "scenes" / name), up="z" if "simple_room" in name else "y")
    assert len(scene.faces) == triangles
    assert np.ptp(scene.bounds, axis=0) == pytest.approx(size, abs=0.06)
    assert scene.atlas.num_textures == textures + 1
    assert set(np.unique(scene.face_texture)) | {0} == set(range(textures + 1))
    assert scene.vertices[scene.faces].shape == (triangles, 3, 3)


@pytest.mark.parametrize(
    "name",
    [
        "pal_home/home.glb",
        "habitat_simple_room/simple_room.glb",
        pytest.param("aws_small_house/small_house.glb", marks=pytest.mark.slow),
        pytest.param("osrf_servicesim/servicesim_office.glb", marks=pytest.mark.slow),
    ],
)
def test_triangles_are_those_that_trimesh_finds(real_data, name):
    path = real_data / "scenes" / name
    scene = load_mesh(read_source(path))
    theirs = trimesh.load_scene(path, process=False).to_mesh().triangles
    ours = scene.vertices[scene.faces].astype(float)
    assert len(ours) == len(theirs)
    centers = [np.sort(t.mean(axis=1), axis=0) for t in (ours, theirs)]
    assert centers[0] == pytest.approx(centers[1], abs=1e-4)
    normals = [np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (ours, theirs)]
    assert normals[0].sum(axis=0) == pytest.approx(normals[1].sum(axis=0), abs=1e-2)


def test_compressed_mesh_is_refused_by_the_extensions_name(real_data, monkeypatch):
    monkeypatch.setattr("prnav.scene.decoders.available", lambda extension: False)
    with pytest.raises(SceneError, match="glTF extension EXT_meshopt_compression, which cannot be decoded"):
        load_mesh(read_source(real_data / "scenes/dream_apartment/dream_apartment_meshopt.glb"))


@pytest.mark.parametrize("share", [0.0001, 0.3, 0.999999])
def test_cut_real_file_is_refused(real_data, tmp_path, share):
    data = (real_data / "scenes/aws_small_house/small_house.glb").read_bytes()
    (tmp_path / "cut.glb").write_bytes(data[: int(share * len(data))])
    with pytest.raises(SceneError, match="cut.glb: .*cut off"):
        load_mesh(read_source(tmp_path / "cut.glb"))


def test_pictures_match_habitats(real_data, golden):
    """Unlit nearest texels along rays, averaged over 64 x 64 pixels, against Habitat's own pictures."""
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    views = np.load(golden / "small_house" / "views.npz")
    scene = load_mesh(read_source(real_data / "scenes/aws_small_house/small_house.glb"))
    mesh = trimesh.Trimesh(scene.vertices.astype(float), scene.faces, process=False)
    caster = RayMeshIntersector(mesh)
    grid = (np.arange(256) + 0.5) / 128 - 1
    x, y = np.meshgrid(grid, -grid)
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1).reshape(-1, 3)
    errors = []
    for index in (0, 9, 18):
        yaw = views["yaw"][index]
        turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
        directions = rays @ turn.T
        origins = np.broadcast_to(views["position"][index].astype(float) + views["sensor_offset"], rays.shape)
        face = caster.intersects_first(origins, directions)
        hit = face >= 0
        corners = scene.faces[face[hit]]
        points = scene.vertices[corners].astype(float)
        normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        reach = ((points[:, 0] - origins[hit]) * normal).sum(1) / (directions[hit] * normal).sum(1)
        weights = trimesh.triangles.points_to_barycentric(points, origins[hit] + reach[:, None] * directions[hit])
        u, v = np.einsum("nk,nkc->cn", weights, scene.uvs[corners].astype(float)) % 1.0
        offset, width, height, _ = scene.atlas.table[scene.face_texture[face[hit]]].T
        column, row = (np.minimum((a * size).astype(int), size - 1) for a, size in ((u, width), (v, height)))
        color = np.einsum("nk,nkc->nc", weights, scene.colors[corners] / 255.0)
        image = np.zeros((256 * 256, 3))
        image[hit] = scene.atlas.texels[offset + row * width + column, :3] * color
        means = image.reshape(4, 64, 4, 64, 3).mean(axis=(1, 3))
        errors.append(means - views["rgb_90"][index].reshape(4, 64, 4, 64, 3).mean(axis=(1, 3)))
    assert np.abs(errors).mean() < 0.5 and np.abs(errors).max() < 3.0
