import json

import pytest

import prnav
from prnav.cli import eval as command
from prnav.cli.report import main as report


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
    def folder(*arguments):
        return str(command._directory(command.parser().parse_args(arguments), "test"))

    assert folder("--agent", "random") == "runs/random/eval/test"
    assert folder("--run", "runs/a", "--episodes", "9") == "runs/a/eval/test-sampled-9"
    assert folder("--run", "runs/a", "--actions", "sampled", "--seed", "3") == "runs/a/eval/test-sampled-seed3"
