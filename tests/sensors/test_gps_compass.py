import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from prnav.frames import forward
from prnav.sensors import compass, gps, pointgoal

number = st.floats(-10, 10)


def test_named_directions():
    here = np.array([1.0, 0.2, 2.0])
    assert gps([1, 5, 2], here, 0.3).tolist() == [0, 0]  # heights do not count
    np.testing.assert_allclose(gps([1, 0, 0], here, 0.0), [2, 0], atol=1e-6)  # ahead is -z
    np.testing.assert_allclose(gps([4, 0, 2], here, 0.0), [0, 3], atol=1e-6)  # right is +x
    np.testing.assert_allclose(gps([4, 0, 2], here, -np.pi / 2), [3, 0], atol=1e-6)  # after a turn to the right
    np.testing.assert_allclose(pointgoal(here, 0.0, [1, 0, -1]), [3, 0], atol=1e-6)
    np.testing.assert_allclose(pointgoal(here, 0.0, [-3, 0, 2]), [4, np.pi / 2], atol=1e-6)  # left is positive
    np.testing.assert_allclose(pointgoal(here, np.pi / 2, [-3, 0, 2]), [4, 0], atol=1e-6)
    assert pointgoal(here, 1.0, here).tolist() == [0, 0]


@given(number, number, number, number, number)
def test_goal_found_by_following_its_bearing(x, z, yaw, goal_x, goal_z):
    here, goal = np.array([x, 0, z]), np.array([goal_x, 1.0, goal_z])
    distance, bearing = pointgoal(here, yaw, goal).astype(float)
    reached = here + distance * forward(yaw + bearing)
    np.testing.assert_allclose(reached[[0, 2]], goal[[0, 2]], atol=1e-4)


@given(number, number, number, number)
def test_gps_is_the_displacement_in_the_start_frame(x, z, start_yaw, yaw):
    start, here = np.array([0.5, 0, -2.0]), np.array([x, 0, z])
    ahead, right = gps(here, start, start_yaw).astype(float)
    rebuilt = start + ahead * forward(start_yaw) + right * forward(start_yaw - np.pi / 2)
    np.testing.assert_allclose(rebuilt[[0, 2]], here[[0, 2]], atol=1e-4)
    turned = float(compass(yaw, start_yaw))
    assert -np.pi - 1e-6 <= turned <= np.pi + 1e-6
    np.testing.assert_allclose(forward(start_yaw + turned), forward(yaw), atol=1e-5)


def test_batches():
    assert gps(np.zeros((5, 3)), np.ones((5, 3)), np.zeros(5)).shape == (5, 2)
    assert compass(np.zeros(5), np.zeros(5)).dtype == np.float32
    assert pointgoal(np.zeros((5, 3)), np.zeros(5), np.ones((5, 3))).shape == (5, 2)
