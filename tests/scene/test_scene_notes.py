"""What was not found or left out is said on every load, by the commands too."""

import json

import pytest
from mesh_cases import SQUARE, picture, write

from prnav.cli.scenes import main
from prnav.errors import SceneNote
from prnav.scene import load_scene

TEXT = "mtllib a.mtl\n" + SQUARE + "usemtl m\nf 1/1 2/2 3/3 4/4\n"
MTL = "newmtl m\nKd 1 0 0\nmap_Kd gone.png\n"
NOTE = "'gone.png' is missing, what it colours stays plain"


@pytest.fixture
def mesh(tmp_path, monkeypatch):
    monkeypatch.setenv("PRNAV_CACHE", str(tmp_path / "cache"))
    (tmp_path / "in").mkdir()
    return write(tmp_path / "in", a_obj=TEXT, a_mtl=MTL)


def test_every_load_gives_the_notes_cached_or_not(mesh):
    for _ in range(3):
        with pytest.warns(SceneNote, match=r"scene .*a\.obj: 'gone\.png' is missing"):
            scene = load_scene(mesh)
        assert scene.notes == (NOTE,)
    (mesh.parent / "gone.png").write_bytes(picture())
    assert load_scene(mesh).notes == ()


def test_notes_do_not_change_the_hash(mesh):
    with pytest.warns(SceneNote):
        lacking = load_scene(mesh)
    (mesh.parent / "a.mtl").write_text("newmtl m\nKd 1 0 0\n")
    assert load_scene(mesh).hash == load_scene(mesh).hash != ""
    assert lacking.colors.tolist() == load_scene(mesh).colors.tolist()


def test_an_explicit_root_is_another_scene_in_the_cache(mesh):
    (mesh.parent / "a.mtl").write_text("newmtl m\nmap_Kd ../p.png\n")
    (mesh.parent.parent / "p.png").write_bytes(picture())
    with pytest.warns(SceneNote, match="lies outside the mesh's folder"):
        assert load_scene(mesh).atlas.num_textures == 1
    assert load_scene(mesh, root=mesh.parent.parent).atlas.num_textures == 2
    with pytest.warns(SceneNote, match="lies outside"):
        assert load_scene(mesh).atlas.num_textures == 1


def test_info_prints_them_and_writes_them(mesh, tmp_path, capsys):
    assert main(["info", str(mesh), "--json", str(tmp_path / "info.json")]) == 0
    printed = capsys.readouterr()
    assert f"note       {NOTE}\n" in printed.out and "gone.png" not in printed.err
    found = json.loads((tmp_path / "info.json").read_text())
    assert found["notes"] == [NOTE] and found["triangles"] == 2 and found["walkable"] is None


def test_other_commands_say_them_once(mesh, tmp_path, capsys):
    assert main(["export", str(mesh), "--out", str(tmp_path / "a.glb")]) == 0
    assert capsys.readouterr().err.count(f"prnav: note: scene {mesh}: {NOTE}\n") == 1


def test_check_prints_them_and_takes_a_root(mesh, tmp_path, capsys):
    assert main(["check", str(mesh.parent), "--json", str(tmp_path / "check.json")]) == 0
    assert f"note    a.obj: {NOTE}\n" in capsys.readouterr().out
    (entry,) = json.loads((tmp_path / "check.json").read_text())["files"]
    assert entry["warnings"] == [NOTE] and NOTE in entry["notes"] and entry["status"] == "good"
    (mesh.parent / "a.mtl").write_text("newmtl m\nmap_Kd ../p.png\n")
    (tmp_path / "p.png").write_bytes(picture())
    assert main(["check", str(mesh.parent), "--data-root", str(tmp_path)]) == 0
    assert "note" not in capsys.readouterr().out
