import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from prnav import frames
from prnav.errors import SceneError

ANGLE = st.floats(-10.0, 10.0)


def test_yaw_zero_looks_along_minus_z_and_left_is_minus_x():
    np.testing.assert_allclose(frames.forward(0.0), [0, 0, -1], atol=1e-15)
    np.testing.assert_allclose(frames.forward(np.pi / 2), [-1, 0, 0], atol=1e-15)


@given(ANGLE)
def test_quaternion_round_trip(yaw):
    quaternion = frames.yaw_to_quaternion(yaw)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)
    for q in (quaternion, -quaternion):
        assert frames.wrap_angle(frames.quaternion_to_yaw(q) - yaw) == pytest.approx(0.0, abs=1e-9)


@given(ANGLE)
def test_yaw_towards_inverts_forward(yaw):
    assert frames.wrap_angle(frames.yaw_towards(3.0 * frames.forward(yaw)) - yaw) == pytest.approx(0.0, abs=1e-9)


def test_yaw_towards_nothing_is_zero():
    assert frames.yaw_towards([[0.0, 2.0, 0.0]])[0] == 0.0


@given(ANGLE, st.tuples(*[st.floats(-5, 5)] * 3))
def test_body_frame_round_trip(yaw, offset):
    seen = frames.to_body_frame(offset, yaw)
    np.testing.assert_allclose(frames.from_body_frame(seen, yaw), offset, atol=1e-9)


def test_what_lies_ahead_is_at_minus_z_of_the_body():
    yaws = np.linspace(-3, 3, 7)
    np.testing.assert_allclose(
        frames.to_body_frame(frames.forward(yaws), yaws), np.tile([0, 0, -1], (7, 1)), atol=1e-12
    )


def test_z_up_becomes_y_up_without_mirroring():
    x, y, z = frames.to_y_up(np.eye(3), "z")
    np.testing.assert_array_equal(z, [0, 1, 0])
    np.testing.assert_allclose(np.cross(x, y), z)


def test_unknown_up_axis_names_the_valid_ones():
    with pytest.raises(SceneError, match="up axis 'w' is not known; valid: y, z"):
        frames.to_y_up(np.zeros(3), "w")
