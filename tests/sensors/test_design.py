import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from prnav.errors import DesignError
from prnav.sensors import (
    Body,
    Design,
    DesignSpace,
    library_designs,
    load_design,
    pose_to_theta,
    random_design,
    save_design,
    theta_to_pose,
)

GOOD = [0.0, 1.2, -0.1, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("name", library_designs())
def test_library(name):
    design = load_design(name)
    assert design.name == name
    assert len(design.description) > 40
    assert design.body.distance(design.sensors[:, :3]).max() == 0.0
    theta = np.zeros((design.num_sensors, 7))
    np.testing.assert_array_equal(theta_to_pose(theta, design), design.sensors)
    np.testing.assert_array_equal(pose_to_theta(design.sensors, design), theta)


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 3.0))
def test_every_theta_is_a_sensor_on_the_body_and_the_inverse_is_exact(seed, spread):
    design = random_design(seed % 50, 3)
    theta = np.random.default_rng(seed).normal(0.0, spread, (4, 3, 7))
    pose = theta_to_pose(theta, design)
    assert design.body.distance(pose[..., :3]).max() == 0.0
    assert pose[..., 6].min() >= design.space.fov_min and pose[..., 6].max() <= design.space.fov_max
    np.testing.assert_allclose(theta_to_pose(pose_to_theta(pose, design), design), pose, atol=1e-13)


def test_angles_move_by_their_scales_and_positions_go_to_the_surface():
    design = load_design("forward")
    theta = np.zeros((2, 7))
    theta[0] = [0.0, 0.1, 0.0, 0.2, -0.2, 0.4, 0.1]
    pose = theta_to_pose(theta, design)
    np.testing.assert_array_equal(pose[1], design.sensors[1])
    np.testing.assert_allclose(pose[0, 3:] - design.sensors[0, 3:], np.radians([18.0, -18.0, 36.0, 4.5]))
    np.testing.assert_allclose(pose[0, :3] - design.sensors[0, :3], [0.0, 0.1, 0.0], atol=1e-12)
    theta[0, :3] = [0.0, 0.3, 0.0]  # up to the rim and 5 cm on, towards the centre of the top
    np.testing.assert_allclose(theta_to_pose(theta, design)[0, :3], [-0.03, 1.5, -0.04], atol=1e-12)
    theta[0, :3] = [0.0, 5.0, 0.0]  # over the top of the body: the far rim
    np.testing.assert_allclose(theta_to_pose(theta, design)[0, :3], [0.06, 1.5, 0.08], atol=1e-12)


def test_the_map_is_continuous_around_the_side_and_over_the_top():
    design = load_design("habitat-camera")
    theta = np.zeros((400, 1, 7))
    theta[:, 0, 0] = np.linspace(-2, 2, 400)  # around the body and more
    theta[:, 0, 1] = np.linspace(1, -2, 400)  # over the top
    theta[:, 0, 6] = np.linspace(-3, 3, 400)
    assert np.abs(np.diff(theta_to_pose(theta, design), axis=0)).max() < 0.02


def test_random_designs_come_from_their_seed():
    one, same, other = random_design(3, 4), random_design(3, 4), random_design(4, 4)
    np.testing.assert_array_equal(one.sensors, same.sensors)
    assert not np.array_equal(one.sensors, other.sensors)
    np.testing.assert_array_equal(random_design(3, 8).sensors[:4], one.sensors)
    rows = random_design(0, 4000).sensors
    top = rows[:, 1] == 1.5
    assert abs(top.mean() - 0.01 / (0.01 + 2 * 0.1 * 1.5)) < 0.01  # by area
    assert np.abs(rows[:, 3]).max() > 3.1 and abs(np.sin(rows[:, 4]).mean()) < 0.03
    with pytest.raises(DesignError, match="number of sensors is 0"):
        random_design(0, 0)


