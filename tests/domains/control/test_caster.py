"""The compiled caster against MuJoCo's own rays and recorded pictures, and the laws that it keeps."""

from __future__ import annotations

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from prnav.domains.control.appearance import build_appearance  # noqa: E402
from prnav.domains.control.caster import Caster, WorldPoses  # noqa: E402
from prnav.domains.control.casting.solids import enter, holds, normal  # noqa: E402
from prnav.errors import RenderError  # noqa: E402

SHAPES = """
<mujoco><worldbody>
  <geom type="plane" size="0.5 0.4 0.1"/>
  <geom type="sphere" size="0.3"/>
  <geom type="capsule" size="0.2 0.3"/>
  <geom type="ellipsoid" size="0.2 0.3 0.4"/>
  <geom type="cylinder" size="0.2 0.3"/>
  <geom type="box" size="0.2 0.3 0.4"/>
</worldbody></mujoco>
"""

ROOM = """
<mujoco>
  <visual><headlight ambient="{ambient} {ambient} {ambient}" diffuse="{head} {head} {head}" specular="0 0 0"/></visual>
  <worldbody>
    <light type="directional" pos="0 0 3" dir="0 0 -1" diffuse="0.5 0.5 0.5" specular="0 0 0"/>
    <geom name="floor" type="plane" size="1 1 0.1" rgba="0.8 0.4 0.2 1"/>
    {more}
  </worldbody>
</mujoco>
"""


def room(more="", ambient=0.3, head=0.0):
    model = mujoco.MjModel.from_xml_string(ROOM.format(more=more, ambient=ambient, head=head))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, WorldPoses.of(data)


def looking(place, forward, up):
    """Place and axes of one sensor in one state."""
    back = -np.asarray(forward, float) / np.linalg.norm(forward)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.array(place, float)[None, None], np.stack([right, np.cross(back, right), back], axis=-1)[None, None]


DOWN = looking((0.0, 0.0, 0.8), (0, 0, -1), (0, 1, 0))


@pytest.fixture(scope="module")
def shapes():
    model = mujoco.MjModel.from_xml_string(SHAPES)
    return model, build_appearance(model).shapes


@pytest.mark.parametrize("kind", range(6), ids=["plane", "sphere", "capsule", "ellipsoid", "cylinder", "box"])
def test_rays_enter_shapes_where_mujoco_says(shapes, kind):
    model, rows = shapes
    rng = np.random.default_rng(kind)
    met = 0
    for _ in range(2000):
        origin = rng.normal(size=3) * 0.8
        way = rng.normal(size=3) * 0.3 - origin * rng.random()
        if holds(rows[kind], *origin) or (kind == 0 and origin[2] < 0.0):  # MuJoCo then gives the far wall, or nothing
            continue
        theirs = mujoco.mju_rayGeom(
            np.zeros(3), np.eye(3).ravel(), model.geom_size[kind], origin, way, model.geom_type[kind], None
        )
        ours = enter(rows[kind], *origin, *way)
        if theirs < 0.0:
            assert not 0.0 <= ours < np.inf
            continue
        met += 1
        assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-9)
        n = np.array(normal(rows[kind], *(origin + ours * way)))
        assert np.linalg.norm(n) == pytest.approx(1.0) and n @ way < 1e-9
    assert met > 200


def test_a_ray_along_a_capsules_axis_meets_its_end(shapes):
    _, rows = shapes
    assert enter(rows[2], 0.0, 0.0, 2.0, 0.0, 0.0, -1.0) == pytest.approx(1.5)
    assert enter(rows[2], 0.1, 0.0, -2.0, 0.0, 0.0, 1.0) == pytest.approx(2.0 - 0.3 - np.sqrt(0.04 - 0.01))
    assert enter(rows[2], 0.3, 0.0, 2.0, 0.0, 0.0, -1.0) == np.inf


def golden_readings(task, golden, grid, rays):
    with np.load(golden / "dmc" / task.name.replace("-", "_") / "readings.npz") as file:
        recorded = {name: file[name] for name in file.files}
    state = recorded["row_state"]
    read = task.read(
        recorded["qpos"][state],
        recorded["target"][state],
        list(recorded["sensor_body"]),
        recorded["sensor_pos"],
        recorded["sensor_quat"],
        np.radians(recorded["sensor_fovy"]),
        grid=grid,
        rays_per_receptor=rays,
    )
    truth = recorded["reading_4x4" if grid == 4 else "reading_1x1"].reshape(read.shape)
    levels = 255.0 * np.abs(read - truth).reshape(len(read), -1)
    return levels, np.isin(recorded["row_label"], ["inside", "below"])


def test_readings_of_many_rays_are_the_recorded_ones(task, golden):
    levels, special = golden_readings(task, golden, grid=4, rays=256)
    assert levels[~special].mean() < 0.6
    assert np.percentile(levels[~special], 99) < 6.0
    assert levels[special].mean() < 0.6 and np.percentile(levels[special], 99) < 6.0


def test_readings_of_sixteen_rays_are_near_the_recorded_ones(task, golden):
    levels, special = golden_readings(task, golden, grid=1, rays=16)
    assert levels[~special].mean() < 2.0


