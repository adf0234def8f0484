"""Searches and plans from start to end on two homes, and the proxy against what must be true of it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from prnav.design.config import config_names, load_optimize_config
from prnav.design.optimize import Optimizer
from prnav.design.specialist import Judge
from prnav.design.sweep import collect, read_plan, work, write_plan
from prnav.domains.navigation.probe import Proxy, ProxyConfig
from prnav.errors import ConfigError
from prnav.regression import fit_and_test, r2
from prnav.sensors import Design, load_design, random_design
from prnav.train.config import config_names as train_config_names


@pytest.fixture(scope="module")
def proxy():
    from tiny_search import TINY

    weights = ("proxy.target=1", "proxy.pose=1")
    return Proxy.load(load_optimize_config("design-quick", (*TINY, *weights)).proxy)


def test_shipped_searches_are_read():
    assert "design-quick" in config_names() and not set(config_names()) & set(train_config_names())
    for name in config_names():
        load_optimize_config(name)
    paper = load_optimize_config("design-paper")
    joint = paper.joint
    assert (joint.frozen_rollouts, joint.control_rollouts, joint.design_rollouts) == (20_000, 400, 100)
    assert joint.policy.std == 0.2 and joint.schedule == "alternate" and paper.train.ppo.rollout_steps == 64
    with pytest.raises(ConfigError, match="config 'quick' is not known; valid: .*design-quick"):
        load_optimize_config("quick")


def test_the_proxy_knows_more_from_more_light(proxy):
    design = random_design(5, 2)
    parts = proxy.parts(design)
    assert parts.keys() == {"free", "way", "target", "pose"}
    assert parts == proxy.parts(design)  # the same bits
    assert proxy.score(design) == pytest.approx(sum(parts.values()) / 4)
    narrow = design.sensors.copy()
    narrow[:, 6] = np.radians(1.0)
    narrow[:, 4] = np.pi / 2  # at one spot of the ceiling
    assert proxy.parts(Design("dark", narrow, grid=1))["target"] < parts["target"]
    assert proxy.score(design, np.zeros((2, 7))) == proxy.score(design)
    assert proxy.config.cost_steps == 2 * 240 + 80


def test_free_distances_are_those_of_single_walks(proxy):
    places, world, config = proxy.places, proxy.world, proxy.config
    assert set(np.unique(places.scenes)) == {0, 1, 2, 3} and len(places.yaws) > 150
    for row in range(0, 60, 7):
        heading = places.yaws[row] + 2 * np.pi * np.arange(6) / 6
        ends = places.positions[row] + config.reach * np.stack([-np.sin(heading), 0 * heading, -np.cos(heading)], 1)
        navmesh = world.navmeshes[places.scenes[row]]
        stops, _ = navmesh.step(np.repeat(places.positions[row][None], 6, 0), ends, sliding=False)
        far = np.linalg.norm((stops - places.positions[row])[:, [0, 2]], axis=1)
        np.testing.assert_allclose(np.exp(places.free[row]) - 0.1, far, atol=1e-9)
        sphere = places.spheres[row, :3] - places.positions[row]  # bearing and distance of the sphere, left positive
        bearing = np.arctan2(-sphere[0], -sphere[2]) - places.yaws[row]
        np.testing.assert_allclose(places.target[row, :2], [np.sin(bearing), np.cos(bearing)], atol=1e-9)
        np.testing.assert_allclose(places.target[row, 2], np.hypot(sphere[0], sphere[2]))


def test_places_may_be_those_where_the_way_to_the_goal_is_blocked(proxy):
    config = replace(proxy.config, stuck=1.0, front_deg=60.0, reach=1.5, directions=5)
    stuck = Proxy(config, proxy.world)
    places, turned = stuck.places, proxy.places
    assert 0.5 * 240 < len(places.yaws) < len(turned.yaws)
    bearing = np.arctan2(places.goals[:, 2], places.goals[:, 3])
    assert np.abs(bearing).max() <= np.pi / 3 + 1e-6  # they look about where the goal is
    nearest = np.exp(places.free).min(axis=1) - 0.1
    assert np.median(nearest) < 0.5 < np.median(np.exp(turned.free).min(axis=1)) + 0.5
    away = np.expm1(places.goals[:, 0])
    heading = places.yaws + bearing
    for row in range(0, len(heading), 17):
        ahead = np.array([-np.sin(heading[row]), 0.0, -np.cos(heading[row])])
        navmesh = stuck.world.navmeshes[places.scenes[row]]
        end, _ = navmesh.step(places.positions[row], places.positions[row] + away[row] * ahead, sliding=False)
        walked = np.linalg.norm((end - places.positions[row]).ravel()[[0, 2]])
        assert walked < 0.6 + 1e-3 and walked < away[row] - 0.04
    assert stuck.blind()["way"] < proxy.blind()["way"]  # there the goal does not say where to go
    with pytest.raises(ValueError, match="stuck is 2"):
        ProxyConfig(stuck=2)


def test_directions_may_be_those_ahead():
    assert np.degrees(ProxyConfig(directions=5, front_deg=90).bearings).tolist() == [90, 45, 0, -45, -90]
    with pytest.raises(ValueError, match="front_deg is 0"):
        ProxyConfig(front_deg=0)


def test_regression_finds_what_is_there_and_nothing_else():
    rng = np.random.default_rng(0)
    inputs = rng.normal(size=(900, 5))
    targets = np.stack([inputs[:, 0] - 2 * inputs[:, 1], np.abs(inputs[:, 2]), rng.normal(size=900)], axis=1)
    groups = np.arange(900) // 30
    found = fit_and_test(inputs, targets, groups % 4 == 3, groups, 128, 0)
    assert found[0] > 0.98 and found[1] > 0.8 and abs(found[2]) < 0.15
    assert r2(targets, targets).tolist() == [1.0, 1.0, 1.0]


def test_a_search_on_the_proxy_is_judged_and_goes_on(tmp_path, tiny):
    pytest.importorskip("optuna")
    said = []
    config = tiny("method=random")
    optimizer = Optimizer(config, tmp_path, lambda stage, done, of, text: said.append(stage))
    best = optimizer.run()
    told = json.loads((tmp_path / "start-0" / "start.json").read_text())
    assert told["trials"] == 3 and told["found"] == max(told["scores"]) and told["initial"] == told["scores"][0]
    assert optimizer.proxy.score(best) == pytest.approx(told["found"], abs=1e-9)
    rows = [json.loads(line) for line in (tmp_path / "results.jsonl").read_text().splitlines()]
    assert [row["group"] for row in rows] == ["initial 0", "optimised 0"]
    assert all(len(row["measures"]["spl"]) == 4 for row in rows)
    assert "search" in said and "specialists" in said
    again = Optimizer(config, tmp_path, lambda *a: said.append("again"))
    np.testing.assert_array_equal(again.run().sensors, best.sensors)  # nothing is done twice
    assert again._judge is None or not again._judge._worlds
    with pytest.raises(ConfigError, match="another search was started here"):
        Optimizer(tiny("method=tpe"), tmp_path)


def test_what_was_found_is_judged_by_other_seeds_in_other_homes(tmp_path, tiny):
    pytest.importorskip("optuna")
    config = tiny("method=random", "score=specialist", "budget=512", "judge_split=val", "judge_steps=128")
    optimizer = Optimizer(config, tmp_path)
    optimizer.run()
    told = json.loads((tmp_path / "start-0" / "start.json").read_text())
    assert (told["trials"], told["steps"], told["score"]) == (2, 512, "specialist")
    rows = [json.loads(line) for line in (tmp_path / "results.jsonl").read_text().splitlines()]
    assert [(row["seed"], row["steps"]) for row in rows] == [(config.specialist.seed + 1, 128)] * 2
    assert optimizer.final.training() is optimizer.judge.training()
    homes = {optimizer.final.questions().id(row)[0] for row in range(4)}
    assert all("/val/" in home for home in homes)
    assert tiny("score=proxy", "budget=1000").trials == 4  # 240 readings each
    assert tiny("score=specialist", "budget=1000").trials == 3


def test_joint_optimisation_in_a_home(tmp_path, tiny):
    more = (
        "method=joint",
        "judge=false",
        "joint.frozen_rollouts=2",
        "joint.control_rollouts=1",
        "joint.design_rollouts=2",
    )
    optimizer = Optimizer(tiny(*more, "train.total_steps=768"), tmp_path)
    best = optimizer.run()
    initial = load_design(tmp_path / "start-0" / "initial.toml")
    assert not np.array_equal(best.sensors, initial.sensors)
    assert best.body.distance(best.sensors[:, :3]).max() < 1e-9
    rows = [json.loads(line) for line in (tmp_path / "results.jsonl").read_text().splitlines()]
    assert [row["group"] for row in rows] == ["generalist, initial 0", "generalist, optimised 0"]


def test_halving_trains_the_survivors_further(tmp_path, tiny):
    config = tiny("method=halving", "judge=false", "search.first_steps=64", "search.halving=2", "budget=320")
    Optimizer(config, tmp_path).run()
    told = json.loads((tmp_path / "start-0" / "start.json").read_text())
    trials = sorted((tmp_path / "start-0" / "trials").iterdir())
    assert len(trials) == told["trials"] == 3 and told["steps"] <= 320
    assert sorted(json.loads((t / "judged.json").read_text())["asked"]["steps"] for t in trials) == [64, 64, 128]


def test_a_specialist_is_judged_alike_however_many_play_at_once(tmp_path, tiny):
    few, many = tiny("specialist.num_envs=3"), tiny()
    design = load_design("forward")
    first = Judge(few.train, few.specialist)
    measures = first.specialist(design, tmp_path / "run")
    policy, second = _policy(tmp_path / "run"), Judge(many.train, many.specialist)
    again = second.judge(policy, design, np.zeros((2, 7)), second.train.env)
    np.testing.assert_array_equal(measures["spl"], again["spl"])
    np.testing.assert_array_equal(measures["path_length"], again["path_length"])


def _policy(folder):
    from prnav.train import RunFolder, load_policy

    return load_policy(RunFolder(folder))[0]


def test_a_plan_is_worked_off_once(tmp_path, tiny):
    designs = [("a", load_design("forward")), ("b", load_design("rabbit"))]
    jobs = write_plan(tmp_path, "designs", designs, {"pointgoal": tiny()}, seeds=1)
    assert read_plan(tmp_path) == ("designs", jobs) and len(jobs) == 2
    assert work(tmp_path) == 2
    before = (tmp_path / "jobs" / jobs[0].name / "judged.json").stat().st_mtime_ns
    assert work(tmp_path) == 2
    assert (tmp_path / "jobs" / jobs[0].name / "judged.json").stat().st_mtime_ns == before
    rows = collect(tmp_path)
    assert [(row["group"], row["design"], row["kind"]) for row in rows] == [
        ("a", "forward", "designs"),
        ("b", "rabbit", "designs"),
    ]
    with pytest.raises(ConfigError, match="another plan stands here"):
        write_plan(tmp_path, "designs", designs[:1], {"pointgoal": tiny()}, seeds=1)
    with pytest.raises(ConfigError, match=r"plan\.json: cannot be read .*; make a plan with prnav-design sweep"):
        read_plan(tmp_path / "none")
