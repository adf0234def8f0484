import json
import re

import pytest

from prnav.cli.episodes import main
from prnav.episodes import load_episodes

PLY = """ply
format ascii 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def write_floor(path, width=10.0):
    """An L-shaped floor as a mesh file."""
    squares = [(0, width, 0, 2), (0, 2, 2, 10)]
    points, faces = [], []
    for x0, x1, z0, z1 in squares:
        k = len(points)
        points += [(x0, 0, z0), (x0, 0, z1), (x1, 0, z1), (x1, 0, z0)]
        faces += [(k, k + 1, k + 2), (k, k + 2, k + 3)]
    body = [" ".join(map(str, point)) for point in points] + ["3 " + " ".join(map(str, face)) for face in faces]
    path.parent.mkdir(exist_ok=True)
    path.write_text(PLY.format(vertices=len(points), faces=len(faces)) + "\n".join(body) + "\n")
    return path


@pytest.fixture(scope="module")
def floor(tmp_path_factory):
    return write_floor(tmp_path_factory.mktemp("scenes") / "floor.ply")


def generate(*arguments):
    return main(["generate", *map(str, arguments)])


def test_generate_writes_what_check_finds_in_order(floor, tmp_path, capsys):
    assert generate("--scene", floor, "--split", "mine", "--per-scene", 12, "--seed", 3, "--out", tmp_path) == 0
    path = tmp_path / "mine" / "mine.json.gz"
    assert capsys.readouterr().out == f"{path}: 12 episodes in 1 scene\n"
    dataset = load_episodes(tmp_path, "mine")
    assert len(dataset.episodes) == 12 and dataset.scene_ids == ("floor.ply",)
    assert dataset.header["prnav"]["seed"] == 3
    assert main(["check", str(tmp_path), "--split", "mine", "--scene", str(floor)]) == 0
    assert "12 episodes in 1 scene, no problem" in capsys.readouterr().out
    assert main(["info", str(path)]) == 0
    assert re.search(r"geodesic +\d+\.\d+ to \d+\.\d+", capsys.readouterr().out)


def test_check_says_that_scenes_are_not_here(floor, tmp_path, capsys):
    generate("--scene", floor, "--split", "mine", "--per-scene", 2, "--out", tmp_path)
    assert main(["check", str(tmp_path)]) == 0
    assert "not tried, as 1 scene could not be opened: floor.ply" in capsys.readouterr().out
    assert main(["check", str(tmp_path), "--data-root", str(tmp_path)]) == 1
    assert "no problem" not in capsys.readouterr().out


def test_check_finds_another_scene_under_the_same_name(floor, tmp_path, capsys):
    generate("--scene", floor, "--split", "mine", "--per-scene", 2, "--out", tmp_path)
    other = write_floor(tmp_path / "other" / "floor.ply", width=11.0)
    assert main(["check", str(tmp_path), "--split", "mine", "--scene", str(other)]) == 1
    assert "belong to a scene with hash" in capsys.readouterr().out


def test_several_scenes_make_a_content_folder_that_never_mixes(floor, tmp_path, capsys):
    second = write_floor(floor.parent / "second.ply", width=12.0)
    arguments = ("--split", "mine", "--per-scene", 2, "--out", tmp_path)
    root = ("--data-root", floor.parent.parent)
    assert generate("--scene", floor, "--scene", second, *root, *arguments) == 0
    names = sorted(file.name for file in (tmp_path / "mine" / "content").iterdir())
    assert names == ["floor.json.gz", "second.json.gz"]
    assert load_episodes(tmp_path / "mine").scene_ids == (
        f"{floor.parent.name}/floor.ply",
        f"{floor.parent.name}/second.ply",
    )
    assert generate("--scene", floor, *arguments) == 2
    assert "holds episodes of other scenes (floor.json.gz)" in capsys.readouterr().err


def test_the_same_command_writes_the_same_bytes(floor, tmp_path):
    for name in ("a", "b"):
        generate("--scene", floor, "--split", "mine", "--per-scene", 3, "--out", tmp_path / name)
    assert (tmp_path / "a/mine/mine.json.gz").read_bytes() == (tmp_path / "b/mine/mine.json.gz").read_bytes()


def test_errors_are_one_line_and_leave_nothing_behind(floor, tmp_path, capsys):
    out = tmp_path / "out"
    cases = [
        (["--scene", str(tmp_path / "no.ply"), "--split", "mine"], "no.ply"),
        (["--scene", str(floor), "--split", "../mine"], "--split '../mine' cannot name a file"),
        (["--scene", str(floor), "--split", "m", "--data-root", str(tmp_path)], "not inside the data root"),
    ]
    for arguments, text in cases:
        assert generate(*arguments, "--per-scene", 2, "--out", out) == 2
        error = capsys.readouterr().err
        assert text in error and error.count("\n") == 1
    bad = tmp_path / "bad.json"
    bad.write_text(json.dumps({"episodes": [{}]}))
    assert main(["check", str(bad)]) == 2
    assert "episode 0: key 'episode_id' is missing" in capsys.readouterr().err
    assert main(["info", "builtin"]) == 2
    assert "add --split val or --split test" in capsys.readouterr().err
    assert not out.exists()


def test_numbers_out_of_range_are_refused(floor, tmp_path, capsys):
    with pytest.raises(SystemExit):
        generate("--scene", floor, "--split", "m", "--per-scene", 0, "--out", tmp_path)
    assert "'0' is not a whole number from 1 to" in capsys.readouterr().err