def many(count=37):
    """States with a moving ball, and three sensors in each."""
    model, poses = room('<geom type="sphere" name="ball" size="0.2" pos="0 0 0.3"/>', head=0.4)
    rng = np.random.default_rng(0)
    many_poses = WorldPoses(*(np.repeat(field, count, axis=0) for field in poses))
    many_poses.geom_xpos[:, 1] += 0.3 * rng.normal(size=(count, 3))
    places = rng.normal(size=(count, 3, 3)) + [0.0, 0.0, 2.0]
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3, 3)))[0]
    axes[..., 0] *= np.linalg.det(axes)[..., None]
    return model, many_poses, places, axes, np.array([0.6, 1.5, 2.5])


def test_readings_have_the_same_bits_in_any_batch_order_and_number_of_threads():
    model, poses, places, axes, fovs = many()
    caster = Caster(model)
    whole = caster.read(poses, places, axes, fovs, grid=2)
    assert whole.std() > 0.02
    assert (caster.read(poses, places, axes, fovs, grid=2, threads=3) == whole).all()
    order = np.random.default_rng(1).permutation(len(places))
    shuffled = caster.read(WorldPoses(*(field[order] for field in poses)), places[order], axes[order], fovs, grid=2)
    assert (shuffled == whole[order]).all()
    for n in (0, 17):
        one = WorldPoses(*(field[n : n + 1] for field in poses))
        for k in range(3):
            read = caster.read(one, places[n : n + 1, k : k + 1], axes[n : n + 1, k : k + 1], fovs[k : k + 1], grid=2)
            assert (read[0, 0] == whole[n, k]).all()


def test_a_state_that_is_not_finite_reads_black_and_spoils_no_other():
    model, poses, places, axes, fovs = many(5)
    caster = Caster(model)
    whole = caster.read(poses, places, axes, fovs, grid=2)
    poses.geom_xpos[2, 1] = np.nan
    places[3, 0] = np.inf
    read = caster.read(poses, places, axes, fovs, grid=2)
    assert (read[2] == 0.0).all() and (read[3, 0] == 0.0).all()
    same = np.ones((5, 3), bool)
    same[2], same[3, 0] = False, False
    assert (read[same] == whole[same]).all()


def test_patches_of_a_grid_add_up_to_one_receptor():
    model, poses, places, axes, fovs = many(8)
    fine = Caster(model, rays_per_receptor=256).read(poses, places, axes, fovs, grid=4).mean(axis=(2, 3))
    one = Caster(model, rays_per_receptor=1024).read(poses, places, axes, fovs, grid=1)[:, :, 0, 0]
    assert np.abs(fine - one).max() < 1.0 / 255.0


def test_more_rays_come_closer_and_samples_help():
    model, poses, places, axes, fovs = many(24)
    truth = Caster(model, rays_per_receptor=1024).read(poses, places, axes, fovs, grid=1)
    error = {
        (rays, samples): np.abs(Caster(model, rays_per_receptor=rays, samples=samples).read(
            poses, places, axes, fovs, grid=1) - truth).mean()
        for rays, samples in ((4, 1), (4, 4), (16, 4), (64, 4))
    }  # fmt: skip
    assert error[64, 4] < error[16, 4] < error[4, 4] < error[4, 1]


def test_pictures_have_row_0_at_the_top_and_column_0_at_the_left():
    model, poses = room('<geom type="sphere" size="0.1" pos="-0.3 0.3 0.1" rgba="0 0 1 1"/>', ambient=1.0)
    picture = Caster(model).image(poses, *DOWN, 1.2, size=32)[0, 0]
    row, column = np.argwhere(picture[..., 2] > 0.9).mean(axis=0)
    assert row < 12 and column < 12  # y up, x right


def test_light_is_ambient_plus_diffuse_and_shadows_take_the_second():
    model, poses = room()
    color = np.array([0.8, 0.4, 0.2])
    np.testing.assert_allclose(Caster(model).read(poses, *DOWN, 0.2, grid=1)[0, 0, 0, 0], 0.8 * color, atol=1e-6)
    model, poses = room('<geom type="sphere" size="0.2" pos="0 0 1.5"/>')
    np.testing.assert_allclose(Caster(model).read(poses, *DOWN, 0.2, grid=1)[0, 0, 0, 0], 0.3 * color, atol=1e-6)


def test_the_headlight_shines_along_the_sensors_axis():
    model, poses = room(head=0.6, ambient=0.0)
    model.light_active[:] = False
    tilted = looking((0.0, 0.0, 0.5), (1, 0, -1), (0, 0, 1))
    read = Caster(model).read(poses, *tilted, 0.1, grid=1)[0, 0, 0, 0]
    np.testing.assert_allclose(read, 0.6 * np.sqrt(0.5) * np.array([0.8, 0.4, 0.2]), atol=1e-6)


