"""Snap, steps, clearance, sampling and maps: laws, and brute force on small floors."""

import numpy as np
import pytest
from rooms import blocked_boxes, random_room, visible

from prnav.errors import NavMeshError
from prnav.navmesh import NavMesh, NavMeshSet, PolyMesh


def on_floor(navmesh, points):
    found = navmesh.snap(points)
    return np.hypot(*(found - points)[:, [0, 2]].T) < 1e-6


def test_snap_finds_the_nearest_point_of_all_triangles():
    navmesh, *_ = random_room(0, slope=0.0)
    rng = np.random.default_rng(0)
    low, high = navmesh.bounds
    points = rng.uniform(low - 1.5, high + 1.5, (300, 3))
    points[:, 1] = low[1] + rng.uniform(-0.1, 0.1, 300)
    boxes = np.array([[c[:, 0].min(), c[:, 2].min(), c[:, 0].max(), c[:, 2].max()] for c in
                      (navmesh.mesh.polygon(p) for p in range(navmesh.mesh.num_polygons))])  # fmt: skip
    nearest = np.clip(points[:, None, [0, 2]], boxes[:, :2], boxes[:, 2:])
    distance = np.linalg.norm(nearest - points[:, None, [0, 2]], axis=-1).min(axis=1)
    got = navmesh.snap(points)
    close = distance < 1.4
    assert close.any() and not close.all()
    moved = np.hypot(*(got - points)[:, [0, 2]].T)
    assert np.allclose(moved[close], distance[close], atol=1e-9)
    assert np.allclose(got[close, 1], low[1])


def test_snap_is_idempotent_and_misses_are_nan():
    navmesh, *_ = random_room(1)
    points = navmesh.random_points(200, 0)
    assert np.allclose(navmesh.snap(points), points, atol=1e-9)
    assert np.isnan(navmesh.snap([[1e6, 0.0, 0.0], [np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]])).all()
    assert navmesh.island_of([[1e6, 0.0, 0.0]]) == -1


def test_random_points_are_uniform_by_area_and_repeatable():
    navmesh, free, xs, zs = random_room(4)
    points = navmesh.random_points(20_000, 7)
    assert np.array_equal(points[:100], navmesh.random_points(100, 7))
    counts = np.histogram2d(points[:, 2], points[:, 0], bins=[zs, xs])[0]
    area = np.diff(zs)[:, None] * np.diff(xs)[None] * free
    want = area / area.sum() * len(points)
    assert (counts[~free] == 0).all()
    assert (np.abs(counts - want) < 5 * np.sqrt(want + 1)).all()


def test_area_and_islands():
    navmesh, free, xs, zs = random_room(5, slope=0.0)
    area = (np.diff(zs)[:, None] * np.diff(xs)[None])[free].sum()
    assert navmesh.area == pytest.approx(area)
    assert navmesh.area == pytest.approx(sum(island.area for island in navmesh.islands))
    labels = navmesh.island_of(navmesh.random_points(2000, 0))
    assert set(labels.tolist()) == set(range(len(navmesh.islands)))


@pytest.mark.parametrize("seed", range(6))
def test_straight_steps_end_at_the_first_wall(seed):
    navmesh, free, xs, zs = random_room(seed)
    rng = np.random.default_rng(seed)
    starts = navmesh.random_points(150, seed)
    ends = starts + rng.normal(size=starts.shape) * [1.5, 0, 1.5]
    same = navmesh.island_of(ends) == navmesh.island_of(starts)
    starts, ends = starts[same], ends[same]
    got, collided = navmesh.step(starts, ends, sliding=False)
    boxes = blocked_boxes(free, xs, zs)
    low, high = np.array([xs[0], zs[0]]), np.array([xs[-1], zs[-1]])
    for start, end, stop, hit in zip(starts, ends, got, collided, strict=True):
        a, b, s = start[[0, 2]], end[[0, 2]], stop[[0, 2]]
        far = np.linalg.norm(b - a)
        t = np.linalg.norm(s - a) / far
        assert np.allclose(a + t * (b - a), s, atol=2e-4)  # on the line, or nudged off a wall by 0.1 mm
        assert visible(a, a + t * (b - a) * (1 - 1e-4 / far), boxes, low, high)
        if hit and t < 0.99:
            assert not visible(a, a + t * (b - a) + (b - a) / far * 1e-3, boxes, low, high)
        if visible(a, b, boxes, low, high):
            assert np.allclose(s, b)


@pytest.mark.parametrize("sliding", [True, False])
@pytest.mark.parametrize("reach", [0.25, 3.0])
def test_steps_never_leave_the_surface(sliding, reach):
    rng = np.random.default_rng(0)
    for seed in range(4):
        navmesh, *_ = random_room(seed, size=8)
        at = navmesh.random_points(100, seed)
        island = navmesh.island_of(at)
        for _ in range(25):
            yaw = rng.uniform(0, 2 * np.pi, len(at))
            wanted = at + reach * np.stack([np.cos(yaw), 0 * yaw, np.sin(yaw)], axis=1)
            got, collided = navmesh.step(at, wanted, sliding)
            assert np.isfinite(got).all() and on_floor(navmesh, got).all()
            assert np.array_equal(navmesh.island_of(got), island)
            # the segment walked: every point of it is floor
            steps = at[:, None] + np.linspace(0, 1, 9)[None, :, None] * (got - at)[:, None]
            offset = navmesh.snap(steps.reshape(-1, 3)) - steps.reshape(-1, 3)
            assert np.hypot(*offset[:, [0, 2]].T).max() < 2e-4
            short = np.einsum("ij,ij->i", got - at, got - at) + 1e-5 < reach**2
            assert np.array_equal(collided, short)
            at = got


