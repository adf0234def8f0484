import numpy as np

from prnav.domains.navigation import pointgoal, targetnav
from prnav.domains.navigation.pointgoal import PointGoalConfig
from prnav.domains.navigation.targetnav import TargetNavConfig, reward, spheres, succeeded

NO_STOP = np.zeros(3, bool)


def test_the_numbers_are_the_papers():
    config = TargetNavConfig()
    assert (config.radius, config.height, config.success_distance, config.max_steps) == (0.5, 1.5, 0.8, 1500)
    assert (config.success_reward, config.slack, config.visible) == (2.5, 0.003, True)


def test_the_circle_is_entered_at_exactly_its_radius():
    np.testing.assert_array_equal(succeeded(np.array([0.8, 0.8 + 1e-9]), TargetNavConfig()), [True, False])


def test_finding_the_sphere_is_paid_on_top_of_the_step():
    before, after = np.array([1.0, 3.0, 3.0]), np.array([0.75, 2.75, 3.25])
    verdict = targetnav.judge(TargetNavConfig(), NO_STOP, before, after)
    np.testing.assert_array_equal(verdict.success, [True, False, False])
    np.testing.assert_array_equal(verdict.terminated, verdict.success)
    np.testing.assert_allclose(verdict.rewards, [0.25 - 0.003 + 2.5, 0.25 - 0.003, -0.25 - 0.003])
    np.testing.assert_array_equal(reward(verdict.success, before, after, TargetNavConfig()), verdict.rewards)


def test_pointgoal_ends_by_stop_alone():
    verdict = pointgoal.judge(
        PointGoalConfig(), np.array([True, True, False]), np.full(3, 0.1), np.array([0.1, 3.0, 0.1])
    )
    np.testing.assert_array_equal(verdict.terminated, [True, True, False])
    np.testing.assert_array_equal(verdict.success, [True, False, False])
    np.testing.assert_allclose(verdict.rewards, [2.5, 0.0, -0.003])


def test_spheres_hang_over_their_goals_or_have_no_size():
    goals = np.array([[1.0, 0.2, -3.0], [0.0, 3.0, 0.0]])
    np.testing.assert_allclose(spheres(goals, TargetNavConfig()), [[1.0, 1.7, -3.0, 0.5], [0.0, 4.5, 0.0, 0.5]])
    assert (spheres(goals, TargetNavConfig(visible=False))[:, 3] == 0.0).all()
