import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render.rays import patch_rays, rays_per_side, sensor_views, view_rays
from prnav.render.sampling import Sampling, acceptance_weights, patch_offsets

FORWARD = np.array([0.0, 1.2, -0.1, 0.0, 0.0, 0.0, np.pi / 2])


def one(position=(0, 0, 0), yaw=0.0, **changes):
    design = FORWARD.copy()
    for name, value in changes.items():
        design[["x", "y", "z", "yaw", "pitch", "roll", "fov"].index(name)] = value
    return np.array([position], dtype=float), np.array([yaw]), design[None, None]


def test_sensor_at_rest_looks_along_minus_z():
    views = sensor_views(*one())
    np.testing.assert_allclose(views.origin, [[0, 1.2, -0.1]], atol=1e-15)
    np.testing.assert_allclose(views.forward, [[0, 0, -1]], atol=1e-15)
    np.testing.assert_allclose(views.right, [[1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(views.up, [[0, 1, 0]], atol=1e-15)


def test_agent_yaw_turns_position_and_view_to_the_left():
    views = sensor_views(*one((5, 0, 7), np.pi / 2))
    np.testing.assert_allclose(views.origin, [[4.9, 1.2, 7]], atol=1e-15)
    np.testing.assert_allclose(views.forward, [[-1, 0, 0]], atol=1e-15)


@pytest.mark.parametrize(
    ("axis", "angle", "forward", "right", "up"),
    [
        ("yaw", np.pi / 2, (-1, 0, 0), (0, 0, -1), (0, 1, 0)),
        ("pitch", np.pi / 2, (0, 1, 0), (1, 0, 0), (0, 0, 1)),
        ("roll", np.pi / 2, (0, 0, -1), (0, 1, 0), (-1, 0, 0)),
    ],
)
def test_quarter_turns(axis, angle, forward, right, up):
    views = sensor_views(*one(**{axis: angle}))
    np.testing.assert_allclose(views.forward[0], forward, atol=1e-15)
    np.testing.assert_allclose(views.right[0], right, atol=1e-15)
    np.testing.assert_allclose(views.up[0], up, atol=1e-15)


def test_rotation_is_ry_rx_rz():
    def about(axis, angle):
        c, s = np.cos(angle), np.sin(angle)
        return {
            "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
            "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
        }[axis]

    rng = np.random.default_rng(0)
    for yaw0, yaw, pitch, roll in rng.uniform(-3, 3, (20, 4)):
        views = sensor_views(*one(yaw=yaw0, **{"pitch": pitch, "roll": roll}))
        positions, yaws, designs = one(yaw=yaw0)
        designs[0, 0, 3:6] = yaw, pitch, roll
        views = sensor_views(positions, yaws, designs)
        rotation = about("y", yaw0) @ about("y", yaw) @ about("x", pitch) @ about("z", roll)
        np.testing.assert_allclose(np.stack([views.right[0], views.up[0], -views.forward[0]], 1), rotation, atol=1e-14)


def test_plane_is_sampled_evenly_in_its_tangent_and_not_in_angle():
    _, directions = view_rays(sensor_views(*one(fov=np.radians(120))), 4)
    along = directions[0, 0, :, 0]
    np.testing.assert_allclose(along[:, 0], np.tan(np.radians(60)) * np.array([-0.75, -0.25, 0.25, 0.75]))
    np.testing.assert_allclose(directions[..., 2], -1.0)  # 1 along the optical axis
    assert directions[0, 0, 0, 0, 1] > directions[0, 3, 0, 0, 1]  # row 0 is the top


def test_patch_rays_are_the_pixels_of_a_finer_picture():
    rng = np.random.default_rng(1)
    positions, yaws = rng.normal(size=(3, 3)), rng.normal(size=3)
    designs = rng.uniform(0.1, 1.0, (3, 2, 7))
    grid, side = 4, 3
    origins, directions = patch_rays(positions, yaws, designs, grid, side * side)
    assert origins.shape == directions.shape == (3, 2, 4, 4, 9, 3)
    _, picture = view_rays(sensor_views(positions, yaws, designs), grid * side)
    picture = picture.reshape(3, 2, grid, side, grid, side, 3).transpose(0, 1, 2, 4, 3, 5, 6)
    np.testing.assert_allclose(directions, picture.reshape(directions.shape), atol=1e-14)


@pytest.mark.parametrize("side", [1, 2, 3, 4, 5, 8, 16])
def test_lattice_gives_each_ray_its_own_row_and_column(side):
    offsets = patch_offsets(side, "lattice")
    centres = (np.arange(side * side) + 0.5) / side**2
    np.testing.assert_allclose(np.sort(offsets[:, 0]), centres)
    np.testing.assert_allclose(np.sort(offsets[:, 1]), centres)
    apart = np.abs(offsets[:, None] - offsets)
    apart = np.linalg.norm(np.minimum(apart, 1 - apart), axis=-1) + 9 * np.eye(side * side)
    if side >= 2:
        assert apart.min() * side > 0.7  # a square grid has 1, the best lattice 1.07


@pytest.mark.parametrize("value", [0, -4, 2, 15, 4.0, "4"])
def test_rays_per_receptor_must_be_a_square(value):
    with pytest.raises(RenderError, match="must be a square of a whole number: 1, 4, 9"):
        rays_per_side(value)


def test_pose_errors_say_what_is_wrong():
    positions, yaws, designs = one()
    with pytest.raises(RenderError, match=r"designs have shape \(1, 7\); they must be \(N, K, 7\)"):
        sensor_views(positions, yaws, designs[0])
    with pytest.raises(RenderError, match=r"positions have shape \(2, 3\); with 1 designs they must be \(1, 3\)"):
        sensor_views(np.zeros((2, 3)), yaws, designs)
    with pytest.raises(RenderError, match=r"yaws have shape \(\); with 1 designs they must be \(1,\)"):
        sensor_views(positions, 0.0, designs)
    with pytest.raises(RenderError, match="designs of agent 0 are not finite"):
        sensor_views(*one(pitch=np.nan))
    with pytest.raises(RenderError, match="is 90 rad; it must lie between 0 and pi; is it in degrees"):
        sensor_views(*one(fov=90.0))
    for fov in (0.0, -1.0, np.pi):
        with pytest.raises(RenderError, match="it must lie between 0 and pi"):
            sensor_views(*one(fov=fov))


@pytest.mark.parametrize("pattern", ["grid", "lattice"])
def test_acceptance_profiles(pattern):
    for side in (1, 2, 5, 16):
        for name in ("uniform", "cosine", "gaussian"):
            weights = acceptance_weights(side, pattern, name)
            assert weights.mean() == pytest.approx(1.0) and weights.min() > 0.0
    assert set(acceptance_weights(4, pattern, "uniform")) == {1.0}
    x, y = 2.0 * patch_offsets(64, "grid").T - 1.0
    cosine, gaussian = (acceptance_weights(64, "grid", name) for name in ("cosine", "gaussian"))
    np.testing.assert_allclose(cosine * (2 / np.pi) ** 2, np.cos(np.pi * x / 2) * np.cos(np.pi * y / 2), atol=1e-3)
    centre, side = np.argmin(x**2 + y**2), np.argmin((x - 1) ** 2 + y**2)
    assert gaussian[side] / gaussian[centre] == pytest.approx(0.5, rel=0.03)


def test_sampling_names_what_it_does_not_know():
    with pytest.raises(RenderError, match="pattern 'poisson' is not known; valid: grid, lattice"):
        Sampling(2, "poisson")
    with pytest.raises(RenderError, match="acceptance 'box' is not known; valid: uniform, cosine, gaussian"):
        Sampling(2, "grid", "box")
