import json
from pathlib import Path

import numpy as np
import pytest

from prnav.errors import SceneError
from prnav.scene import load_scene, resolve_scene, scene_ids


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("PRNAV_CACHE", str(folder))
    return lambda: sorted(folder.rglob("*.npz"))


def test_ids_of_the_splits():
    assert [len(scene_ids(split)) for split in ("train", "val", "test")] == [61, 8, 18]
    assert scene_ids("train")[60] == "prhouses/train/60"
    with pytest.raises(SceneError, match="split 'tset' is not .*valid: train, val, test"):
        scene_ids("tset")


def test_built_in_home_comes_out_of_the_cache_the_same(own_cache):
    first = load_scene("prhouses/val/03")
    assert first.name == "prhouses/val/03" and len(own_cache()) == 1
    second = load_scene("prhouses/val/03")
    assert second.hash == first.hash and len(own_cache()) == 1
    assert load_scene("prhouses/val/04").hash != first.hash


@pytest.mark.parametrize(
    "scene_id", ["prhouses/test/18", "prhouses/tset/01", "prhouses/test/1", "prhouses/test/01.glb"]
)
def test_ids_beyond_the_splits(scene_id):
    for use in (load_scene, resolve_scene):
        with pytest.raises(SceneError, match=r"is no built-in home; valid: prhouses/train/00 to 60, .*test/00 to 17"):
            use(scene_id)


def test_files_are_cached_by_content_axis_and_budget(quad, tmp_path, own_cache):
    path = quad.write(tmp_path / "quad.glb")
    first = load_scene(path)
    assert load_scene(str(path)).hash == first.hash and len(own_cache()) == 1
    quad.write(tmp_path / "copy.glb")
    copy = load_scene(tmp_path / "copy.glb")
    assert copy.hash == first.hash and copy.name == "copy.glb" and len(own_cache()) == 1
    assert load_scene(path, up="z").hash != first.hash and len(own_cache()) == 2
    load_scene(path, max_texture_size=7)
    assert len(own_cache()) == 3
    quad.document["nodes"][0]["translation"] = [1, 0, 0]
    assert load_scene(quad.write(path)).hash != first.hash and len(own_cache()) == 4


def test_side_files_count_for_the_cache(quad, tmp_path, own_cache):
    quad.document["buffers"][0]["uri"] = "quad.bin"
    path = tmp_path / "quad.gltf"
    path.write_text(json.dumps(quad.document))
    (tmp_path / "quad.bin").write_bytes(quad.buffer)
    first = load_scene(path)
    moved = np.frombuffer(quad.buffer, "<f4").copy()
    moved[2] += 1.0
    (tmp_path / "quad.bin").write_bytes(moved.tobytes())
    assert load_scene(path).hash != first.hash
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0 0\n")
    assert (load_scene(tmp_path / "a.obj").colors == [255, 0, 0]).all()
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 0 0 1\n")
    assert (load_scene(tmp_path / "a.obj").colors == [0, 0, 255]).all()


@pytest.fixture
def root(tmp_path):
    for name in ("gibson/Pablo.glb", "mp3d/a/a.glb", "scene_datasets/hm3d/b.glb"):
        (tmp_path / "root" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "root" / name).write_bytes(b"glTF")
    (tmp_path / "outside.glb").write_bytes(b"glTF")
    return (tmp_path / "root").resolve()


def test_built_in_ids_stand_for_themselves(root):
    assert resolve_scene("prhouses/test/03", root, [root / "03"]) == "prhouses/test/03"


@pytest.mark.parametrize(
    ("scene_id", "found"),
    [
        ("gibson/Pablo.glb", "gibson/Pablo.glb"),
        ("data/scene_datasets/gibson/Pablo.glb", "gibson/Pablo.glb"),
        ("data/scene_datasets/mp3d/a/a.glb", "mp3d/a/a.glb"),
        ("hm3d/b.glb", "scene_datasets/hm3d/b.glb"),
        ("data/scene_datasets/hm3d/b.glb", "scene_datasets/hm3d/b.glb"),
    ],
)
def test_ids_under_the_data_root(root, scene_id, found):
    assert resolve_scene(scene_id, root) == root / found
    assert resolve_scene(scene_id, str(root)) == root / found


def test_given_files_come_first_the_closest_of_them(root, tmp_path):
    near, far = root / "gibson" / "Pablo.glb", tmp_path / "Pablo.glb"
    far.write_bytes(b"glTF")
    assert resolve_scene("gibson/Pablo.glb", None, [far, near]) == near
    assert resolve_scene("gibson/Pablo.glb", root, [far]) == far
    assert resolve_scene("data/scene_datasets/mp3d/Pablo.glb", None, [near]) == near
    assert resolve_scene("gibson/Pablo.glb", root, [root / "mp3d/a/a.glb"]) == near
    with pytest.raises(SceneError, match="'other/Pablo.glb' fits 2 files alike .*give only one with --scene"):
        resolve_scene("other/Pablo.glb", None, [far, near])
    with pytest.raises(SceneError, match=r"scene 'x/gone.glb': gone.glb is no file"):
        resolve_scene("x/gone.glb", None, [Path("gone.glb")])


def test_what_is_not_found_says_where_it_was_looked_for(root):
    with pytest.raises(SceneError, match=r"'a/b.glb' is not found \(looked in: no --data-root and no --scene given\)"):
        resolve_scene("a/b.glb")
    with pytest.raises(SceneError) as caught:
        resolve_scene("a/b.glb", root, [root / "gibson/Pablo.glb"])
    assert f"1 files given with --scene, the data root {root}" in str(caught.value)
    assert str(caught.value).endswith("with --data-root DIR, or the mesh itself with --scene FILE")


@pytest.mark.parametrize(
    "scene_id", ["../outside.glb", "data/scene_datasets/../../../outside.glb", "/etc/hostname", "a\0b"]
)
def test_ids_stay_inside_the_root(root, scene_id):
    with pytest.raises(SceneError, match="leaves its data root|holds a zero byte"):
        resolve_scene(scene_id, root)
