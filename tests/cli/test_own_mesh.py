"""From a mesh file to a score on held-out episodes, by the commands."""

import io
import json

import numpy as np
import pytest
from rich.console import Console

from prnav.cli import _progress
from prnav.cli._scene_views import island_views
from prnav.cli.bench import main as bench
from prnav.cli.episodes import main as episodes
from prnav.cli.eval import main as evaluate
from prnav.cli.scenes import main as scenes
from prnav.episodes import load_episodes
from prnav.episodes.files import episode_splits
from prnav.errors import SceneError
from prnav.evaluate.compare import Difference
from prnav.evaluate.intervals import Interval
from prnav.navmesh import Island
from prnav.report.tables import differences_table, that_fit
from prnav.scene import resolve_scene

ROOM = "v 0 0 0\nv 8 0 0\nv 8 0 6\nv 0 0 6\nf 4 3 2 1\nv 3 0 2\nv 5 0 2\nv 5 1 2\nv 3 1 2\nf 5 6 7 8\nf 8 7 6 5\n"


@pytest.fixture
def house(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "house.obj").write_text(ROOM)
    return "house.obj"


def test_two_splits_and_the_held_out_one_under_another_name(house, tmp_path, capsys):
    for split, seed in (("train", "0"), ("val", "1")):
        asked = ["generate", "--scene", house, "--split", split, "--per-scene", "20", "--seed", seed, "--out", "data"]
        assert episodes([*asked, "--workers", "1"]) == 0
    assert episode_splits("data") == ["train", "val"]
    starts = [{e.start_position for e in load_episodes("data", split).episodes} for split in ("train", "val")]
    assert not starts[0] & starts[1]
    (tmp_path / "renamed.obj").write_text(ROOM)
    asked = ["--agent", "shortest-path", "--episodes-file", "data", "--split", "val", "--scene", "renamed.obj"]
    assert evaluate([*asked, "--json", "out.json", "--out", "out"]) == 0
    result = json.loads((tmp_path / "out.json").read_text())
    assert result["episodes"] == 20 and result["measures"]["success"]["mean"] == 1.0
    assert episodes(["check", "data", "--split", "val", "--scene", "renamed.obj"]) == 0


def test_the_only_scene_file_serves_the_only_scene(house, tmp_path):
    assert resolve_scene("other.glb", None, [house], only=True) == tmp_path.__class__(house)
    with pytest.raises(SceneError, match="'other.glb' is not found"):
        resolve_scene("other.glb", None, [house])
    with pytest.raises(SceneError, match="'other.glb' is not found"):
        resolve_scene("other.glb", None, [house, "b.obj"], only=True)


def test_bench_of_ones_own_scan(house, capsys):
    assert bench(["sim", "--scene", house, "--seconds", "0.01", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {row["metric"] for row in rows} >= {"env_step_photoreceptors", "generate_episodes"}
    assert bench(["train", "--scene", house]) == 2
    assert "benchmark 'train' has scenes of its own; leave --scene out" in capsys.readouterr().err


def test_preview_of_all_islands(house, tmp_path, capsys):
    assert scenes(["preview", house, "--out", "a.png", "--views", "2", "--size", "16"]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


class _Floor:
    def __init__(self, *islands):
        self.islands = [Island(area, radius) for area, radius in islands]


def test_islands_to_photograph():
    floor = _Floor((100.0, 9.0), (50.0, 5.0), (20.0, 3.0), (1.0, 0.5))
    indoors = np.array([False, True, True, True])
    assert island_views(floor, indoors, 2) == [(1, 1), (2, 1)]
    assert island_views(floor, indoors, 3) == [(1, 1), (2, 1), (0, 1)]
    assert dict(island_views(floor, indoors, 11)) == {1: 7, 2: 3, 0: 1}
    assert island_views(_Floor((1.0, 0.5), (2.0, 0.7)), np.array([True, True]), 3) == [(1, 3)]


def test_progress_is_lines_where_there_is_no_terminal(monkeypatch):
    monkeypatch.setattr(_progress, "LINE_SECONDS", 0.0)
    stream = io.StringIO()
    with _progress.LineProgress(console=Console(file=stream)) as bars:
        task = bars.add_task("playing", total=2000)
        bars.update(task, completed=1500)
        bars.advance(task)
    assert stream.getvalue() == "playing  1,500 of 2,000\nplaying  1,501 of 2,000\n"


def test_wide_tables_keep_their_heads_at_80_columns():
    names = [f"runs/a-long-name-of-a-run-{k} sampled" for k in range(5)]
    interval = Interval(0.123, -0.045, 0.291)
    columns = [Difference(name, "runs/first", {"spl": interval, "success": interval}) for name in names]
    stream = io.StringIO()
    console = Console(file=stream, width=80)
    for part in that_fit(columns, console.width):
        console.print(differences_table(part))
    assert "…" not in stream.getvalue() and max(map(len, stream.getvalue().splitlines())) <= 80
    assert stream.getvalue().count("+0.123") == 10
    for k in range(5):
        assert f"run-{k}" in stream.getvalue()


def test_a_count_is_no_path(capsys):
    with pytest.raises(SystemExit):
        evaluate(["--agent", "random", "--episodes", "data"])
    assert "--episodes" in capsys.readouterr().err
