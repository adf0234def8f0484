import numpy as np
import pytest
from scipy import stats

from prnav.errors import RecordError
from prnav.evaluate.intervals import bootstrap_interval, bootstrap_means, paired_difference
from prnav.evaluate.summary import column, format_interval, summarise


def test_means_equal_a_loop_over_resamples():
    values = np.random.default_rng(0).normal(size=(7, 2))
    drawn = np.random.Generator(np.random.PCG64(3)).integers(0, 7, size=(50, 7))
    expected = np.stack([values[rows].mean(axis=0) for rows in drawn])
    np.testing.assert_allclose(bootstrap_means(values, 50, seed=3), expected, atol=1e-12)


def test_interval_covers_the_mean_as_often_as_it_says():
    generator = np.random.default_rng(1)
    hits = 0
    for _ in range(300):
        interval = bootstrap_interval(generator.normal(0.3, 1.0, size=80), resamples=500)
        hits += interval.low <= 0.3 <= interval.high
    assert 0.90 <= hits / 300 <= 0.98


def test_interval_agrees_with_scipys():
    values = np.random.default_rng(2).exponential(size=200)
    ours = bootstrap_interval(values)
    theirs = stats.bootstrap((values,), np.mean, method="percentile", n_resamples=10_000, rng=5).confidence_interval
    assert ours.low == pytest.approx(theirs.low, abs=0.01)
    assert ours.high == pytest.approx(theirs.high, abs=0.01)


def test_same_seed_same_interval_and_constant_values_have_none():
    values = np.arange(30.0)
    assert bootstrap_interval(values, seed=4) == bootstrap_interval(values, seed=4)
    assert bootstrap_interval(values, seed=4) != bootstrap_interval(values, seed=5)
    constant = bootstrap_interval(np.full(9, 0.5))
    assert (constant.mean, constant.low, constant.high) == (0.5, 0.5, 0.5)


def test_pairs_take_out_what_episodes_share():
    generator = np.random.default_rng(6)
    hardness = generator.normal(size=100)
    a, b = hardness + 0.1 + 0.01 * generator.normal(size=100), hardness
    difference = paired_difference(a, b)
    alone = bootstrap_interval(a)
    assert 0.09 < difference.low < difference.high < 0.11
    assert difference.high - difference.low < 0.1 * (alone.high - alone.low)


def test_no_episode_has_no_mean():
    assert np.isnan(bootstrap_interval(np.zeros(0)).mean)


def test_summary_reports_known_measures_in_order_and_infinity_as_infinity():
    rows = [{"spl": 1.0, "success": 1.0, "distance_to_goal": None}, {"spl": 0.0, "success": 0, "distance_to_goal": 2.0}]
    summary = summarise(rows)
    assert list(summary) == ["success", "spl", "distance_to_goal"]
    assert summary["spl"].mean == 0.5
    assert np.isinf(summary["distance_to_goal"].mean)
    assert format_interval("spl", summary["spl"])[0] == "0.500"


def test_broken_rows_are_named():
    with pytest.raises(RecordError, match="lacks the measure 'spl'"):
        column([{"success": 1.0}], "spl")
    with pytest.raises(RecordError, match="no episode to summarise"):
        summarise([])
