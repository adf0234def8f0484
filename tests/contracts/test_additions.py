"""Tasks, encoders, memories and searches are added by one module and one line each, and go through the commands."""

import json
import math

import pytest

from prnav.cli import design as design_command
from prnav.cli import eval as eval_command
from prnav.cli import report as report_command
from prnav.cli import train as train_command
from prnav.contracts import BatchEnv, EpisodeSlots
from prnav.design.methods import METHODS
from prnav.policy import ENCODERS, MEMORIES
from prnav.train import read_metrics


def train(config, run, *settings):
    """Status of a run through prnav-train's own code path, and its metrics."""
    status = train_command.main(["reach", "--config", str(config), "--run", str(run), *settings])
    return status, read_metrics(run)


def test_the_task_keeps_the_contracts(reach):
    from prnav.catalog import task_spec

    spec = task_spec("reach")
    config = spec.config_type()
    world = spec.load(config)
    assert isinstance(spec.make_envs(config, world, 3), BatchEnv)
    assert isinstance(spec.make_slots(config, world, 3), EpisodeSlots)


def test_a_task_with_continuous_actions_is_trained_resumed_evaluated_and_reported(
    reach, reach_config, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    status, rows = train(reach_config, whole)
    assert status == 0 and rows[-1]["step"] == 1920
    assert {"success", "steps", "reward"} <= rows[-1]["measures"].keys() and "validation" in rows[-1]
    assert all(math.isfinite(value) for row in rows for value in row["losses"].values())

    train(reach_config, parts, "--steps", "960")
    assert train_command.main(["reach", "--config", str(reach_config), "--run", str(parts), "--resume"]) == 0
    assert [row["losses"] for row in read_metrics(parts)] == [row["losses"] for row in rows]

    told = tmp_path / "told.json"
    agents = ["--agent", "straight", "--task", "reach", "--run", str(whole)]
    assert eval_command.main([*agents, "--actions", "sampled", "--json", str(told), "--submit"]) == 0
    results = json.loads(told.read_text())["evaluations"]
    by_agent = {result["agent"]: result["measures"] for result in results}
    assert by_agent["straight"]["success"]["mean"] == 1.0 and set(by_agent) == {"straight", "whole"}
    assert eval_command.main(["--verify", str(next(whole.rglob("submission.json")))]) == 0

    page = tmp_path / "page.html"
    assert report_command.main([str(whole), "--out", str(page)]) == 0
    assert "Distance to the mark" in page.read_text()


def test_settings_of_the_task_are_checked(reach, reach_config, tmp_path, capsys):
    assert train_command.main(["reach", "--config", str(reach_config), "env.lenght=3", "--run", str(tmp_path)]) == 2
    assert "did you mean env.length?" in capsys.readouterr().err


def test_an_encoder_is_added_by_one_line(reach, reach_config, tmp_path, monkeypatch):
    monkeypatch.setitem(ENCODERS, "sine", "new_encoder:SineEncoder")
    status, rows = train(reach_config, tmp_path / "run", "policy.encoder=sine", "validate_steps=0", "total_steps=480")
    assert status == 0 and rows[-1]["step"] == 480


def test_a_memory_is_added_by_one_line(reach, reach_config, tmp_path, monkeypatch):
    monkeypatch.setitem(MEMORIES, "doubling", "new_memory:DoublingMemory")
    run = tmp_path / "run"
    status, rows = train(reach_config, run, "policy.memory=doubling", "validate_steps=0", "total_steps=480")
    assert status == 0 and rows[-1]["step"] == 480


@pytest.mark.parametrize("field", ["encoder", "memory"])
def test_what_is_not_registered_is_refused_with_what_is(reach, reach_config, tmp_path, capsys, field):
    arguments = ["reach", "--config", str(reach_config), "--run", str(tmp_path / "run"), f"policy.{field}=nonsense"]
    assert train_command.main(arguments) == 2
    told = capsys.readouterr().err
    assert f"{field} is 'nonsense'; valid: " in told and "'stack'" in told or "'camera'" in told


SEARCH = """
name = "nudges"
method = "nudge"
initial = "forward"
measure = "reward"
starts = 2
judge = false

[train]
task = "reach"
"""


def test_a_search_is_added_by_one_line(reach, tmp_path, monkeypatch, capsys):
    path, out = tmp_path / "search.toml", tmp_path / "found"
    path.write_text(SEARCH, encoding="utf-8")
    arguments = ["optimize", "--config", str(path), "--out", str(out)]
    assert design_command.main(arguments) == 2
    assert "method is 'nudge'; valid: 'joint'" in capsys.readouterr().err
    monkeypatch.setitem(METHODS, "nudge", "new_search:NUDGE")
    assert design_command.main(arguments) == 0
    start = json.loads((out / "start-1" / "start.json").read_text())
    assert start["method"] == "nudge" and start["score"] == "proxy"
    assert start["found"] == max(start["scores"]) > start["initial"]
    assert (out / "design.toml").exists()


def test_a_measure_that_the_task_lacks_is_refused(reach, tmp_path, capsys):
    path = tmp_path / "search.toml"
    path.write_text(SEARCH.replace("nudge", "random").replace('"reward"', '"spl"'), encoding="utf-8")
    assert design_command.main(["optimize", "--config", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "measure is 'spl'; valid for reach: 'success', 'steps', 'reward'" in capsys.readouterr().err
