"""Searches find the top of a known hill, resume from their storage, and halve as they should."""

import numpy as np
import pytest

from prnav.design.search import (
    SearchConfig,
    best_of,
    coordinate_names,
    halving_candidates,
    halving_cost,
    initial_of,
    random_values,
    search,
    successive_halving,
)
from prnav.design.variants import interpolated, pairs, single_axes, spread, without_each
from prnav.errors import ConfigError, DesignError
from prnav.sensors import Design, DesignSpace, load_design, pose_to_theta, random_design, theta_to_pose

BASE = load_design("habitat-camera")
DESIGN = Design("d", BASE.sensors, space=DesignSpace(frozen=("x", "z", "roll")))


def hill(theta):
    return -float(((theta[0, [1, 3, 4, 6]] - [-0.2, 0.3, -0.3, 0.1]) ** 2).sum())


@pytest.mark.parametrize("method", ["random", "cmaes", "tpe"])
def test_a_search_climbs_and_goes_on_from_its_storage(tmp_path, method):
    pytest.importorskip("optuna")
    storage = tmp_path / "study.log"
    assert coordinate_names(DESIGN) == ["0.y", "0.yaw", "0.pitch", "0.fov"]
    seen = []
    first = search(
        method, DESIGN, hill, SearchConfig(trials=12), storage, report=lambda one, best: seen.append(one.number)
    )
    np.testing.assert_array_equal(first[0].values, np.zeros(4))  # the initial design
    assert seen == list(range(12))
    more = search(method, DESIGN, hill, SearchConfig(trials=40), storage, seed=1)
    assert len(more) == 40 and more[3].score == first[3].score
    assert best_of(more).score > first[0].score + 0.05
    assert all(np.abs(trial.values).max() <= 0.6 for trial in more)


def test_the_same_seed_tries_the_same_designs(tmp_path):
    pytest.importorskip("optuna")
    runs = [search("cmaes", DESIGN, hill, SearchConfig(trials=8), tmp_path / f"{i}.log", seed=5) for i in range(2)]
    assert [trial.score for trial in runs[0]] == [trial.score for trial in runs[1]]


@pytest.mark.parametrize("method", ["random", "tpe", "cmaes"])
def test_workers_that_share_a_study_repeat_nothing_and_neither_does_a_resumed_one(tmp_path, method):
    pytest.importorskip("optuna")
    settings = [SearchConfig(trials=count) for count in (7, 14)]

    def second(theta):  # another machine works on the study while the first one is at its third design
        seen.append(theta)
        if len(seen) == 3:
            search(method, DESIGN, hill, settings[0], tmp_path / "two.log")
        return hill(theta)

    seen = []
    search(method, DESIGN, second, settings[0], tmp_path / "two.log")
    trials = search(method, DESIGN, hill, settings[1], tmp_path / "two.log")
    assert len(np.unique([trial.values for trial in trials], axis=0)) == len(trials) >= 14
    if method == "random":  # who asks does not matter
        alone = search(method, DESIGN, hill, settings[1], tmp_path / "one.log")
        np.testing.assert_array_equal([t.values for t in alone[:14]], [t.values for t in trials[:14]])


@pytest.mark.parametrize("method", ["random", "tpe", "cmaes"])
@pytest.mark.parametrize("fatal", [0, 1, 3])
def test_a_search_that_died_tries_the_same_designs_as_one_that_did_not(tmp_path, method, fatal):
    """A trial is asked again by its number, the first one too."""
    pytest.importorskip("optuna")
    whole = search(method, DESIGN, hill, SearchConfig(trials=6), tmp_path / "whole.log")
    seen = []

    def dies(theta):
        seen.append(theta)
        if len(seen) == fatal + 1:
            raise KeyboardInterrupt
        return hill(theta)

    with pytest.raises(KeyboardInterrupt):
        search(method, DESIGN, dies, SearchConfig(trials=6), tmp_path / "s.log")
    trials = search(method, DESIGN, hill, SearchConfig(trials=6), tmp_path / "s.log")
    assert [trial.number for trial in trials] == [trial.number for trial in whole]
    np.testing.assert_array_equal([t.values for t in trials], [t.values for t in whole])
    assert not list(tmp_path.glob("*.claims"))


