import numpy as np
import pytest

from prnav.bench import table
from prnav.bench.navmesh import _connected_pairs, _PortalGraphs
from prnav.bench.scaling import cluttered_room, split_triangles
from prnav.errors import ConfigError, RenderError
from prnav.navmesh import load_navmesh
from prnav.scene import load_scene


def test_rates_count_what_was_done_after_the_first_call():
    calls = []

    def work():
        calls.append(None)
        return 10 if len(calls) == 1 else 1000

    assert table.rate(work, 0.0) > 1000
    assert len(calls) == 2


def test_rates_by_turns_count_what_each_did_after_its_first_call():
    calls = []

    def work(name, amount):
        calls.append(name)
        return amount

    one, other = table.rates_by_turns((lambda: work("a", 1), lambda: work("b", 10**6)), 1e-9)
    assert other > one > 0
    assert calls[:4] == ["a", "b", "a", "b"]


def test_rows_are_lines_of_name_metric_value_unit():
    rows = [table.row("navmesh", "step", 123456.789, "steps/s"), table.row("navmesh", "build", 0.0123456, "s")]
    assert rows[0]["value"] == 123500.0
    assert set(rows[0]) == {"name", "metric", "value", "unit", "device", "version"}
    first, second = table.format_rows(rows).splitlines()
    assert first.split() == ["navmesh", "step", "123,500", "steps/s"]
    assert second.split() == ["navmesh", "build", "0.01235", "s"]


def test_unknown_benchmarks_are_named():
    with pytest.raises(ConfigError, match="benchmark 'speed' is not known; valid: navmesh"):
        table.measure("speed")
    assert {"navmesh", "sim"} <= set(table.available())


def test_a_device_is_for_benchmarks_that_have_one():
    with pytest.raises(ConfigError, match="benchmark 'navmesh' runs on the CPU; leave --device out"):
        table.measure("navmesh", device="cuda")
    with pytest.raises(RenderError, match="device 'cuda:99' is not on this machine"):
        table.measure("render", device="cuda:99")


def test_both_graphs_give_one_length_never_below_the_exact_one():
    navmesh = load_navmesh(load_scene("prhouses/val/00"))
    graphs = _PortalGraphs(navmesh)
    a, b = _connected_pairs(navmesh, 30)
    by_networkx, by_scipy = graphs.networkx_distances(a, b), graphs.scipy_distances(a, b)
    np.testing.assert_allclose(by_networkx, by_scipy, rtol=1e-9)
    assert (by_scipy >= navmesh.distances(a, b) * (1 - 5e-3)).all()
    assert np.isfinite(by_scipy).all()


def test_split_triangles_are_the_same_surfaces():
    mesh = cluttered_room(300)
    finer = split_triangles(mesh)
    assert len(finer.faces) == 4 * len(mesh.faces)
    corners = mesh.vertices[mesh.faces].astype(float)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners = finer.vertices[finer.faces].astype(float)
    parts = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    np.testing.assert_allclose(parts.reshape(4, -1), np.tile(area / 4, (4, 1)), rtol=1e-4)
