import json
import shutil

import numpy as np
import pytest
from data_trees import hssd, room, write_json, write_ply, write_room

from prnav.errors import SceneError
from prnav.navmesh import NavMesh, NavMeshSettings, scene_navmesh
from prnav.scene import load_scene, open_scene_set
from prnav.scene.scene_file import AssetFrame


def bounds(place):
    return load_scene(place).bounds.round(4).tolist()


FLOOR = [[0, 0, 0], [6, 0, 4]]


def test_matterport_is_z_up_and_found_by_any_form_of_its_id(tmp_path):
    mesh = write_room(tmp_path / "data/scene_datasets/mp3d/17D/17D.glb", up="z")
    write_room(mesh.with_name("17D_semantic.glb"), up="z")
    for root in (tmp_path, tmp_path / "data"):
        scenes = open_scene_set("mp3d", root)
        assert scenes.scene_ids() == ["mp3d/17D/17D.glb"]
        for name in ("mp3d/17D/17D.glb", "data/scene_datasets/mp3d/17D/17D.glb", "17D", "17D.glb", "17D/17D.glb"):
            place = scenes.scene(name)
            assert place.path == mesh and place.scene_id == "mp3d/17D/17D.glb" and place.navmesh is None
        assert bounds(place) == FLOOR


def test_z_up_scene_of_a_set_is_the_same_arrays_as_the_bare_file(tmp_path):
    mesh = write_room(tmp_path / "scene_datasets/gibson/Pablo.glb", up="z")
    place = open_scene_set("gibson", tmp_path).scene("Pablo")
    assert load_scene(place).hash == load_scene(mesh, up="z").hash == load_scene(mesh, "z").hash


def test_hm3d_names_versions_and_navmeshes(tmp_path):
    folder = tmp_path / "scene_datasets/hm3d_v0.2"
    plain = write_room(folder / "val/00800-TEE/TEE.glb", up="z")
    write_room(folder / "val/00800-TEE/TEE.semantic.glb")
    only = write_room(folder / "minival/00801-Hax/Hax.basis.glb", up="z")
    only.with_name("Hax.basis.navmesh").write_bytes(b"x")
    plain.with_name("TEE.basis.navmesh").write_bytes(b"x")
    scenes = open_scene_set("hm3d", tmp_path)
    assert scenes.scene_ids() == ["hm3d_v0.2/minival/00801-Hax/Hax.basis.glb", "hm3d_v0.2/val/00800-TEE/TEE.glb"]
    assert scenes.scene_ids("val") == ["hm3d_v0.2/val/00800-TEE/TEE.glb"]
    for name in ("hm3d/val/00800-TEE/TEE.basis.glb", "TEE", "00800-TEE"):
        place = scenes.scene(name)
        assert place.path == plain and place.navmesh.name == "TEE.basis.navmesh"
    assert scenes.scene("hm3d/minival/00801-Hax/Hax.basis.glb").navmesh.name == "Hax.basis.navmesh"
    with pytest.raises(SceneError, match="no scenes of split 'train' in .*hm3d_v0.2"):
        scenes.scene_ids("train")


@pytest.mark.parametrize("decoder", [False, True])
def test_basis_file_counts_where_it_can_be_decoded(tmp_path, monkeypatch, decoder):
    monkeypatch.setattr("prnav.scene.decoders.available", lambda extension: decoder)
    folder = tmp_path / "scene_datasets/hm3d/train/00000-abc"
    write_room(folder / "abc.glb", up="z")
    write_room(folder / "abc.basis.glb", up="z")
    name = "abc.basis.glb" if decoder else "abc.glb"
    assert open_scene_set("hm3d", tmp_path).scene_ids() == [f"hm3d/train/00000-abc/{name}"]