def test_the_initial_design_is_scored_though_a_worker_died_at_it(tmp_path):
    pytest.importorskip("optuna")

    def dies(theta):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search("random", DESIGN, dies, SearchConfig(trials=4), tmp_path / "s.log")
    trials = search("random", DESIGN, hill, SearchConfig(trials=4), tmp_path / "s.log")
    assert initial_of(trials).score == hill(np.zeros((1, 7)))
    with pytest.raises(ConfigError, match="design 4 has the score nan"):
        search("random", DESIGN, lambda theta: float("nan"), SearchConfig(trials=9), tmp_path / "s.log")


def test_mistakes_are_one_line(tmp_path):
    pytest.importorskip("optuna")
    frozen = Design("f", BASE.sensors, space=DesignSpace(frozen=("x", "y", "z", "yaw", "pitch", "roll", "fov")))
    with pytest.raises(ConfigError, match="all its axes are frozen"):
        search("random", frozen, hill, SearchConfig(), tmp_path / "s.log")
    with pytest.raises(ConfigError, match="storage nodb://x: cannot be used"):
        search("random", DESIGN, hill, SearchConfig(), "nodb://x")
    with pytest.raises(ValueError, match="halving is 1"):
        SearchConfig(halving=1)


def test_successive_halving_keeps_the_best_and_its_budget():
    spent = {}

    def score(candidate, steps):
        spent[candidate] = steps
        return -abs(candidate - 7) + 0.1 * np.log(steps)

    best, way = successive_halving(range(9), score, 100, 3)
    assert best == 7 and [steps for steps, _ in way] == [100, 300, 900]
    assert sum(spent.values()) == halving_cost(9, 100, 3) == 9 * 100 + 3 * 200 + 600
    assert halving_candidates(2100, 100, 3) == 9 and halving_candidates(1, 100, 3) == 1
    values = random_values(DESIGN, 5, 0.5, 0)
    assert values.shape == (5, 4) and not values[0].any() and np.abs(values).max() <= 0.5


def test_variants():
    initial = random_design(3, 2)
    theta = np.random.default_rng(0).normal(0, 0.2, (2, 7))
    found = Design("found", theta_to_pose(theta, initial))
    way = interpolated(initial, found)
    assert [group for group, _ in way] == ["0", "0.05", "0.1", "0.2", "0.4", "0.8", "1"]
    np.testing.assert_allclose(way[0][1].sensors, found.sensors, atol=1e-9)
    np.testing.assert_allclose(way[-1][1].sensors, initial.sensors, atol=1e-9)
    ends = pose_to_theta(found.sensors, initial)
    np.testing.assert_allclose(pose_to_theta(way[3][1].sensors, initial)[:, 3:], 0.8 * ends[:, 3:], atol=1e-9)
    axes = dict(single_axes(initial, found))
    np.testing.assert_array_equal(axes["pitch"].sensors[:, [0, 1, 2, 3, 5, 6]], initial.sensors[:, [0, 1, 2, 3, 5, 6]])
    np.testing.assert_allclose(axes["pitch"].sensors[:, 4], found.sensors[:, 4])
    left = without_each(found)
    assert [group for group, _ in left] == ["all", "without 0", "without 1"]
    np.testing.assert_array_equal(left[1][1].sensors[0], found.sensors[1])
    with pytest.raises(DesignError, match="has one sensor"):
        without_each(BASE)
    groups = [group for group, _ in spread([found], 4, 2, 4)]
    assert groups.count("random") == 4 and groups.count("intuitive") >= 4 and groups[-1] == "optimised"
    assert all(design.grid == 4 for _, design in spread([], 1, 1, 4))
    assert [group for group, _ in pairs([initial], [found])] == ["initial 0", "optimised 0"]
    with pytest.raises(DesignError, match="1 initial and 0 found designs are no pairs"):
        pairs([initial], [])
