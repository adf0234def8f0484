"""Statistics of designs' results against what is known, and every figure drawn once."""

import json

import numpy as np
import pytest

from prnav.errors import RecordError
from prnav.report.design_figures import FIGURES
from prnav.report.design_results import (
    ANALYSES,
    against_scores,
    correlation,
    gains,
    load_rows,
    performances,
    spearman,
    two_level_interval,
)


def row(group, design, values, task="pointgoal", seed=0):
    return {"group": group, "design": design, "task": task, "seed": seed, "measures": {"spl": list(values)}}


def some_rows(groups, tasks=("pointgoal",), units=2):
    rng = np.random.default_rng(0)
    rows = []
    for index, group in enumerate(groups):
        for task in tasks:
            rows += [row(group, f"d{index}", rng.uniform(0, 0.5 + 0.05 * index, 30), task, s) for s in range(units)]
    return rows


def test_intervals_cover_seeds_as_well_as_episodes():
    rng = np.random.default_rng(0)
    units = [rng.normal(mean, 0.1, 200) for mean in (0.2, 0.5, 0.8)]
    wide, narrow = two_level_interval(units), two_level_interval([np.concatenate(units)])
    assert wide.mean == pytest.approx(narrow.mean) and wide.low < 0.35 and wide.high > 0.65
    assert narrow.high - narrow.low < 0.1
    one = two_level_interval([units[0]])
    assert one.high - one.low == pytest.approx(4 * 0.1 / np.sqrt(200), rel=0.2)
    assert two_level_interval([units[0], units[1][:7]]).mean == pytest.approx(
        (units[0].mean() + units[1][:7].mean()) / 2
    )


def test_gains_are_paired_start_by_start():
    easy = np.linspace(0, 1, 40)
    rows = [row("initial 0", "a", easy), row("optimised 0", "b", easy + 0.1)]
    rows += [row("initial 1", "a", easy), row("optimised 1", "b", easy - 0.02), row("generalist, initial 0", "a", easy)]
    found = gains(rows, "spl")
    assert (found.improved, found.starts) == (1, ("0", "1"))
    assert found.gain.mean == pytest.approx(0.04) and found.gain.low == pytest.approx(-0.02)
    with pytest.raises(RecordError, match="no pair of groups"):
        gains(rows[:1], "spl")


def test_spearman_is_what_scipy_says():
    stats = pytest.importorskip("scipy.stats")
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, 6, 30).astype(float), rng.integers(0, 6, 30).astype(float)
    assert spearman(a, b) == pytest.approx(stats.spearmanr(a, b).statistic)
    assert np.isnan(spearman(a, np.ones(30)))
    names = [str(i) for i in range(10)]
    alike = correlation(names, range(10), [x**3 for x in range(10)])
    assert alike.rho.mean == pytest.approx(1.0) and alike.rho.low > 0.99
    with pytest.raises(RecordError, match="at least 3 designs"):
        correlation(["a"], [1], [1])


GROUPS = {
    "gain": ["initial 0", "optimised 0", "initial 1", "optimised 1"],
    "interpolation": ["0", "0.1", "0.4", "1"],
    "transfer": ["a", "b", "c", "d"],
}


@pytest.mark.parametrize("kind", ANALYSES)
def test_every_figure_is_drawn(kind):
    tasks = ("pointgoal", "targetnav") if kind == "transfer" else ("pointgoal",)
    rows = some_rows(GROUPS.get(kind, ["initial", "found", "y", "pitch"]), tasks)
    for one in rows:
        one["measures"]["success"] = one["measures"]["spl"]
    figure = FIGURES[kind](ANALYSES[kind](rows, "spl"), "spl")
    figure.canvas.draw()
    assert figure.axes


def test_proxy_scores_are_held_against_performance():
    rows = some_rows(["a", "b", "c", "d"])
    scores = {f"d{i}": {"score": float(i)} for i in range(3)}  # d3 has none
    found = against_scores(rows, scores, "spl")
    assert found.names == ("d0", "d1", "d2") and found.rho.mean == pytest.approx(1.0)
    FIGURES["proxy"](found, "spl").canvas.draw()
    assert FIGURES.keys() == ANALYSES.keys() | {"proxy"}


def test_rows_are_read_and_mistakes_are_one_line(tmp_path):
    path = tmp_path / "results.jsonl"
    path.write_text("".join(json.dumps(one) + "\n" for one in some_rows(["a", "b"])))
    found = performances(load_rows([tmp_path]), "spl")
    assert [one.group for one in found] == ["a", "b"] and found[0].units.shape == (2,)
    with pytest.raises(RecordError, match="has no measure 'sp'; it has spl"):
        performances(load_rows([path]), "sp")
    path.write_text("{}\n")
    with pytest.raises(RecordError, match="line 1: 'group' is missing"):
        load_rows([tmp_path])
    with pytest.raises(RecordError, match="none: cannot be read"):
        load_rows([tmp_path / "none"])
    path.write_text("")
    with pytest.raises(RecordError, match="no line in them"):
        load_rows([tmp_path])