def test_replica_is_a_z_up_ply_with_its_navmesh_in_habitat(tmp_path):
    mesh = write_ply(tmp_path / "scene_datasets/replica/room_0/mesh.ply", up="z")
    navmesh = mesh.parent / "habitat/mesh_semantic.navmesh"
    navmesh.parent.mkdir()
    NavMesh.build(room()).save(navmesh)
    place = open_scene_set("replica", tmp_path).scene("room_0")
    assert place.path == mesh and place.navmesh == navmesh
    scene = load_scene(place)
    assert bounds(place) == FLOOR and len(scene.faces) == 2 and (scene.colors == [200, 100, 50]).all()


def test_navmesh_beside_the_scene_counts_unless_told_otherwise(tmp_path):
    mesh = write_room(tmp_path / "scene_datasets/gibson/Pablo.glb", up="z")
    scenes = open_scene_set("gibson", tmp_path)
    scene = load_scene(scenes.scene("Pablo"))
    settings = NavMeshSettings()
    built, origin = scene_navmesh(scenes.scene("Pablo"), scene, settings)
    assert origin == "built"
    small = NavMesh.build(room(width=3.0))
    small.save(mesh.with_suffix(".navmesh"))
    found, origin = scene_navmesh(scenes.scene("Pablo"), scene, settings)
    assert origin == "file Pablo.navmesh" and found.area == pytest.approx(small.area) and found.area < 0.6 * built.area
    again, origin = scene_navmesh(scenes.scene("Pablo"), scene, settings, use_files=False)
    assert origin == "built" and again.area == pytest.approx(built.area)
    mesh.with_suffix(".navmesh").write_bytes(b"MSET")
    with pytest.raises(Exception, match="Pablo.navmesh.*navmesh_files=false"):
        scene_navmesh(scenes.scene("Pablo"), scene, settings)


@pytest.mark.parametrize("where", ["beside", "data set", "config entry", "glb pattern"])
def test_stage_configs_say_how_a_stage_stands(tmp_path, where):
    folder = tmp_path / "scene_datasets/gibson"
    write_room(folder / "Pablo.glb")
    attributes = {"up": [0, 1, 0], "front": [0, 0, -1], "scale": [2, 2, 2], "origin": [10, 1, 0]}
    config = {"stages": {"default_attributes": attributes, "paths": {".glb": ["*.glb"]}}}
    if where == "beside":
        write_json(folder / "Pablo.stage_config.json", attributes)
    elif where == "data set":
        write_json(folder / "configs/Pablo.stage_config.json", {"render_asset": "../Pablo.glb", "scale": [2, 2, 2]})
        config = {"stages": {"default_attributes": attributes | {"scale": [5, 5, 5]}, "paths": {".json": ["configs"]}}}
    elif where == "config entry":
        entry = {"template_handle": "Pablo", "attributes": {"render_asset": "Pablo.glb", **attributes}}
        config = {"stages": {"paths": {".glb": ["*.glb"]}, "configs": [entry]}}
    if where != "beside":
        write_json(folder / "gibson.scene_dataset_config.json", config)
    place = open_scene_set("gibson", tmp_path).scene("Pablo")
    assert bounds(place) == [[10, 1, 0], [22, 1, 8]]


def test_any_frame_is_a_rotation_with_its_up_and_front():
    for up, front in (((0, 0, 1), (0, 1, 0)), ((0, -1, 0), (1, 0, 0)), ((1, 0, 0), (0, 0, 1)), ((0, 2, 0), (0, 0, -3))):
        matrix = AssetFrame(up=up, front=front).matrix()
        assert matrix[:3, :3] @ matrix[:3, :3].T == pytest.approx(np.eye(3))
        assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0)
        assert matrix[:3, :3] @ (np.array(up) / np.linalg.norm(up)) == pytest.approx([0, 1, 0])
        assert matrix[:3, :3] @ (np.array(front) / np.linalg.norm(front)) == pytest.approx([0, 0, -1])


