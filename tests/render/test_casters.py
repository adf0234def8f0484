"""The engines that cast rays, against brute force, and the laws any engine keeps."""

import dataclasses

import numpy as np
import pytest

from prnav.render import Renderer
from prnav.render.rays import sensor_views, view_rays
from prnav.render.reference import intersect
from prnav.scene import load_scene


def test_hits_are_those_of_brute_force(caster, room, batch):
    _, positions, yaws, designs = batch
    views, size = sensor_views(positions, yaws, designs), 16
    triangle, depth = caster([room])._engine.trace(0, views, size)
    origins, directions = view_rays(views, size)
    true_triangle, true_depth, _, _ = intersect(room, origins.reshape(-1, 3), directions.reshape(-1, 3))
    true_triangle, true_depth = true_triangle.reshape(triangle.shape), true_depth.reshape(depth.shape)
    missed = true_triangle < 0
    assert 0.05 < missed.mean() < 0.9
    same = np.isclose(depth, true_depth, rtol=1e-4) | (np.isinf(depth) & np.isinf(true_depth))
    assert same.mean() >= 0.9999
    assert (triangle == true_triangle).mean() >= 0.999  # ties on shared edges
    assert (triangle == true_triangle)[same & ~np.isclose(depth, true_depth, rtol=1e-7)].mean() >= 0.999


@pytest.mark.parametrize("pattern", ["grid", "lattice"])
@pytest.mark.parametrize(("grid", "rays"), [(1, 4), (4, 1), (3, 9)])
def test_readings_are_those_of_brute_force(caster, rooms, batch, grid, rays, pattern):
    options = {"rays_per_receptor": rays, "background": (0.2, 0.5, 0.9), "pattern": pattern}
    fast = caster(rooms, **options).read(*batch, grid=grid)
    slow = Renderer(rooms, engine="reference", **options).read(*batch, grid=grid)
    assert fast.shape == slow.shape == (12, 3, grid, grid, 3)
    assert fast.dtype == slow.dtype == np.float32
    error = np.abs(fast - slow) * 255
    assert error.mean() <= 0.2
    assert (error < 0.01).mean() > 0.99  # the rest: rays within rounding of an edge, a texel's border or a level's


@pytest.mark.parametrize("acceptance", ["cosine", "gaussian"])
def test_weighted_readings_are_those_of_brute_force(caster, rooms, batch, acceptance):
    options = {"rays_per_receptor": 9, "background": (0.2, 0.5, 0.9), "acceptance": acceptance}
    fast = caster(rooms, **options).read(*batch, grid=2)
    error = np.abs(fast - Renderer(rooms, engine="reference", **options).read(*batch, grid=2)) * 255
    assert (error < 0.01).mean() > 0.99
    even = caster(rooms, **options | {"acceptance": "uniform"}).read(*batch, grid=2)
    assert np.abs(fast - even).mean() * 255 > 1.0


def test_depth_is_that_of_brute_force(caster, rooms, batch):
    fast = caster(rooms).depth(*batch, size=8)
    slow = Renderer(rooms, engine="reference").depth(*batch, size=8)
    np.testing.assert_array_equal(np.isinf(fast), np.isinf(slow))
    np.testing.assert_allclose(fast[np.isfinite(fast)], slow[np.isfinite(slow)], rtol=1e-4)


def test_one_reading_does_not_depend_on_its_batch(caster, rooms, batch):
    scenes, positions, yaws, designs = batch
    renderer = caster(rooms, rays_per_receptor=4)
    whole = renderer.read(*batch)
    for i in range(len(scenes)):
        alone = renderer.read(scenes[i : i + 1], positions[i : i + 1], yaws[i : i + 1], designs[i : i + 1])
        np.testing.assert_array_equal(alone[0], whole[i])
    turned = renderer.read(scenes[::-1], positions[::-1], yaws[::-1], designs[::-1, ::-1])
    np.testing.assert_array_equal(turned[::-1, ::-1], whole)


def test_a_big_batch_is_the_same_as_small_ones(caster, rooms, batch):
    """More rays than one call of the tracer takes, so that runs end in the middle of views."""
    many = [np.repeat(array, 30, axis=0) for array in batch]
    renderer = caster(rooms, rays_per_receptor=9)
    np.testing.assert_array_equal(renderer.read(*many, grid=5)[::30], renderer.read(*batch, grid=5))


def test_a_coarse_grid_is_the_mean_of_a_finer_one(caster, room, batch):
    _, *poses = batch
    scenes = np.zeros(12, int)
    fine = caster([room], rays_per_receptor=4).read(scenes, *poses, grid=8)
    coarse = caster([room], rays_per_receptor=16).read(scenes, *poses, grid=4)
    np.testing.assert_allclose(fine.reshape(12, 3, 4, 2, 4, 2, 3).mean((3, 5)), coarse, atol=1e-6)
    picture = caster([room]).image(scenes, *poses, size=16)
    np.testing.assert_allclose(picture.reshape(12, 3, 4, 4, 4, 4, 3).mean((3, 5)), coarse, atol=1e-6)


def test_rolling_a_sensor_by_a_quarter_turn_rotates_its_grid(caster, room, batch):
    _, positions, yaws, designs = batch
    renderer = caster([room], rays_per_receptor=16)
    scenes = np.zeros(12, int)
    upright = renderer.read(scenes, positions, yaws, designs)
    rolled = designs.copy()
    rolled[..., 5] += np.pi / 2
    error = np.abs(np.rot90(upright, -1, axes=(2, 3)) - renderer.read(scenes, positions, yaws, rolled))
    assert error.mean() * 255 < 0.05


