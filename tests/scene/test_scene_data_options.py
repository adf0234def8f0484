"""One setting takes a data set in Habitat's layout from scenes to an evaluation."""

import json
import re

import pytest
from data_trees import hssd, room, write_room

from prnav.cli.episodes import main as episodes
from prnav.cli.eval import main as evaluate
from prnav.cli.scenes import main as scenes
from prnav.cli.train import configure, parser
from prnav.episodes.datasets import find_episodes
from prnav.errors import EpisodeError
from prnav.navmesh import NavMesh


@pytest.fixture
def gibson(tmp_path):
    """A root with two Gibson scenes, of which one has a navmesh of its own."""
    root = tmp_path / "root"
    pablo = write_room(root / "data/scene_datasets/gibson/Pablo.glb", up="z", width=8.0, depth=8.0)
    NavMesh.build(room(width=8.0, depth=8.0)).save(pablo.with_suffix(".navmesh"))
    write_room(root / "data/scene_datasets/gibson/Swormville.glb", up="z", width=9.0, depth=8.0)
    return root


def test_from_scenes_to_an_evaluation(gibson, tmp_path, capsys):
    where = ["--data", "gibson", "--data-root", str(gibson)]
    assert scenes(["list", *where]) == 0
    assert capsys.readouterr().out.split() == ["gibson/Pablo.glb", "gibson/Swormville.glb"]
    out = gibson / "data/datasets/pointnav/gibson/v1"
    assert episodes(["generate", *where, "--split", "val", "--per-scene", "3", "--out", str(out)]) == 0
    assert "6 episodes in 2 scenes\nnavmeshes: 1 from files, 1 built" in capsys.readouterr().out
    assert find_episodes("gibson", gibson, "val") == out / "val/val.json.gz"
    assert episodes(["check", str(out), *where]) == 0
    assert "6 episodes in 2 scenes, no problem" in capsys.readouterr().out
    run = tmp_path / "run"
    assert evaluate(["--agent", "shortest-path", *where, "--out", str(run), "--json", str(tmp_path / "r.json")]) == 0
    assert "navmesh  1 from files, 1 built" in capsys.readouterr().out
    result = json.loads((tmp_path / "r.json").read_text())
    assert result["navmeshes"] == {"gibson/Pablo.glb": "file Pablo.navmesh", "gibson/Swormville.glb": "built"}
    assert result["split"] == "gibson-val" and result["measures"]["success"]["mean"] == 1.0
    built = [*where, "--navmesh-from", "build", "--out", str(tmp_path / "b"), "--json", str(tmp_path / "b.json")]
    assert evaluate(["--agent", "shortest-path", *built]) == 0
    assert set(json.loads((tmp_path / "b.json").read_text())["navmeshes"].values()) == {"built"}


def test_check_opens_scenes_as_their_data_set_has_them(gibson, capsys):
    assert scenes(["check", str(gibson), "--data", "gibson"]) == 0
    path = gibson / "data/scene_datasets/gibson/Swormville.navmesh"
    far = room()
    far.vertices[:] += 1000.0
    NavMesh.build(far).save(path)
    assert scenes(["check", str(gibson), "--data", "gibson"]) == 1
    out = capsys.readouterr().out
    assert "Swormville.glb: navmesh Swormville.navmesh: scene Swormville.glb has a floor under 0 %" in out


def test_info_and_export_of_a_composed_scene(tmp_path, capsys):
    hssd(tmp_path)
    where = ["--data", "hssd", "--data-root", str(tmp_path)]
    assert scenes(["info", "102", *where]) == 0
    out = capsys.readouterr().out
    assert "triangles  8 " in out and "navmesh    built" in out
    assert scenes(["export", "102", *where, "--out", str(tmp_path / "102.glb")]) == 0
    assert (tmp_path / "102.glb").is_file()


def test_training_takes_the_same_options(gibson):
    argv = ["pointgoal", "--data", "gibson", "--data-root", str(gibson), "--split", "val", "--navmesh-from", "build"]
    env = configure(parser().parse_intermixed_args(argv)).env
    assert (env.data, env.data_root, env.episode_split, env.navmesh_files) == ("gibson", str(gibson), "val", False)


@pytest.mark.parametrize(
    ("argv", "text"),
    [
        (["--data", "gibson"], "--data gibson needs --data-root DIR"),
        (["--navmesh-from", "build"], "--navmesh-from chooses among the files of a data set: give --data NAME"),
        (["--data", "gibson", "--data-root", "ROOT", "--scene", "x.glb"], "--scene and --data both say where"),
        (["--data", "mp3d", "--data-root", "ROOT"], "no episodes of split 'val' at .*mp3d.*prnav-episodes generate"),
    ],
)
def test_options_that_do_not_fit(gibson, capsys, argv, text):
    argv = [str(gibson) if word == "ROOT" else word for word in argv]
    assert evaluate(["--agent", "shortest-path", *argv]) == 2
    assert re.search(text, capsys.readouterr().err)


def test_episodes_say_which_splits_there_are(gibson):
    folder = gibson / "data/datasets/pointnav/gibson"
    for name in ("v2/train", "v1/train", "v1/val_mini"):
        (folder / name).mkdir(parents=True)
        (folder / name / f"{name.split('/')[1]}.json.gz").write_bytes(b"")
    assert find_episodes("gibson", gibson, "train") == folder / "v1/train/train.json.gz"
    with pytest.raises(EpisodeError, match=r"split 'test' at .*\(splits there: train, val_mini\); fetch them"):
        find_episodes("gibson", gibson, "test")