@pytest.mark.parametrize(
    ("attributes", "text"),
    [
        ({"up": [0, 1, 0], "front": [0, 1, 0]}, "must be at right angles"),
        ({"up": [0, 0, 0], "front": [0, 1, 0]}, "neither zero nor infinite"),
        ({"scale": [1, 0, 1]}, "none of them 0"),
        ({"scale": 3}, "'scale' is 3; it must be 3 finite numbers"),
        ({"origin": [0, 1e300, 0]}, "'origin' is .*3 finite numbers"),
        ({"units_to_meters": -1}, "'units_to_meters' is -1; it must be a number above 0"),
    ],
)
def test_configs_that_place_nothing(tmp_path, attributes, text):
    folder = tmp_path / "scene_datasets/gibson"
    write_room(folder / "Pablo.glb")
    write_json(folder / "Pablo.stage_config.json", attributes)
    with pytest.raises(SceneError, match=f"Pablo.stage_config.json.*{text}"):
        open_scene_set("gibson", tmp_path).scene("Pablo")


def test_scene_instance_is_its_stage_with_its_objects(tmp_path):
    hssd(tmp_path)
    scenes = open_scene_set("hssd", tmp_path)
    assert scenes.scene_ids() == ["hssd-hab/scenes/102.scene_instance.json"]
    place = scenes.scene("102")
    assert len(place.objects) == 3
    scene = load_scene(place)
    assert len(scene.faces) == 8
    by_color = {tuple(c): scene.vertices[(scene.colors == c).all(axis=1)] for c in np.unique(scene.colors, axis=0)}
    stage, objects, door = by_color[200, 100, 50], by_color[10, 20, 30], by_color[1, 2, 3]
    assert np.ptp(stage, axis=0) == pytest.approx([6, 0, 4])
    # a quarter turn about y takes x to -z: 1 x 2 becomes 2 x 1, from its corner at (1, 0.5, 1)
    turned = np.stack([objects[:4].min(0), objects[:4].max(0)])
    assert turned == pytest.approx(np.array([[1, 0.5, 0], [3, 0.5, 1]]), abs=1e-6)
    # the centre of the other is where it is put
    assert (objects[4:].min(0) + objects[4:].max(0)) / 2 == pytest.approx([3, 0.5, 1])
    assert np.stack([door.min(0), door.max(0)]) == pytest.approx(np.array([[0, 1, 0], [2, 1, 3]]))


def test_composed_scene_is_cached_by_every_file_and_number(tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path / "cache"))
    folder = hssd(tmp_path)
    first = load_scene(open_scene_set("hssd", tmp_path).scene("102"))
    assert load_scene(open_scene_set("hssd", tmp_path).scene("102")).hash == first.hash
    assert len(list((tmp_path / "cache").rglob("*.npz"))) == 1
    write_room(folder / "objects/a/a1.glb", width=1.5, depth=2.0)
    second = load_scene(open_scene_set("hssd", tmp_path).scene("102"))
    path = folder / "scenes/102.scene_instance.json"
    values = json.loads(path.read_text())
    values["object_instances"][0]["translation"][0] = 1.25
    write_json(path, values)
    third = load_scene(open_scene_set("hssd", tmp_path).scene("102"))
    assert len({first.hash, second.hash, third.hash}) == 3


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"articulated_object_instances": [{"template_name": "fridge"}]}, r"1 articulated objects \(URDF\) cannot"),
        ({"object_instances": [{"template_name": "gone"}]}, "object 0: template 'gone' is not among the objects"),
        ({"object_instances": [{"template_name": "a1", "rotation": [0, 0, 0, 0]}]}, "is not a unit quaternion"),
        ({"object_instances": [{"template_name": "a1", "rotation": [0, 0, 1]}]}, "'rotation' is .*4 finite numbers"),
        ({"object_instances": "all"}, "'object_instances' is 'all'; it must be a list"),
        ({"stage_instance": {}}, "no 'template_name' in stages"),
    ],
)
def test_scene_instances_that_cannot_be_composed(tmp_path, change, text):
    path = hssd(tmp_path) / "scenes/102.scene_instance.json"
    write_json(path, json.loads(path.read_text()) | change)
    with pytest.raises(SceneError, match=f"102.scene_instance.json: .*{text}"):
        open_scene_set("hssd", tmp_path).scene("102")