def test_a_plane_from_behind_lets_half_of_the_light_through():
    below = looking((0.0, 0.0, -0.5), (0, 0, 1), (0, 1, 0))
    ball = '<geom type="sphere" size="0.3" pos="0 0 0.5" rgba="0 1 0 1"/>'
    model, poses = room(ball, ambient=1.0)
    with_ball = Caster(model).read(poses, *below, 0.1, grid=1)[0, 0, 0, 0]
    model, poses = room(ambient=1.0)
    without = Caster(model).read(poses, *below, 0.1, grid=1)[0, 0, 0, 0]
    np.testing.assert_allclose(with_ball - without, [0.0, 0.49, 0.0], atol=1e-6)


def test_a_transparent_shape_is_blended_twice():
    model, poses = room('<site type="sphere" size="0.1" pos="0 0 0.3" rgba="0 0 1 0.4"/>', ambient=1.0)
    model.light_active[:] = False
    read = Caster(model).read(poses, *DOWN, 0.02, grid=1)[0, 0, 0, 0]
    np.testing.assert_allclose(read, 0.36 * np.array([0.8, 0.4, 0.2]) + 0.64 * np.array([0, 0, 1]), atol=1e-6)


def test_nothing_nearer_than_the_near_plane_is_seen_nor_back_faces():
    inside = looking((0.0, 0.0, 0.5), (0, 0, -1), (0, 1, 0))
    model, poses = room('<geom type="sphere" size="0.3" pos="0 0 0.5" rgba="0 1 0 1"/>', ambient=1.0)
    model.light_active[:] = False
    np.testing.assert_allclose(Caster(model).read(poses, *inside, 0.5, grid=1)[0, 0, 0, 0], [0.8, 0.4, 0.2], atol=1e-6)


def test_sites_of_high_groups_and_without_opacity_are_not_drawn():
    hidden = '<site type="sphere" size="0.1" pos="0 0 0.3" rgba="0 0 1 {}" group="{}"/>'
    plain = Caster(room()[0]).read(room()[1], *DOWN, 0.2, grid=1)
    for alpha, group in ((1, 3), (0, 0)):
        model, poses = room(hidden.format(alpha, group))
        assert (Caster(model).read(poses, *DOWN, 0.2, grid=1) == plain).all()


MIRROR = """
<mujoco>
  <asset><material name="mirror" reflectance="0.5" rgba="0 0 0 1" specular="0"/></asset>
  <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
  <worldbody>
    <geom type="plane" size="1 1 0.1" material="mirror"/>
    <geom type="sphere" size="0.2" pos="0.5 0 0.5" rgba="0.2 0.8 0.4 1"/>
  </worldbody>
</mujoco>
"""


def test_a_mirror_adds_its_share_of_what_it_reflects():
    model = mujoco.MjModel.from_xml_string(MIRROR)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    view = looking((-0.5, 0.0, 0.5), (1, 0, -1), (0, 0, 1))  # towards the middle, where the ball's image is
    read = Caster(model).read(WorldPoses.of(data), *view, 0.05, grid=1)[0, 0, 0, 0]
    np.testing.assert_allclose(read, [0.1, 0.4, 0.2], atol=1e-6)


def test_the_floor_of_the_papers_time_has_its_squares_meet_in_the_middle():
    from prnav.domains.control.models import reacher_hard

    model = reacher_hard()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    poses = WorldPoses.of(data)
    poses.geom_xpos[:, 5:] += 10.0  # only the floor and its walls
    view = looking((0.0, 0.0, 0.4), (0, 0, -1), (0, 1, 0))
    then = Caster(model, floor="mujoco-3.11", rays_per_receptor=256).read(poses, *view, 0.9, grid=2)[0, 0, ..., 0]
    now = Caster(model, rays_per_receptor=256).read(poses, *view, 0.9, grid=2)[0, 0, ..., 0]
    assert abs(then[0, 0] - then[1, 1]) < 0.01 and abs(then[0, 1] - then[1, 0]) < 0.01
    assert abs(then[0, 0] - then[0, 1]) > 0.05
    assert now.max() - now.min() < 0.03


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('<geom type="plane" size="0 0 1"/>', "a plane without end is not drawn"),
        ('<light type="point" pos="0 0 1"/>', "of type point; valid: spot, directional"),
    ],
)
def test_what_cannot_be_drawn_is_named(more, message):
    with pytest.raises(RenderError, match=message):
        Caster(room(more)[0])


def test_bad_settings_are_named():
    model, poses = room()
    with pytest.raises(RenderError, match="floor 'old' is not known; valid: today, mujoco-3.11"):
        Caster(model, floor="old")
    with pytest.raises(RenderError, match="samples of a ray are 3; valid: 1, 4"):
        Caster(model, samples=3)
    with pytest.raises(RenderError, match="rays_per_receptor is 5"):
        Caster(model, rays_per_receptor=5)
    with pytest.raises(RenderError, match="a field of view is 4 rad; it must lie between 0 and pi"):
        Caster(model).read(poses, *DOWN, 4.0)
    with pytest.raises(RenderError, match=r"geom_xpos have shape \(2, 1, 3\)"):
        Caster(model).read(WorldPoses(*(np.repeat(field, 2, axis=0) for field in poses)), *DOWN, 1.0)
    with pytest.raises(RenderError, match="receptors per row are 0"):
        Caster(model).read(poses, *DOWN, 1.0, grid=0)
