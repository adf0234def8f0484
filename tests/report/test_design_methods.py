"""Searches side by side: what their folders say, as a table, a figure and JSON."""

import json

import numpy as np
import pytest

from prnav.cli.design import main
from prnav.errors import RecordError
from prnav.report.design_methods import draw_methods, methods


@pytest.fixture
def searches(tmp_path):
    """Two searches of two starts; the second one's designs gain 0.1 and 0.2."""
    rng = np.random.default_rng(0)
    for method, score, gain in (("joint", "generalist", 0.0), ("cmaes", "specialist", 0.1)):
        rows = [{"group": "generalist, initial 0", "design": "g", "measures": {"spl": [0.9] * 40}}]
        for start in range(2):
            place = tmp_path / method / f"start-{start}"
            place.mkdir(parents=True)
            facts = {"method": method, "score": score, "steps": 1000 + 10 * start, "trials": 8 * (method == "cmaes")}
            (place / "start.json").write_text(json.dumps({**facts, "initial": 0.2, "found": 0.2 + 2 * gain}))
            before = rng.uniform(0, 0.5, 40)
            for group, values in (("initial", before), ("optimised", before + gain * (start + 1))):
                rows.append({"group": f"{group} {start}", "design": "d", "measures": {"spl": values.tolist()}})
        (tmp_path / method / "results.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    return [tmp_path / "joint", tmp_path / "cmaes"]


def test_methods_are_rows(searches):
    joint, cmaes = methods(searches, "spl")
    assert (joint.name, joint.starts, joint.steps, joint.trials) == ("joint (generalist)", 2, 1005, 0)
    assert joint.gains.gain.mean == pytest.approx(0.0) and joint.gains.improved == 0
    assert cmaes.gains.gain.mean == pytest.approx(0.15) and cmaes.gains.improved == 2
    assert cmaes.specialist_found.mean - cmaes.specialist_initial.mean == pytest.approx(0.15)
    assert (cmaes.initial.mean, cmaes.found.mean) == pytest.approx((0.2, 0.4))
    again = methods([searches[1], searches[1]], "spl")
    assert [one.name for one in again] == ["cmaes (specialist)", "cmaes (specialist), cmaes"]
    assert len(draw_methods([joint, cmaes], "spl").axes) == 2


def test_what_is_no_search_is_one_error(searches):
    with pytest.raises(RecordError, match="no finished start in it"):
        methods([searches[0] / "start-0"], "spl")
    (searches[0] / "start-0" / "start.json").write_text("{")
    with pytest.raises(RecordError, match="not valid JSON"):
        methods(searches, "spl")


def test_compare_prints_one_table(searches, capsys):
    told = searches[0] / "told.json"
    assert main(["compare", *map(str, searches), "--kind", "methods", "--json", str(told)]) == 0
    printed = capsys.readouterr().out
    assert "(generalist)" in printed and "2 of 2" in printed and "…" not in printed
    assert (searches[0] / "methods.png").read_bytes().startswith(b"\x89PNG")
    assert [one["steps"] for one in json.loads(told.read_text())["methods"]] == [1005, 1005]
