"""Every command, with an output that cannot be: one line, status 2, nothing half written."""

import importlib
import os
import sys

import pytest

COMMANDS = (
    "train",
    "eval",
    "eval json",
    "generate",
    "export",
    "preview",
    "navmesh",
    "check",
    "report",
    "show",
    "random",
)


def call(module, words, capsys):
    """Status and the lines on stderr of a command, called in this process."""
    capsys.readouterr()
    status = importlib.import_module(f"prnav.cli.{module}").main(words)
    return status, [line for line in capsys.readouterr().err.splitlines() if line.strip()]


def spoilt(kind, tmp_path):
    """A place that nothing can be written to."""
    (tmp_path / "file").write_text("mine")
    places = {
        "in a file": tmp_path / "file" / "x",
        "deep in a file": tmp_path / "file" / "x" / "y",
        "too long": tmp_path / ("x" * 300),
        "no file system": "/proc/self/x",
        "zero byte": f"{tmp_path}/a\0b",
    }
    return str(places[kind])


@pytest.mark.parametrize("kind", ["in a file", "too long", "no file system", "zero byte"])
@pytest.mark.parametrize("name", COMMANDS)
def test_outputs_that_cannot_be(place, tmp_path, capsys, name, kind):
    if kind == "no file system" and not os.path.isdir("/proc/self"):
        pytest.skip("no /proc here")
    module, words = place.commands(spoilt(kind, tmp_path))[name]
    status, lines = call(module, words, capsys)
    said = [line for line in lines if "error" in line]
    assert status == 2 and len(said) == 1, lines
    assert "unexpected" not in said[0] and "Traceback" not in "".join(lines)
    assert (tmp_path / "file").read_text() == "mine"
    assert not [path for path in tmp_path.rglob("*") if ".tmp" in path.name]


@pytest.mark.parametrize("name", ["train", "eval", "generate", "random"])
def test_a_file_where_a_folder_goes(place, tmp_path, capsys, name):
    (tmp_path / "file").write_text("mine")
    module, words = place.commands(str(tmp_path / "file"))[name]
    status, lines = call(module, words, capsys)
    assert status == 2 and len([line for line in lines if "error" in line]) == 1, lines
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("name", ["eval json", "report", "show", "check"])
def test_a_folder_where_a_file_goes(place, tmp_path, capsys, name):
    (tmp_path / "folder" / "mine").mkdir(parents=True)
    module, words = place.commands(str(tmp_path / "folder"))[name]
    status, lines = call(module, words, capsys)
    assert status == 2 and len([line for line in lines if "error" in line]) == 1, lines
    assert os.listdir(tmp_path / "folder") == ["mine"]


HOSTILE = '[/b]x a[bold]b $\\frac$ \N{GRINNING FACE} \N{LATIN SMALL LETTER U WITH DIAERESIS} :smile: a\'b "c"'
"""What markup, formulas, TOML and shells each take for something else."""


@pytest.mark.parametrize("name", ["eval", "generate", "show", "random", "report"])
def test_any_printable_name_is_a_name(place, tmp_path, capsys, name):
    text = HOSTILE
    module, words = place.commands(str(tmp_path / text))[name]
    assert importlib.import_module(f"prnav.cli.{module}").main(words) == 0
    told = "".join(capsys.readouterr().out.split())
    assert (tmp_path / text).exists()
    assert "".join(text.split()) in told


def test_a_run_by_any_name_is_trained_resumed_evaluated_and_shown(place, tmp_path, capsys, monkeypatch):
    name = HOSTILE
    from prnav.cli.eval import main as evaluate
    from prnav.cli.report import main as report
    from prnav.cli.train import main as train

    monkeypatch.chdir(tmp_path)
    run = str(tmp_path / name)
    words = ["pointgoal", "--config", str(place.config), "--run", run, f"name={name}"]
    assert train([*words, "--steps", "64"]) == 0
    assert name in capsys.readouterr().err
    assert train(["pointgoal", "--run", run, "--resume", "--steps", "128"]) == 0
    assert evaluate([*place.eval_words("--run", run), "--actions", "greedy", "--episodes", "2"]) == 0
    assert report([run]) == 0
    assert not [line for line in capsys.readouterr().err.splitlines() if "error" in line]


@pytest.mark.parametrize("value", ["a\x07b", "a\udcffb"])
def test_what_is_not_printable_is_refused_before_the_run_starts(place, tmp_path, capsys, value):
    from prnav.cli.train import main as train

    words = ["pointgoal", "--config", str(place.config), "--run", str(tmp_path / "run"), f"name={value}"]
    status, lines = 2, []
    status = train(words)
    lines = capsys.readouterr().err.splitlines()
    assert status == 2 and len(lines) == 1 and "name" in lines[0]
    assert not (tmp_path / "run").exists()


BIG = str(10**18)


@pytest.mark.parametrize(
    "setting",
    [
        *(
            f"{key}={value}"
            for key in ("env.rays_per_receptor", "env.grid", "env.camera_size", "policy.width", "threads", "window")
            for value in (BIG, "-" + BIG)
        ),
        f"env.episodes_per_scene={BIG}",
        f"num_envs={BIG}",
        f"ppo.rollout_steps={BIG}",
        f"total_steps={BIG}",
        f"seed={10**30}",
        "threads=" + "9" * 5000,
        "threads=" + "[" * 100_000,
        "threads=1e18",
        "policy.width=nan",
        "env.design=" + "x" * 5000,
        "=3",
        "a.b.c=3",
        "name=" + "x" * 100_000,
    ],
    ids=lambda text: text[:40],
)
def test_numbers_beyond_reason_are_refused_at_once(place, tmp_path, capsys, setting):
    from prnav.cli.train import main as train

    status = train(["pointgoal", "--config", str(place.config), "--run", str(tmp_path / "run"), setting])
    lines = capsys.readouterr().err.splitlines()
    assert status == 2 and len(lines) == 1 and len(lines[0]) < 700, lines
    assert "unexpected" not in lines[0]
    assert not (tmp_path / "run").exists()


def test_a_run_that_needs_more_memory_than_there_is_says_so(place, tmp_path, capsys):
    from prnav.cli.train import main as train

    words = ["pointgoal", "--config", str(place.config), "--run", str(tmp_path / "run")]
    assert train([*words, "ppo.rollout_steps=100000", "num_envs=64", "env.grid=64"]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "error" in line]
    assert "GB" in line and "ppo.rollout_steps" in line


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_pipes_and_devices_are_no_configs(place, tmp_path, capsys):
    from prnav.cli.train import main as train

    os.mkfifo(tmp_path / "pipe.toml")
    for path in (tmp_path / "pipe.toml", "/dev/zero", tmp_path):
        assert train(["pointgoal", "--config", str(path), "--run", str(tmp_path / "run")]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_an_unknown_fault_is_one_line_and_its_traceback_is_there_to_be_asked_for(monkeypatch, capsys):
    from prnav.cli import report

    monkeypatch.setitem(sys.modules, "prnav.report.page", None)  # an ImportError where nobody expects one
    assert report.main(["run"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "unexpected" in line and "--debug shows where" in line
    assert report.main(["run", "--debug"]) == 2
    assert "Traceback" in capsys.readouterr().err