def test_sliding_goes_at_least_as_near_to_the_wanted_end():
    navmesh, *_ = random_room(3, slope=0.0)
    rng = np.random.default_rng(3)
    starts = navmesh.random_points(2000, 3)
    ends = starts + 0.25 * np.stack([rng.normal(size=2000), np.zeros(2000), rng.normal(size=2000)], axis=1)
    slid, _ = navmesh.step(starts, ends, True)
    stopped, _ = navmesh.step(starts, ends, False)
    gap = np.linalg.norm(slid - ends, axis=1) - np.linalg.norm(stopped - ends, axis=1)
    assert gap.max() < 2e-4 and (gap < -1e-3).any()


def test_steps_that_cannot_be_taken_leave_the_agent_where_it_is():
    navmesh, *_ = random_room(3)
    start = navmesh.random_points(1, 0)
    nowhere = np.array([[1e6, 0.0, 0.0]])
    for a, b in ((start, start * np.nan), (nowhere, start), (start, start)):
        got, collided = navmesh.step(a, b)
        assert np.array_equal(got, a) or np.allclose(got, a)
        assert got.shape == (1, 3) and collided.shape == (1,)


def test_clearance_is_the_distance_to_the_nearest_wall():
    navmesh, free, xs, zs = random_room(2, slope=0.0)
    padded = np.pad(free, 1)
    walls = []
    for r, c in zip(*np.nonzero(free), strict=True):
        x0, x1, z0, z1 = xs[c], xs[c + 1], zs[r], zs[r + 1]
        for dr, dc, wall in ((-1, 0, (x0, z0, x1, z0)), (1, 0, (x0, z1, x1, z1)),
                             (0, -1, (x0, z0, x0, z1)), (0, 1, (x1, z0, x1, z1))):  # fmt: skip
            if not padded[r + 1 + dr, c + 1 + dc]:
                walls.append(wall)
    walls = np.array(walls)
    points = navmesh.random_points(300, 0)
    nearest = np.clip(points[:, None, [0, 2]], walls[:, :2], walls[:, 2:])
    want = np.minimum(np.linalg.norm(nearest - points[:, None, [0, 2]], axis=-1).min(axis=1), 0.3)
    assert np.allclose(navmesh.clearance(points, 0.3), want)
    assert navmesh.clearance([[1e6, 0.0, 0.0]]) == np.inf


def test_topdown_map_shows_the_free_cells():
    navmesh, free, xs, zs = random_room(5, slope=0.0)
    picture = navmesh.topdown(float(navmesh.bounds[0, 1]), 0.1)
    x, z = xs[0] + 0.1 * np.arange(picture.shape[1]), zs[0] + 0.1 * np.arange(picture.shape[0])
    column = np.clip(np.searchsorted(xs, x, side="right") - 1, 0, len(xs) - 2)
    row = np.clip(np.searchsorted(zs, z, side="right") - 1, 0, len(zs) - 2)
    assert (picture == free[row][:, column]).mean() > 0.97  # a map may show a centimetre more
    assert picture[free[row][:, column]].mean() > 0.999


def test_a_set_answers_as_its_members_do():
    rooms = [random_room(seed)[0] for seed in range(3)]
    navmeshes = NavMeshSet(rooms)
    rng = np.random.default_rng(0)
    scenes = rng.integers(0, 3, 90)
    starts = np.array([rooms[s].random_points(90, 1)[i] for i, s in enumerate(scenes)])
    ends = starts + rng.normal(size=starts.shape) * [0.5, 0, 0.5]
    positions, collided = navmeshes.step(scenes, starts, ends)
    snapped, clear = navmeshes.snap(scenes, ends), navmeshes.clearance(scenes, starts)
    for s in range(3):
        mine = scenes == s
        alone = rooms[s].step(starts[mine], ends[mine])
        assert np.array_equal(positions[mine], alone[0]) and np.array_equal(collided[mine], alone[1])
        assert np.array_equal(snapped[mine], rooms[s].snap(ends[mine]), equal_nan=True)
        assert np.array_equal(clear[mine], rooms[s].clearance(starts[mine]))
        for i in np.flatnonzero(mine)[:5]:
            assert np.array_equal(rooms[s].step(starts[i], ends[i])[0][0], positions[i])


def test_wrong_shapes_are_named():
    navmesh, *_ = random_room(0)
    with pytest.raises(NavMeshError, match=r"points have shape \(4, 2\); valid: \(N, 3\), x y z in metres"):
        navmesh.snap(np.zeros((4, 2)))
    assert navmesh.snap([]).shape == (0, 3)


def test_a_mesh_without_floor_is_refused():
    with pytest.raises(NavMeshError, match="navmesh has no polygon that can be walked"):
        NavMesh(PolyMesh.empty(np.zeros((2, 3))))
