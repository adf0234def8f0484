"""Rewards as laws: bounds, margins, monotony, and values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from prnav.domains.control.rewards import (
    move_reward,
    reach_reward,
    spin_reward,
    stand_reward,
    tolerance,
    turn_reward,
)

numbers = st.floats(-1e6, 1e6)


def test_a_margin_of_zero_is_all_or_nothing():
    got = tolerance([-0.1, 0.0, 0.5, 1.0, 1.0001], 0.0, 1.0)
    np.testing.assert_array_equal(got, [0, 1, 1, 1, 0])


@pytest.mark.parametrize(("shape", "value"), [("gaussian", 0.1), ("linear", 0.5)])
def test_the_value_at_the_margin_is_the_same_on_both_sides(shape, value):
    got = tolerance([1.0 - 0.4, 2.0 + 0.4], 1.0, 2.0, margin=0.4, shape=shape)
    np.testing.assert_allclose(got, value, rtol=1e-12)


def test_the_linear_slope_ends_at_twice_the_margin():
    np.testing.assert_allclose(
        tolerance([1.0, 0.75, 0.5, 0.0, -3.0], 1.0, np.inf, margin=0.5, shape="linear"), [1, 0.75, 0.5, 0, 0]
    )


@given(numbers, numbers, st.sampled_from(["gaussian", "linear"]))
def test_farther_from_the_bounds_is_never_better(a, b, shape):
    near, far = sorted((abs(a), abs(b)))
    value_near, value_far = tolerance([1 + near, 1 + far], -1.0, 1.0, margin=3.0, shape=shape)
    assert 0.0 <= value_far <= value_near <= 1.0


def test_a_touching_fingertip_is_rewarded():
    np.testing.assert_array_equal(reach_reward([0.0, 0.025, 0.02501], 0.025), [1, 1, 0])


def test_standing_upright_is_worth_one_and_lying_close_to_nothing():
    np.testing.assert_allclose(stand_reward([1.2, 2.0], [1.0, 1.0]), 1.0)
    np.testing.assert_allclose(stand_reward(0.6, 0.0), (3 * 0.1 + 0.5) / 4)
    np.testing.assert_allclose(stand_reward(-10.0, -1.0), 0.0, atol=1e-12)


def test_moving_counts_five_sixths():
    np.testing.assert_allclose(move_reward(1.3, 1.0, [0.0, 0.5, 1.0, 9.0, -5.0], 1.0), [1 / 6, 3.5 / 6, 1, 1, 1 / 6])
    np.testing.assert_allclose(move_reward(1.3, 1.0, [4.0, 8.0], 8.0), [3.5 / 6, 1])


def test_the_spinner_must_turn_downwards_fast_enough():
    np.testing.assert_array_equal(spin_reward([-15.0, -14.999, 15.0, -40.0]), [1, 0, 0, 1])


def test_the_tip_must_be_in_the_target():
    np.testing.assert_array_equal(turn_reward([-0.01, 0.0, 1e-9]), [1, 1, 0])
