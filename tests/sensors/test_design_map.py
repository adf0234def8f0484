"""Laws of the map from theta to poses: the surface, frozen axes, limits, links, the inverse."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from prnav.errors import DesignError
from prnav.sensors import (
    AXES,
    MIRROR,
    Body,
    Design,
    DesignSpace,
    Link,
    MeshBody,
    effective_theta,
    free_values,
    load_design,
    moved_design,
    pose_to_theta,
    random_design,
    save_design,
    theta_to_pose,
    with_free_values,
)

seeds = st.integers(0, 2**32 - 1)
spreads = st.floats(0.01, 3.0)


def box(width=0.3, height=1.0, depth=0.5) -> MeshBody:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (0, 1) for z in (-0.5, 0.5)]) * [width, height, depth]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return MeshBody(corners, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]), "box.stl")


def horseshoe() -> MeshBody:
    """A U of three boxes seen from above, as one closed prism: its centre of mass sees not all of it."""
    plan = np.array([(0, 0), (6, 0), (6, 6), (4, 6), (4, 1), (2, 1), (2, 6), (0, 6)], float) / 10.0
    n = len(plan)
    ring = np.stack([plan[:, 0], np.zeros(n), plan[:, 1]], axis=1)
    caps = [(0, 1, 5), (1, 4, 5), (1, 2, 4), (2, 3, 4), (0, 5, 6), (0, 6, 7)]
    faces = [(a, b, c) for a, b, c in caps] + [(a + n, c + n, b + n) for a, b, c in caps]
    faces += [t for i in range(n) for t in ((i, n + i, (i + 1) % n), ((i + 1) % n, n + i, n + (i + 1) % n))]
    return MeshBody(np.concatenate([ring, ring + [0, 0.5, 0]]), np.array(faces))


BODIES = {"cylinder": Body(), "flat cylinder": Body(0.4, 0.3), "box": box(), "horseshoe": horseshoe()}


@pytest.mark.parametrize("name", BODIES)
@settings(max_examples=40, deadline=None)
@given(seed=seeds, spread=spreads)
def test_positions_never_leave_the_surface_and_the_inverse_is_exact(name, seed, spread):
    design = random_design(seed % 50, 3, body=BODIES[name])
    theta = np.random.default_rng(seed).normal(0.0, spread, (4, 3, 7))
    pose = theta_to_pose(theta, design)
    assert design.body.distance(pose[..., :3]).max() < 1e-9
    assert pose[..., 6].min() >= design.space.fov_min and pose[..., 6].max() <= design.space.fov_max
    np.testing.assert_allclose(theta_to_pose(pose_to_theta(pose, design), design), pose, atol=1e-9)


@pytest.mark.parametrize("name", ["cylinder", "flat cylinder", "box"])
def test_every_place_can_be_reached_from_every_other(name):
    body = BODIES[name]
    u = np.random.default_rng(0).random((2, 3000, 3))
    a, b = body.sample(u[0]), body.sample(u[1])
    np.testing.assert_allclose(body.move(a, body.push(a, b)), b, atol=1e-9)


@pytest.mark.parametrize("name", ["cylinder", "flat cylinder", "box"])
@settings(max_examples=40, deadline=None)
@given(seed=seeds)
def test_a_small_change_of_theta_is_a_small_change_of_place(name, seed):
    rng = np.random.default_rng(seed)
    body = BODIES[name]
    start = body.sample(rng.random((1, 3)))
    path = rng.normal(0, 0.5, 3) + np.linspace(0, 1, 2000)[:, None] * rng.normal(0, 0.3, 3)
    steps = np.linalg.norm(np.diff(body.move(start, path), axis=0), axis=1)
    assert steps.max() < 0.01


@settings(max_examples=60, deadline=None)
@given(seed=seeds, spread=spreads, frozen=st.sets(st.sampled_from(AXES)))
def test_frozen_axes_never_move(seed, spread, frozen):
    base = random_design(seed % 50, 2)
    design = Design("d", base.sensors, space=DesignSpace(frozen=tuple(sorted(frozen))), frozen=(("yaw",), ()))
    pose = theta_to_pose(np.random.default_rng(seed).normal(0.0, spread, (5, 2, 7)), design)
    for axis in frozen:
        column = AXES.index(axis)
        np.testing.assert_array_equal(pose[..., column], np.broadcast_to(design.sensors[:, column], (5, 2)))
    np.testing.assert_array_equal(pose[:, 0, 3], np.full(5, design.sensors[0, 3]))
    assert design.body.distance(pose[..., :3]).max() < 1e-9
    np.testing.assert_allclose(theta_to_pose(pose_to_theta(pose, design), design), pose, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(seed=seeds, spread=spreads)
def test_limits_hold(seed, spread):
    limits = (("x", -0.09, 0.05), ("y", 0.5, 1.3), ("pitch", -1.0, 0.5))
    space = DesignSpace(limits=limits, fov_min=0.5, fov_max=1.5)
    design = random_design(seed % 50, 2, space=space)
    pose = theta_to_pose(np.random.default_rng(seed).normal(0.0, spread, (5, 2, 7)), design)
    assert (pose >= space.low - 1e-9).all() and (pose <= space.high + 1e-9).all()
    assert design.body.distance(pose[..., :3]).max() < 1e-9


@settings(max_examples=40, deadline=None)
@given(seed=seeds, spread=spreads)
def test_links_hold(seed, spread):
    rng = np.random.default_rng(seed)
    rabbit = load_design("rabbit")
    pose = theta_to_pose(rng.normal(0.0, spread, (5, 2, 7)), rabbit)
    np.testing.assert_array_equal(pose[:, 1], pose[:, 0] * MIRROR)
    rose = load_design("compass-rose")
    theta = rng.normal(0.0, 0.2, (5, 4, 7)) * [1, 0.2, 1, 1, 1, 1, 1]  # on the side
    pose = theta_to_pose(theta, rose)
    around = np.arctan2(pose[..., 0], -pose[..., 2]) - np.arctan2(rose.sensors[:, 0], -rose.sensors[:, 2])
    np.testing.assert_allclose(np.cos(around - around[:, :1]), 1.0)
    change = pose - rose.sensors
    np.testing.assert_allclose(change[..., [1, 3, 4, 5, 6]], np.repeat(change[:, :1], 4, 1)[..., [1, 3, 4, 5, 6]])


def test_free_values_are_what_a_search_works_on():
    rabbit = load_design("rabbit")
    assert rabbit.free.sum() == 7 and load_design("forward").free.sum() == 14
    values = np.random.default_rng(0).normal(size=(3, 7))
    theta = with_free_values(values, rabbit)
    np.testing.assert_array_equal(free_values(theta, rabbit), values)
    np.testing.assert_array_equal(effective_theta(theta, rabbit), theta)
    moved = moved_design(rabbit, theta[0], "moved")
    np.testing.assert_allclose(moved.sensors, theta_to_pose(theta[0], rabbit), atol=1e-12)
    assert moved.links == rabbit.links


def test_a_design_file_says_it_all(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.Trimesh(box().vertices, box().faces).export(tmp_path / "box.stl")
    space = DesignSpace(frozen=("roll",), limits=(("y", 0.25, 0.75), ("yaw", -1.0, 1.0)))
    row = [0.05, 0.5, -0.25, 0.25, 0.0, 0.0, 1.0]
    design = Design("d", [row, row * MIRROR], 2, box(), space, "x", (("x", "y", "z"), ()), (Link(1, 0, True),))
    save_design(design, tmp_path / "d.toml")
    back = load_design(tmp_path / "d.toml")
    assert (back.space.frozen, back.frozen, back.links) == (space.frozen, design.frozen, design.links)
    np.testing.assert_allclose(back.space.low, space.low)
    np.testing.assert_allclose(back.sensors, design.sensors)
    np.testing.assert_allclose(back.body.sample(np.full((1, 3), 0.3)), box().sample(np.full((1, 3), 0.3)), atol=1e-7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[space]\nfrozen=['role']", "frozen: 'role' is not an axis; valid: x, y, z, yaw"),
        ("[space.limits]\ny=[1.3, 1.4]", "sensor 0: y is 1.2 m; it must lie within 1.3 to 1.4"),
        ("[space.limits]\npitch_deg=[10, -10]", "limits of pitch are .* the first must be the smaller"),
        ("[[sensors]]\nmirror_of=3", "sensor 1: mirror_of is 3; name a sensor that stands before it"),
        ("[[sensors]]\nposition=[0.1, 1.2, 0.0]\nmirror_of=0", "sensor 1: it is not the mirror image of sensor 0"),
        ("[[sensors]]\ntied_to=0", "sensor 1: it lacks position"),
        ("[[sensors]]\nposition=[0.1, 1.2, 0.0]\ntied_to=1", "it follows sensor 1, which must not be itself"),
        ("[body]\nmesh='../robot.stl'", "leaves its data root"),
        ("[body]\nmesh='none.stl'", "none.stl: cannot be read"),
    ],
)
def test_mistakes_in_a_file_are_one_clear_line(tmp_path, text, message):
    sensor = "[[sensors]]\nposition=[0.0, 1.2, -0.1]\n"
    (tmp_path / "bad.toml").write_text(f"name='bad'\n{sensor}{text}\n")
    with pytest.raises(DesignError, match=message) as caught:
        load_design(tmp_path / "bad.toml")
    assert "bad.toml" in str(caught.value) and "\n" not in str(caught.value)


def test_a_mesh_body_is_checked_and_answers_as_a_cylinder_would():
    good = box()
    with pytest.raises(DesignError, match="the mesh is not closed"):
        MeshBody(good.vertices, good.faces[1:])
    with pytest.raises(DesignError, match="a mesh body holds x, y and z together"):
        theta_to_pose(
            np.ones((1, 7)), Design("d", [[0, 0.5, -0.25, 0, 0, 0, 1]], body=good, space=DesignSpace(frozen=("x",)))
        )
    with pytest.raises(DesignError, match=r"sensor 0: position \(0, 0.5, 0\) lies inside the body \(mesh box.stl"):
        Design("d", [[0, 0.5, 0, 0, 0, 0, 1]], body=good)
    assert good.centre is not None and horseshoe().centre is None
    points = np.random.default_rng(0).uniform(-0.6, 1.2, (500, 3))
    inside = (np.abs(points[:, 0]) < 0.15) & (points[:, 1] > 0) & (points[:, 1] < 1) & (np.abs(points[:, 2]) < 0.25)
    np.testing.assert_array_equal(good.contains(points), inside)
    samples = good.sample(np.random.default_rng(1).random((20000, 3)))  # the oracle of the closest point
    nearest = np.linalg.norm(samples[None] - points[:60, None], axis=2).min(axis=1)
    assert (good.distance(points[:60]) <= nearest + 1e-9).all() and (good.distance(points[:60]) > nearest - 0.03).all()
    flipped = MeshBody(good.vertices, good.faces[:, ::-1])
    np.testing.assert_array_equal(flipped.contains(points), inside)
