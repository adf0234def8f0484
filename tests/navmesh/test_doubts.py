"""Meshes and navmeshes that cannot be what they say, and floors that are roofs."""

import dataclasses
import glob
import warnings

import numpy as np
import pytest

from prnav.episodes import generate_table
from prnav.episodes.generate import GenerationConfig
from prnav.errors import NavMeshError, PrnavError
from prnav.navmesh import NavMesh, load_navmesh
from prnav.navmesh.cover import indoor_floors, roofless
from prnav.navmesh.extent import extent_doubts
from prnav.navmesh.fit import check_fit, floor_share
from prnav.scene import SceneMesh, TextureAtlas, load_scene
from prnav.scene.scene_file import AXES


def mesh_of(*boxes, extra=(), scale=1.0):
    """Boxes (x0, x1, y0, y1, z0, z1) whose faces look both ways, and triangles of three points each."""
    points, faces = [], []
    for x0, x1, y0, y1, z0, z1 in boxes:
        k = len(points)
        points += [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
        for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
            faces += [(k + a, k + b, k + c), (k + a, k + c, k + d), (k + c, k + b, k + a), (k + d, k + c, k + a)]
    for triangle in extra:
        faces.append((len(points), len(points) + 1, len(points) + 2))
        points += triangle
    return SceneMesh(
        name="a.obj",
        vertices=np.array(points, np.float32) * np.float32(scale),
        uvs=np.zeros((len(points), 2), np.float32),
        colors=np.full((len(points), 3), 255, np.uint8),
        faces=np.array(faces, np.int32),
        face_texture=np.zeros(len(faces), np.int32),
        atlas=TextureAtlas.from_images([]),
    )


ROOM = (0, 6, 0, 2.5, 0, 6)


@pytest.mark.parametrize("depth", [-2000.0, -10_000.0])
def test_a_stray_triangle_far_below_is_named(depth):
    scene = mesh_of(ROOM, extra=[[(1, depth, 1), (2, depth, 1), (2, depth, 2)]])
    with pytest.raises(NavMeshError) as caught:
        load_navmesh(scene)
    text = str(caught.value)
    assert text.startswith(f"scene a.obj: the mesh is 6 x {2.5 - depth:.6g} x 6 m (x, y, z)")
    assert "y 0 to 2.5, z 0 to 6, but triangle 24 reaches to y = " + f"{depth:.6g}; remove what lies outside" in text
    assert extent_doubts(scene) == [text.removeprefix("scene a.obj: ")]


def test_what_the_spans_hold_is_built():
    scene = mesh_of(ROOM, extra=[[(1, -1500, 1), (2, -1500, 1), (2, -1500, 2)]])
    heights = NavMesh.build(scene).random_points(50, 0)[:, 1]
    assert np.abs(heights[heights > -100]).max() < 3.0
    (doubt,) = extent_doubts(scene)
    assert "triangle 24 reaches to y = -1500" in doubt


@pytest.mark.parametrize(("scale", "size"), [(1000.0, "6000 x 2500 x 6000"), (100.0, "600 x 250 x 600")])
def test_a_scene_in_millimetres_or_centimetres(scale, size):
    scene = mesh_of(ROOM, scale=scale)
    (doubt,) = extent_doubts(scene)
    assert size in doubt and "scale it to metres if it is in millimetres or centimetres" in doubt
    if scale == 1000.0:
        with pytest.raises(NavMeshError, match="scale it to metres"):
            load_navmesh(scene)


def test_rooms_are_not_doubted():
    assert extent_doubts(mesh_of(ROOM)) == []
    assert "too small to walk in" in extent_doubts(mesh_of(ROOM, scale=0.01))[0]


def test_a_navmesh_of_another_scene_or_axis():
    scene = mesh_of((0, 6, 0, 2.5, 0, 9))
    navmesh = NavMesh.build(scene)
    assert floor_share(navmesh, scene) == 1.0
    check_fit(navmesh, scene, "a.navmesh")
    turned = dataclasses.replace(scene, vertices=scene.vertices @ AXES["z"].matrix()[:3, :3].T.astype(np.float32))
    moved = dataclasses.replace(scene, vertices=scene.vertices + np.float32(30))
    for other in (turned, moved):
        with pytest.raises(NavMeshError, match=r"navmesh a\.navmesh: scene a\.obj has a floor under \d+ % of it alone"):
            check_fit(navmesh, other, "a.navmesh")


def test_right_and_wrong_up_axis_of_real_scenes(real_data):
    tried = 0
    for path in sorted(glob.glob(f"{real_data}/scenes/**/*.*", recursive=True)):
        if not path.endswith((".glb", ".obj")):
            continue
        up = "z" if "simple_room" in path else "y"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene, other = (load_scene(path, axis) for axis in (up, "y" if up == "z" else "z"))
        try:
            navmesh = load_navmesh(scene)
        except PrnavError:
            continue
        check_fit(navmesh, scene, path)
        with pytest.raises(NavMeshError, match="has a floor under"):
            check_fit(navmesh, other, path)
        tried += 1
    assert tried >= 3


def office():
    """A closed house, walls 30 cm thick, with a roof that one can stand on, and a yard of no account."""
    walls = [(0, 12, 0, 3, 0, 0.3), (0, 12, 0, 3, 7.7, 8), (0, 0.3, 0, 3, 0, 8), (11.7, 12, 0, 3, 0, 8)]
    return mesh_of((-1, 13, -0.2, 0, -1, 9), (0, 12, 3, 3.3, 0, 8), *walls)


def test_roofs_are_told_from_rooms():
    scene = office()
    navmesh = NavMesh.build(scene)
    floors = indoor_floors(navmesh, scene)
    points = navmesh.random_points(2000, 0)
    islands = navmesh.island_of(points)
    inside = (np.abs(points[:, 1]) < 1) & (points[:, 0] > 0.3) & (points[:, 0] < 11.7) & (points[:, 2] > 0.3)
    inside &= points[:, 2] < 7.7
    roof = points[:, 1] > 2
    fit = floors.fit(points, islands)
    assert inside.sum() > 300 and roof.sum() > 300
    assert fit[inside].all() and not fit[roof].any()


def test_scenes_without_rooms_have_no_roofs():
    yard = mesh_of((0, 20, -0.2, 0, 0, 20), (25, 40, 3, 3.3, 0, 10))
    navmesh = NavMesh.build(yard)
    assert indoor_floors(navmesh, yard).islands.all()


def test_rules_of_roofs():
    areas = np.array([100.0, 80.0, 5.0, 3.0])
    covers = np.array([[0.0, 0.0], [1.0, 1.0], [0.1, 0.9], [np.nan, np.nan]])  # roof, room, balcony, small
    kept, checked = roofless(areas, covers)
    assert kept.tolist() == [False, True, True, True] and checked.tolist() == [False, False, True, False]
    kept, checked = roofless(np.array([1000.0, 10.0]), np.array([[0.0, 0.1], [1.0, 1.0]]))  # a field and a hut
    assert kept.all() and not checked.any()
    kept, checked = roofless(np.array([100.0, 50.0]), np.array([[0.0, 1.0], [0.0, 0.0]]))  # no ceiling, but walls
    assert kept.tolist() == [True, False] and not checked.any()


def test_a_step_without_sliding_from_beside_the_floor_ends_on_its_edge():
    navmesh = NavMesh.build(mesh_of((0, 6, -0.2, 0, 0, 6)))
    edge = navmesh.snap([[-1.0, 0, 3]])[0]
    for gap in (0.02, 0.13, 0.5):
        start = edge - [gap, 0, 0]
        for end in (start + [0.25, 0, 0], start - [0.25, 0, 0], start + [0, 0, 0.25]):
            got, collided = navmesh.step([start], [end], sliding=False)
            assert np.abs(got[0] - edge).max() < 1e-5 and bool(collided[0]) == (gap < 0.24)
        slid, _ = navmesh.step([start], [start + [gap + 0.1, 0, 0]], sliding=True)
        assert slid[0, 0] > edge[0] + 0.09
    for tiny in (0.0, 1e-5):
        got, _ = navmesh.step([edge - [tiny, 0, 0]], [edge + [0.25, 0, 0]], sliding=False)
        assert got[0, 0] > edge[0] + 0.24


@pytest.mark.parametrize("name", ["osrf_servicesim/servicesim_office.glb", "dream_apartment/dream_apartment.glb"])
def test_no_episode_starts_on_a_roof_of_real_scenes(real_data, name):
    scene = load_scene(real_data / "scenes" / name)
    navmesh = load_navmesh(scene)
    floors = indoor_floors(navmesh, scene)
    table = generate_table(navmesh, "a", 200, 0, floors=floors)
    everywhere = generate_table(navmesh, "a", 200, 0)
    roofs = [int((t.start_position[:, 1] > 2.0).sum()) for t in (table, everywhere)]
    assert roofs[0] == 0 and roofs[1] > 10
    for points in (table.start_position, table.goal_position):
        assert floors.fit(points, navmesh.island_of(points)).all()
    asked = GenerationConfig(roofs=True)
    same = generate_table(navmesh, "a", 200, 0, asked, floors=floors)
    assert (same.start_position == everywhere.start_position).all()