def test_missing_object_mesh_names_it(tmp_path):
    (hssd(tmp_path) / "objects/a/a1.glb").unlink()
    with pytest.raises(SceneError, match="a1.glb: no such file"):
        load_scene(open_scene_set("hssd", tmp_path).scene("102"))


@pytest.mark.parametrize("asset", ["../../../secret.glb", "/etc/hostname", "a\0b"])
def test_configs_do_not_leave_the_data_set(tmp_path, asset):
    folder = hssd(tmp_path)
    write_room(tmp_path / "secret.glb")
    write_json(folder / "stages/102.stage_config.json", {"render_asset": asset})
    with pytest.raises(SceneError, match="leaves its data root|zero byte"):
        open_scene_set("hssd", tmp_path).scene("102")
    shutil.copy(folder / "stages/102.glb", folder / "x.glb")
    values = {"stages": {"paths": {".glb": ["../../../*.glb"]}}}
    write_json(folder / "hssd-hab.scene_dataset_config.json", values)
    with pytest.raises(SceneError, match="leaves its data root"):
        open_scene_set("hssd", tmp_path).scene("102")


@pytest.mark.parametrize("scene_id", ["../../../etc/passwd", "mp3d/../../x.glb", "/etc/passwd", "a\0b"])
def test_ids_do_not_leave_the_data_set(tmp_path, scene_id):
    write_room(tmp_path / "scene_datasets/mp3d/17D/17D.glb")
    with pytest.raises(SceneError, match="leaves its data root|zero byte"):
        open_scene_set("mp3d", tmp_path).scene(scene_id)


def test_a_linked_scene_is_found(tmp_path):
    real = write_room(tmp_path / "disk/Pablo.glb", up="z")
    folder = tmp_path / "scene_datasets/gibson"
    folder.mkdir(parents=True)
    (folder / "Pablo.glb").symlink_to(real)
    assert bounds(open_scene_set("gibson", tmp_path).scene("gibson/Pablo.glb")) == FLOOR


def test_a_link_to_another_disk_is_followed_and_one_that_a_file_names_is_not(tmp_path):
    """Links in a data root are its owner's; names in files are anybody's."""
    real = write_room(tmp_path / "disk/Pablo.glb", up="z")
    folder = tmp_path / "root/scene_datasets/gibson"
    folder.mkdir(parents=True)
    (folder / "Pablo.glb").symlink_to(real)
    assert bounds(open_scene_set("gibson", tmp_path / "root").scene("gibson/Pablo.glb")) == FLOOR
    (tmp_path / "mesh").mkdir()
    (tmp_path / "secret.mtl").write_text("newmtl m\nKd 1 0 0\n")
    (tmp_path / "mesh/a.mtl").symlink_to(tmp_path / "secret.mtl")
    (tmp_path / "mesh/a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.warns(UserWarning, match="outside the mesh's folder and is not read"):
        load_scene(tmp_path / "mesh/a.obj")


def test_what_is_missing_says_where_it_should_be(tmp_path):
    with pytest.raises(SceneError, match="no folder scene_datasets in it .*holds scene_datasets/ and datasets/"):
        open_scene_set("mp3d", tmp_path)
    (tmp_path / "scene_datasets").mkdir()
    with pytest.raises(SceneError, match="data set hm3d: no folder .*hm3d_v0.2 or .*hm3d; put it there, or a link"):
        open_scene_set("hm3d", tmp_path)
    with pytest.raises(SceneError, match="data set 'scannet' is not known; valid: mp3d, hm3d, gibson, replica, hssd"):
        open_scene_set("scannet", tmp_path)
    write_room(tmp_path / "scene_datasets/mp3d/17D/17D.glb")
    with pytest.raises(SceneError, match="'mp3d/x/x.glb' is not in data set mp3d at .*which has 1 scenes"):
        open_scene_set("mp3d", tmp_path).scene("mp3d/x/x.glb")
