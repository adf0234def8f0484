import json

import pytest

from prnav.cli.design import main
from prnav.sensors import library_designs, load_design

TINY = [
    "specialist.steps=64",
    "specialist.episodes=2",
    "specialist.split=train",
    "train.num_envs=2",
    "train.total_steps=64",
    "train.imitation.steps=0",
    "train.imitation.mini_batches=1",
    "train.ppo.rollout_steps=16",
    "train.ppo.mini_batches=1",
    "train.policy.width=8",
    "train.policy.lstm_hidden=8",
    "train.env.max_scenes=1",
    "train.env.episodes_per_scene=4",
    "train.env.rules.max_steps=10",
]


def test_library_is_listed(capsys):
    assert main(["list"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in library_designs())


def test_a_design_is_drawn(tmp_path, capsys):
    path = tmp_path / "design.png"
    small = ["--size", "16", "--rays", "4", "--scene", "prhouses/val/00"]
    assert main(["show", "forward", "--out", str(path), *small]) == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert str(path) in capsys.readouterr().out


def test_random_designs_are_written_and_scored(tmp_path, capsys):
    assert main(["random", "--out", str(tmp_path), "--count", "2", "--sensors", "3", "--grid", "2", "--seed", "5"]) == 0
    design = load_design(tmp_path / "random-6.toml", sensors=3)
    assert design.grid == 2
    small = ["proxy.homes=4", "proxy.places=120", "proxy.features=16", "proxy.goals=1", "proxy.pose_homes=1"]
    told = tmp_path / "scores.json"
    assert main(["evaluate", "--proxy", str(tmp_path / "random-5.toml"), "forward", "--json", str(told), *small]) == 0
    assert json.loads(told.read_text()).keys() == {"random-5", "forward"}
    assert "forward" in capsys.readouterr().out


def test_a_sweep_is_worked_off_and_compared(tmp_path, capsys):
    out = tmp_path / "sweep"
    assert main(["sweep", "dropout", "--found", "forward", "--out", str(out), *TINY]) == 0
    assert "3 of 3 done" in capsys.readouterr().out
    assert main(["compare", str(out), "--json", str(tmp_path / "told.json")]) == 0
    assert (out / "dropout.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "told.json").read_text())["intervals"].keys() == {"all", "without 0", "without 1"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["show", "forwards", "--out", "x.png"], "'forwards' is not in the library"),
        (["show", "forward", "--scene", "nowhere.glb", "--out", "x.png"], "nowhere.glb"),
        (["sweep", "axes"], "the analysis axes is of one search; give --initial DESIGN --found DESIGN"),
        (["sweep", "gain", "--initial", "forward"], "1 initial and 0 found designs are no pairs"),
        (["compare", "nowhere"], "cannot be read"),
        (["optimize", "method=guess"], "method is 'guess'; valid: 'joint', 'random'"),
        (["list", "a=1"], "prnav-design list has no settings to change"),
    ],
)
def test_mistakes_end_in_one_line(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    printed = capsys.readouterr().err
    assert printed.count("\n") == 1 and message in printed
    assert not list(tmp_path.glob("*.png"))
