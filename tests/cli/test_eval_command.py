import json
import shutil
from pathlib import Path

import pytest

import prnav
from prnav.catalog import task_spec
from prnav.cli import eval as command
from prnav.cli.report import main as report
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig
from prnav.domains.navigation.targetnav import TargetNavConfig, TargetNavEnvConfig


def test_measures_intervals_records_and_picture(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(["--agent", "shortest-path", "--split", "val", "--episodes", "2", "--json", "out.json"]) == 0
    printed = capsys.readouterr().out
    assert "shortest-path on val, 2 episodes" in printed
    assert "SPL" in printed
    result = json.loads((tmp_path / "out.json").read_text())
    assert result["episodes"] == 2
    assert (result["agent"], result["actions"], result["split"]) == ("shortest-path", "rule", "val")
    assert result["version"] == prnav.__version__
    spl = result["measures"]["spl"]
    assert 0.5 < spl["low"] <= spl["mean"] <= spl["high"] <= 1.0
    folder = tmp_path / "runs" / "shortest-path" / "eval" / "val-2"
    assert len((folder / "records.jsonl").read_text().splitlines()) == 2
    assert (folder / "trajectories.png").read_bytes().startswith(b"\x89PNG")
    assert report([str(tmp_path / "runs" / "shortest-path")]) == 0
    assert (tmp_path / "runs" / "shortest-path" / "report.html").read_text().startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--run", "nothing"], "run nothing: there is no such folder; give one that prnav-train made (--run DIR)"),
        (["--split", "val"], "no agent given; give --run DIR or --agent NAME (or --verify FILE)"),
        (
            ["--agent", "random", "--target", "invisible"],
            "pointgoal has no target that can be seen",
        ),
        (
            ["--agent", "goal-follower", "--task", "targetnav", "--split", "val", "--episodes", "1"],
            "agent 'goal-follower' needs a goal, and targetnav shows none; valid there: shortest-path, random, forward",
        ),
        (["--verify", "no.json"], "no.json: cannot be read"),
        (["--agent", "random", "--split", "tset"], "tset"),
        (["--agent", "random", "--scene", "house.glb"], "give --episodes-file too"),
        (["--agent", "random", "--episodes-file", "none.json.gz"], "none.json.gz"),
        (["--agent", "random", "--split", "val", "--episodes", "1", "--device", "gpu"], "--device 'gpu' is not known"),
    ],
)
def test_mistakes_end_in_one_line(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert captured.out == ""
    assert not list(tmp_path.iterdir())


def test_folders_are_named_for_what_was_asked():
    def folder(actions, *arguments, several=False, rules=None):
        options = command.parser().parse_args(arguments)
        entry = command.Entry("random", Path("runs/a"), actions)
        config = TargetNavEnvConfig(scenes="test", rules=rules) if rules else PointGoalEnvConfig(scenes="test")
        name = command._folder_name(entry, options, task_spec(config.kind.name), config)
        return str(command._directory(entry, options, name, several))

    assert folder(None) == "runs/a/eval/test"
    assert folder("sampled", "--episodes", "9") == "runs/a/eval/test-sampled-9"
    assert folder("greedy", "--seed", "3") == "runs/a/eval/test-greedy-seed3"
    assert folder("sampled", rules=TargetNavConfig(visible=False)) == "runs/a/eval/test-sampled-invisible"
    assert folder(None, rules=TargetNavConfig()) == "runs/a/eval/targetnav-test"
    assert folder("greedy", "--out", "x") == "x"
    assert folder("greedy", "--out", "x", several=True) == "x/a-test-greedy"


def test_several_agents_are_compared_and_results_verified(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ["--agent", "blind", "--agent", "random", "--task", "targetnav", "--split", "val", "--episodes", "3"]
    assert command.main([*asked, "--json", "out.json", "--submit"]) == 0
    printed = capsys.readouterr().out
    assert "difference to blind, paired by episode" in printed
    told = json.loads((tmp_path / "out.json").read_text())
    assert (told["agent"], told["task"], told["target"], told["sliding"]) == ("blind", "targetnav", "visible", True)
    assert told["body"] == {"radius": 0.1, "height": 1.5}
    assert [head["agent"] for head in told["evaluations"]] == ["blind", "random"]
    (difference,) = told["differences"]
    gap = told["evaluations"][1]["measures"]["spl"]["mean"] - told["measures"]["spl"]["mean"]
    assert difference["measures"]["spl"]["mean"] == pytest.approx(gap)
    result = tmp_path / "runs" / "blind" / "eval" / "targetnav-val-3" / "submission.json"
    assert command.main(["--verify", str(result)]) == 0
    assert "every measure follows from the records" in capsys.readouterr().out
    elsewhere = tmp_path / "mail.json"
    shutil.copy(result, elsewhere)
    assert command.main(["--verify", str(elsewhere), "--records", str(result.parent)]) == 0
    assert command.main(["--verify", str(elsewhere)]) == 2
    assert "evaluation.json: cannot be read" in capsys.readouterr().err
