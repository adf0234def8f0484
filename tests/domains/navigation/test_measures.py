import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from prnav.domains.navigation.measures import path_efficiency, soft_spl, spl
from prnav.domains.navigation.pointgoal import PointGoalConfig, reward, succeeded

LENGTH = st.floats(0.0, 100.0)


@pytest.mark.parametrize(
    ("success", "shortest", "taken", "expected"),
    [(1, 5.0, 5.0, 1.0), (1, 5.0, 10.0, 0.5), (0, 5.0, 5.0, 0.0), (1, 5.0, 4.9, 1.0), (1, 0.0, 0.0, 1.0)],
)
def test_spl_by_hand(success, shortest, taken, expected):
    assert spl(success, shortest, taken) == pytest.approx(expected)


def test_soft_spl_by_hand():
    # half of the way to the goal, on a path twice as long as needed
    assert soft_spl(5.0, 10.0, 20.0) == pytest.approx(0.25)
    assert soft_spl(12.0, 10.0, 3.0) == 0.0  # farther away than at the start
    assert soft_spl(np.inf, 10.0, 3.0) == 0.0


@given(st.booleans(), LENGTH, LENGTH, LENGTH)
def test_measures_stay_in_range(success, distance, shortest, taken):
    assert 0.0 <= spl(success, shortest, taken) <= 1.0
    assert 0.0 <= soft_spl(distance, shortest, taken) <= 1.0
    assert spl(success, shortest, taken) <= path_efficiency(shortest, taken)


@given(LENGTH, LENGTH, LENGTH)
def test_soft_spl_of_an_agent_at_its_goal_is_spl(shortest, taken, scale):
    assert soft_spl(0.0, shortest, taken) == pytest.approx(float(spl(True, shortest, taken)))


def test_reward_is_the_papers():
    config = PointGoalConfig()
    stopped = np.array([True, True, False])
    before, after = np.array([0.1, 3.0, 3.0]), np.array([0.1, 3.0, 2.75])
    success = succeeded(stopped, after, config)
    np.testing.assert_array_equal(success, [True, False, False])
    np.testing.assert_allclose(reward(stopped, success, before, after, config), [2.5, 0.0, 0.25 - 0.003])


def test_stopping_counts_at_exactly_the_success_distance():
    config = PointGoalConfig()
    np.testing.assert_array_equal(succeeded(np.ones(2, bool), np.array([0.2, 0.2 + 1e-9]), config), [True, False])


@pytest.mark.parametrize("values", [{"success_distance": 0.0}, {"max_steps": 0}])
def test_impossible_rules_are_refused(values):
    with pytest.raises(ValueError, match="it must be"):
        PointGoalConfig(**values)