def test_files_come_back(tmp_path):
    design = Design(
        'odd "name"',
        random_design(1, 3, body=Body(0.2, 1.1)).sensors,
        grid=8,
        body=Body(0.2, 1.1),
        space=DesignSpace(x=0.1, roll=1e-3, fov_max=2.0944),
        description="An idea: one line.",
    )
    save_design(design, tmp_path / "d.toml")
    back = load_design(tmp_path / "d.toml", sensors=3)
    assert (back.name, back.grid, back.body, back.description) == (design.name, 8, design.body, design.description)
    np.testing.assert_allclose(back.sensors, design.sensors, atol=1e-11)
    np.testing.assert_allclose(back.space.scale, design.space.scale, rtol=1e-11)
    text = (tmp_path / "d.toml").read_text()
    save_design(back, tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_text() == text


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({3: np.nan}, "sensor 0: yaw is nan; it must be a finite number"),
        ({0: np.inf}, "sensor 0: x is inf; it must be a finite number"),
        (
            {2: -0.05},
            r"position \(0, 1.2, -0.05\) lies inside the body .* nearest place on its surface is \(0, 1.2, -0.1\)",
        ),
        ({2: -0.5}, r"lies off the body \(cylinder of radius 0.1 m, height 1.5 m\)"),
        ({1: -0.2}, "lies off the body"),
        ({6: 0.0}, "fov is 0 degrees; it must lie within 1 to 179"),
        ({6: np.pi}, "fov is 180 degrees; it must lie within 1 to 179"),
    ],
)
def test_a_bad_sensor_is_one_clear_error(change, text):
    row = list(GOOD)
    for column, value in change.items():
        row[column] = value
    with pytest.raises(DesignError, match=text):
        Design("bad", [row])


def test_shapes_are_checked():
    with pytest.raises(DesignError, match=r"design d: sensors have shape \(0,\)"):
        Design("d", [])
    with pytest.raises(DesignError, match=r"they must be \(K, 7\): x, y, z, yaw, pitch, roll, fov"):
        Design("d", [[1, 2, 3]])
    with pytest.raises(DesignError, match="design d: grid is 0"):
        Design("d", [GOOD], grid=0)
    design = load_design("forward")
    with pytest.raises(DesignError, match=r"theta has shape \(3, 7\); design forward has 2 sensors: \(..., 2, 7\)"):
        theta_to_pose(np.zeros((3, 7)), design)
    with pytest.raises(DesignError, match="theta: pitch of sensor 1 is not finite"):
        theta_to_pose([[0] * 7, [0, 0, 0, 0, np.nan, 0, 0]], design)
    with pytest.raises(DesignError, match="pose has shape"):
        pose_to_theta(np.zeros(7), design)
    with pytest.raises(DesignError, match="design forward has 2 sensors; 4 are needed"):
        design.require_sensors(4)
    with pytest.raises(ValueError, match="read-only"):
        design.sensors[0, 0] = 1.0


def test_spaces_are_checked():
    with pytest.raises(DesignError, match="design space: scale of roll is 0.0"):
        DesignSpace(roll=0.0)
    with pytest.raises(DesignError, match="fov limits are 1 to 180 degrees"):
        DesignSpace(fov_max=np.pi)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "lacks keys"),
        ("name = 'x'\nsensors = []", r"sensors have shape \(0, 7\)"),
        ("name = 'x'\n[[sensors]]\nposition = [0.0, 1.0]", "has 2 items; it must have 3"),
        (
            "name = 'x'\n[[sensors]]\nposition = [0.0, 1.0, -0.1]\nfov = 1.0",
            r"unknown key 'sensors\[0\].fov'; did you mean",
        ),
        (
            "name = 'x'\n[[sensors]]\nposition = [0.0, 1.0, 0.0]",
            "bad.toml: design x: sensor 0: position .* lies inside",
        ),
        ("name = 'x'\n[[sensors]]\nposition = [0.0, 1.0, -0.1]\nfov_deg = 180.0", "fov is 180 degrees"),
        ("name = 'x'\n[[sensors]]\nposition = [0.0, 1.0, -0.1]\nyaw_deg = nan", "must be finite"),
        ("name = ", "not valid TOML"),
    ],
)
def test_a_bad_file_is_one_clear_error(tmp_path, text, message):
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(DesignError, match=message) as caught:
        load_design(tmp_path / "bad.toml")
    assert "bad.toml" in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_design_names_the_library(tmp_path):
    with pytest.raises(DesignError, match="'eagle' is not in the library; valid: compass-rose, crow, fan, "):
        load_design("eagle")
    with pytest.raises(DesignError, match="cannot be read"):
        load_design(tmp_path / "none.toml")
    with pytest.raises(DesignError, match="design forward has 2 sensors; 8 are needed"):
        load_design("forward", sensors=8)