def test_a_rigid_motion_of_scene_and_agents_changes_nothing(caster, room, batch):
    _, positions, yaws, designs = batch
    turn, shift = 0.7, np.array([3.0, -1.0, 2.0])
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    moved = dataclasses.replace(room, vertices=(room.vertices @ rotation.T + shift).astype(np.float32))
    scenes = np.zeros(12, int)
    here = caster([room]).read(scenes, positions, yaws, designs)
    there = caster([moved]).read(scenes, positions @ rotation.T + shift, yaws + turn, designs)
    error = np.abs(here - there) * 255
    assert error.mean() < 0.2
    assert np.median(error) < 0.01


def test_a_pose_of_the_body_and_of_the_sensor_are_the_same_thing(caster, room, batch):
    _, positions, yaws, designs = batch
    scenes = np.zeros(12, int)
    moved = designs.copy()
    c, s = np.cos(yaws)[:, None], np.sin(yaws)[:, None]
    x, z = designs[..., 0], designs[..., 2]
    moved[..., 0], moved[..., 2] = c * x + s * z, c * z - s * x
    moved[..., :3] += positions[:, None]
    moved[..., 3] += yaws[:, None]
    ours = caster([room]).read(scenes, np.zeros((12, 3)), np.zeros(12), moved)
    assert np.abs(ours - caster([room]).read(scenes, positions, yaws, designs)).mean() * 255 < 0.05


def test_footprint_levels_average_a_texture_seen_from_afar(caster, room):
    """One ray into a busy texture from far away reads near the texture's mean, not one texel."""
    from prnav.scene import SceneMesh, TextureAtlas

    image = np.random.default_rng(0).integers(0, 2, (256, 256, 3), dtype=np.uint8) * 255
    vertices = np.array([[-50, -50, -10], [50, -50, -10], [50, 50, -10], [-50, 50, -10]], dtype=np.float32)
    uvs = np.array([[0, 10], [10, 10], [10, 0], [0, 0]], dtype=np.float32)
    wall = SceneMesh(
        "wall",
        vertices,
        uvs,
        np.full((4, 3), 255, np.uint8),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        np.ones(2, np.int32),
        TextureAtlas.from_images([image]),
    )
    pose = (np.array([0]), np.zeros((1, 3)), np.zeros(1), np.array([[[0.3, 0.2, 0, 0, 0, 0, np.pi / 2]]]))
    one = caster([wall], rays_per_receptor=1).read(*pose, grid=4)
    assert np.abs(one - 0.5).max() < 0.05


@pytest.mark.parametrize("degrees", [1.0, 45.0, 150.0, 179.0])
def test_any_field_of_view_reads_what_brute_force_reads(caster, rooms, batch, degrees):
    scenes, positions, yaws, designs = batch
    designs = designs.copy()
    designs[..., 6] = np.radians(degrees)
    fast = caster(rooms, rays_per_receptor=4).read(scenes, positions, yaws, designs, grid=2)
    slow = Renderer(rooms, rays_per_receptor=4, engine="reference").read(scenes, positions, yaws, designs, grid=2)
    assert fast.std() > 0.05
    assert (np.abs(fast - slow) * 255 < 0.01).mean() > 0.98


@pytest.mark.parametrize("grid", [1, 3, 8])
def test_each_of_many_sensors_reads_as_if_it_were_alone(caster, rooms, batch, grid):
    scenes, positions, yaws, designs = batch
    many = np.concatenate([designs, designs[:, ::-1], designs + [0, 0, 0, 0.3, 0.1, -0.2, 0.0], designs[:, :2]], axis=1)
    assert many.shape[1] == 11
    renderer = caster(rooms, rays_per_receptor=4)
    readings = renderer.read(scenes, positions, yaws, many, grid=grid)
    assert readings.shape == (12, 11, grid, grid, 3)
    for k in (0, 5, 10):
        alone = renderer.read(scenes, positions, yaws, many[:, k : k + 1], grid=grid)
        np.testing.assert_array_equal(alone[:, 0], readings[:, k])


def test_new_designs_need_no_new_renderer(caster, rooms, batch):
    scenes, positions, yaws, designs = batch
    renderer = caster(rooms)
    renderer.read(*batch)
    turned = designs + [0.0, 0.1, 0.0, 0.5, 0.0, 1.0, 0.0]
    readings = renderer.read(scenes, positions, yaws, turned)
    np.testing.assert_array_equal(readings, caster(rooms).read(scenes, positions, yaws, turned))
    full = turned + [0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * np.pi, 0.0]
    assert np.abs(renderer.read(scenes, positions, yaws, full) - readings).mean() * 255 < 0.05


@pytest.mark.slow
def test_hits_in_a_house_are_those_of_brute_force(caster):
    home = load_scene("prhouses/test/00")
    rng = np.random.default_rng(0)
    low, high = home.bounds
    designs = np.zeros((40, 1, 7))
    designs[..., 3:6] = rng.uniform(-1.0, 1.0, (40, 1, 3))
    designs[..., 6] = np.radians(100.0)
    places = rng.uniform(low + [0.3, 0.4, 0.3], high - 0.3, (40, 3))
    views, size = sensor_views(places, rng.uniform(-3, 3, 40), designs), 16
    triangle, depth = caster([home])._engine.trace(0, views, size)
    origins, directions = view_rays(views, size)
    expected, distance, _, _ = intersect(home, origins.reshape(-1, 3), directions.reshape(-1, 3))
    same_depth = np.isclose(depth.ravel(), distance, rtol=1e-4) | (np.isinf(depth.ravel()) & np.isinf(distance))
    assert same_depth.mean() >= 0.9999
    assert (triangle.ravel() == expected).mean() >= 0.995  # the rest are doubled triangles and shared edges
