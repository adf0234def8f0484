from pathlib import Path

import numpy as np
import pytest

from prnav.evaluate.compare import differences, group_differences, seed_groups, shared_name
from prnav.evaluate.intervals import bootstrap_interval, interval_over_run_groups, interval_over_runs
from prnav.evaluate.records import Evaluation


def evaluation(values, episodes="e", **checkpoint):
    rows = [{"scene_id": "s", "episode_id": str(i), "spl": value} for i, value in enumerate(values)]
    header = {"agent": f"run{checkpoint.get('seed')}", "actions": "sampled", "episodes_hash": episodes}
    return Evaluation(Path("nowhere"), {**header, "checkpoint": checkpoint}, rows)


def test_differences_are_paired_by_episode():
    generator = np.random.default_rng(0)
    base = generator.random(200)
    better = base + 0.05 + 0.01 * generator.standard_normal(200)
    (difference,) = differences([evaluation(base), evaluation(better)], ["a", "b"])
    assert (difference.name, difference.baseline) == ("b", "a")
    spl = difference.measures["spl"]
    assert spl.mean == pytest.approx(np.mean(better - base))
    assert 0.045 < spl.low < spl.high < 0.055  # unpaired intervals would be 0.04 wide each
    assert differences([evaluation(base), evaluation(better, "other")], ["a", "b"]) == []


def test_seeds_of_one_recipe_are_taken_together():
    generator = np.random.default_rng(1)
    runs = [evaluation(generator.random(50), recipe="r", seed=seed, steps=9) for seed in (0, 1, 2)]
    stranger = evaluation(generator.random(50), recipe="q", seed=3, steps=9)
    (group,) = seed_groups([*runs, stranger])
    assert group.seeds == (0, 1, 2)
    assert group.name == "run (sampled)"
    values = [[row["spl"] for row in run.rows] for run in runs]
    assert group.measures["spl"].mean == pytest.approx(np.mean(values))
    assert seed_groups([runs[0], runs[0]]) == []  # the same run twice is not two seeds
    assert seed_groups([runs[0], evaluation(generator.random(50), recipe="r", seed=1, steps=5)]) == []


def test_an_interval_over_runs_holds_both_kinds_of_chance():
    generator = np.random.default_rng(2)
    episodes = generator.random(100)
    same = interval_over_runs(np.stack([episodes] * 4))
    alone = bootstrap_interval(episodes)
    assert same.high - same.low == pytest.approx(alone.high - alone.low, rel=0.05)
    apart = interval_over_runs(episodes * 0.01 + np.array([[0.2], [0.4], [0.6], [0.8]]))
    assert apart.low < 0.36 and apart.high > 0.64
    exact = interval_over_runs(np.full((3, 5), 0.5))
    assert (exact.mean, exact.low, exact.high) == (0.5, 0.5, 0.5)


def test_intervals_over_runs_cover_the_truth_as_often_as_they_say():
    generator = np.random.default_rng(3)
    hits = 0
    for trial in range(200):
        values = 0.5 + 0.1 * generator.standard_normal((8, 1)) + 0.3 * generator.standard_normal((1, 40))
        interval = interval_over_runs(values, resamples=400, seed=trial)
        hits += interval.low <= 0.5 <= interval.high
    assert 0.85 <= hits / 200 <= 0.99


def test_groups_of_seeds_are_compared_over_seeds_and_episodes():
    generator = np.random.default_rng(4)
    base = generator.random(100)
    runs = [evaluation(base + 0.01 * seed, recipe="r", seed=seed, steps=9) for seed in range(3)]
    better = [evaluation(base + 0.2 + 0.01 * seed, recipe="q", seed=seed, steps=9) for seed in range(3)]
    (difference,) = group_differences(seed_groups([*runs, *better]))
    spl = difference.measures["spl"]
    assert spl.mean == pytest.approx(0.2)
    assert 0.17 < spl.low < 0.2 < spl.high < 0.23  # seeds differ by up to 0.02, episodes cancel
    elsewhere = [evaluation(base, "other", recipe="q", seed=seed, steps=9) for seed in range(3)]
    assert group_differences(seed_groups([*runs, *elsewhere])) == []


def test_differences_of_groups_cover_the_truth_as_often_as_they_say():
    generator = np.random.default_rng(5)
    hits = 0
    for trial in range(200):
        episodes = 0.3 * generator.standard_normal((1, 40))
        ours, theirs = (0.1 * generator.standard_normal((6, 1)) + episodes for _ in range(2))
        interval = interval_over_run_groups(ours, theirs, resamples=400, seed=trial)
        hits += interval.low <= 0.0 <= interval.high
    assert 0.82 <= hits / 200 <= 0.99


def test_runs_that_differ_by_their_seed_share_a_name():
    assert shared_name(["pointgoal-blind-0", "pointgoal-blind-1"]) == "pointgoal-blind"
    assert shared_name(["a", "b"]) == "a, b"
