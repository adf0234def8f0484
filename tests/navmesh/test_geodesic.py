"""Shortest paths against brute force, and the laws of distances."""

import numpy as np
import pytest
from rooms import random_room, shortest_distances

from prnav.errors import NavMeshError
from prnav.navmesh import GoalFields, NavMeshSet


def ground_length(path):
    return np.linalg.norm(np.diff(path[:, [0, 2]], axis=0), axis=1).sum()


def sample(navmesh, xs, zs, seed):
    """Random points, and grid corners and edge points, where rounding has most to say."""
    rng = np.random.default_rng(seed)
    snapped = navmesh.snap([[x, 0.25 * x, z] for x in xs for z in zs])
    exact = np.array([[x, z] for x in xs for z in zs])
    corners = snapped[np.abs(snapped[:, [0, 2]] - exact).max(axis=1) < 1e-9]
    on_lines = navmesh.random_points(6, seed)
    on_lines[:, 0] = xs[np.abs(xs[:, None] - on_lines[:, 0]).argmin(axis=0)]
    points = np.concatenate([navmesh.random_points(6, seed + 1), rng.permutation(corners)[:6], navmesh.snap(on_lines)])
    return points[np.isfinite(points).all(axis=1)]


@pytest.mark.parametrize("seed", range(12))
def test_distances_equal_the_visibility_graph(seed):
    navmesh, free, xs, zs = random_room(seed)
    points = sample(navmesh, xs, zs, seed)
    oracle = shortest_distances(points[:, [0, 2]], free, xs, zs)
    islands = navmesh.island_of(points)
    fields = GoalFields(NavMeshSet([navmesh]), len(points))
    fields.prepare(np.arange(len(points)), np.zeros(len(points)), points)
    for i, goal in enumerate(points):
        pairs = navmesh.distances(points, goal)
        field, corners = fields.query(np.full(len(points), i), points)
        for j, start in enumerate(points):
            if islands[i] != islands[j]:
                assert pairs[j] == np.inf and field[j] == np.inf and np.isnan(corners[j]).all()
                continue
            path = navmesh.path(start, goal)
            assert ground_length(path) == pytest.approx(oracle[i, j], abs=1e-6)
            length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
            assert pairs[j] == pytest.approx(length, abs=1e-9)
            assert field[j] == pytest.approx(length, abs=1e-6)


def test_paths_stay_on_the_floor_and_turn_where_the_field_says():
    navmesh, *_ = random_room(3, size=9)
    points = navmesh.random_points(40, 5)
    goal = points[0]
    fields = GoalFields(NavMeshSet([navmesh]), 1)
    fields.prepare([0], [0], goal)
    distances, corners = fields.query(np.zeros(len(points), int), points)
    for point, distance, corner in zip(points, distances, corners, strict=True):
        path = navmesh.path(point, goal)
        if not np.isfinite(distance):
            assert len(path) == 0
            continue
        assert np.allclose(path[0], point) and np.allclose(path[-1], goal)
        ends, collided = navmesh.step(path[:-1], path[1:], sliding=False)
        assert not collided.any() and np.allclose(ends, path[1:], atol=1e-5)
        if distance > 0:
            assert np.linalg.norm(path[1] - corner) < 1e-6


def test_distances_are_symmetric_and_keep_the_triangle_inequality():
    navmesh, *_ = random_room(1, size=10, slope=0.0)
    points = navmesh.random_points(24, 1)
    table = np.array([navmesh.distances(points, p) for p in points])
    assert np.array_equal(table, table.T)
    assert (np.diag(table) == 0).all()
    straight = np.linalg.norm(points[:, None] - points[None], axis=-1)
    assert (table >= straight - 1e-9).all()
    through = (table[:, :, None] + table[None]).min(axis=1)
    assert (table <= through + 1e-8)[np.isfinite(table)].all()
    same = navmesh.island_of(points)
    assert np.array_equal(np.isfinite(table), same[:, None] == same[None])


def test_rows_do_not_depend_on_the_batch():
    rooms = [random_room(seed)[0] for seed in (0, 4, 5)]
    navmeshes = NavMeshSet(rooms)
    scenes = np.random.default_rng(0).integers(0, 3, 40)
    a = np.array([rooms[s].random_points(40, 1)[i] for i, s in enumerate(scenes)])
    b = np.array([rooms[s].random_points(40, 2)[i] for i, s in enumerate(scenes)])
    together = navmeshes.distances(scenes, a, b)
    assert np.array_equal(together, [rooms[s].distance(p, q) for s, p, q in zip(scenes, a, b, strict=True)])
    fields = GoalFields(navmeshes, 40)
    fields.prepare(np.arange(40), scenes, b)
    at_once = fields.query(np.arange(40), a)
    for i, s in enumerate(scenes):
        alone = GoalFields(NavMeshSet([rooms[s]]), 1)
        alone.prepare([0], [0], b[i])
        distance, corner = alone.query([0], a[i])
        assert distance[0] == at_once[0][i]
        assert np.array_equal(corner[0], at_once[1][i], equal_nan=True)


def test_slots_can_be_prepared_again_in_any_order():
    navmesh, *_ = random_room(2, size=12)
    points = navmesh.random_points(60, 0)
    fields = GoalFields(NavMeshSet([navmesh]), 5)
    rng = np.random.default_rng(1)
    goals = {}
    for _ in range(60):
        slot, goal = int(rng.integers(5)), int(rng.integers(60))
        fields.prepare([slot], [0], points[goal])
        goals[slot] = goal
        for s, g in goals.items():
            got, _ = fields.query(np.full(8, s), points[:8])
            assert np.allclose(got, navmesh.distances(points[:8], points[g]), atol=1e-9)


def test_a_slot_never_prepared_and_a_goal_off_the_floor_are_unreachable():
    navmesh, *_ = random_room(2)
    fields = GoalFields(NavMeshSet([navmesh]), 2)
    fields.prepare([1], [0], [[1e4, 0.0, 0.0]])
    distances, corners = fields.query([0, 1], navmesh.random_points(2, 0))
    assert (distances == np.inf).all() and np.isnan(corners).all()


def test_memory_grows_with_what_a_search_needs(monkeypatch):
    from prnav.navmesh import scratch

    navmesh, *_ = random_room(6, size=10)
    points = navmesh.random_points(30, 0)
    want = navmesh.distances(points[:15], points[15:])
    monkeypatch.setattr(scratch, "FIRST_WINDOWS", 4)
    small = random_room(6, size=10)[0]
    assert np.array_equal(small.distances(points[:15], points[15:]), want)
    monkeypatch.setattr(scratch, "MOST_WINDOWS", 4)
    with pytest.raises(NavMeshError, match="needs more than 4 windows; the mesh is broken"):
        random_room(6, size=10)[0].distances(points[:15], points[15:])


def test_wrong_slots_and_scenes_are_named():
    navmesh, *_ = random_room(2)
    fields = GoalFields(NavMeshSet([navmesh]), 2)
    with pytest.raises(NavMeshError, match=r"slot 2\.\.2 out of range; valid: 0 to 1"):
        fields.prepare([2], [0], [[0.0, 0.0, 0.0]])
    with pytest.raises(NavMeshError, match=r"scene index 1\.\.1 out of range; valid: 0 to 0"):
        fields.prepare([0], [1], [[0.0, 0.0, 0.0]])
    with pytest.raises(NavMeshError, match="1 slots for 2 points; there must be one per row"):
        fields.query([0], np.zeros((2, 3)))
