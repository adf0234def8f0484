"""Habitat's recorded answers on its own navigation meshes."""

import dataclasses
import json
import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from prnav.frames import forward, quaternion_to_yaw
from prnav.navmesh import GoalFields, NavMesh, NavMeshSet

GOLDEN = os.environ.get("PRNAV_GOLDEN")
SCENES = ["simple_room", "small_house", "iai_apartment", "dream_apartment", "hospital_two_floors"]
pytestmark = pytest.mark.skipif(not GOLDEN, reason="set PRNAV_GOLDEN to the folder of Habitat's recorded answers")


@cache
def load(name):
    folder = Path(GOLDEN) / name
    return NavMesh.load(folder / "scene.navmesh"), json.loads((folder / "golden.json").read_text())


def column(rows, key):
    """Points of a recording, (N, 3); null is NaN."""
    blank = [None] * 3
    return np.array([[np.nan if c is None else c for c in (row[key] or blank)] for row in rows], float)


def numbers(rows, key):
    return np.array([np.inf if row[key] is None else row[key] for row in rows], float)


@pytest.fixture(params=SCENES)
def scene(request):
    return request.param


def test_area_and_islands(scene):
    navmesh, golden = load(scene)
    assert navmesh.area == pytest.approx(golden["navigable_area"], rel=1e-6)
    assert [i.area for i in navmesh.islands] == pytest.approx(golden["island_area"], rel=1e-4)
    assert [i.radius for i in navmesh.islands] == pytest.approx(golden["island_radius"], abs=1e-4)


def test_the_file_written_has_the_same_bytes_but_for_links(scene, tmp_path):
    navmesh, _ = load(scene)
    original = (Path(GOLDEN) / scene / "scene.navmesh").read_bytes()
    navmesh.save(tmp_path / "same.navmesh")
    assert (tmp_path / "same.navmesh").read_bytes() == original
    dataclasses.replace(navmesh, file_tiles=None).save(tmp_path / "anew.navmesh")
    anew = (tmp_path / "anew.navmesh").read_bytes()
    assert len(anew) == len(original)
    nodes = 2 * navmesh.mesh.num_polygons * 16
    assert anew[-nodes:] == original[-nodes:]
    again = NavMesh.load(tmp_path / "anew.navmesh")
    for name, array in navmesh.mesh.to_arrays().items():
        assert np.array_equal(array, getattr(again.mesh, name)), name


def test_snap_and_islands_of_points(scene):
    navmesh, golden = load(scene)
    rows = golden["snap_point"]
    points, want = column(rows, "point"), column(rows, "result")
    got = navmesh.snap(points)
    assert np.array_equal(np.isnan(got), np.isnan(want))
    assert np.nanmax(np.abs(got - want)) < 1e-5
    assert np.array_equal(navmesh.is_navigable(points), [row["is_navigable"] for row in rows])
    assert np.array_equal(navmesh.island_of(points), [row["island"] for row in rows])


def test_distance_to_the_closest_obstacle(scene):
    navmesh, golden = load(scene)
    rows = golden["distance_to_closest_obstacle"]
    points = column(rows, "point")
    assert np.abs(navmesh.clearance(points) - numbers(rows, "distance")).max() < 1e-5
    assert np.abs(navmesh.clearance(points, 10.0) - numbers(rows, "distance_r10")).max() < 1e-5


@pytest.mark.parametrize("sliding", [True, False])
def test_short_steps(scene, sliding):
    navmesh, golden = load(scene)
    rows = golden["try_step"]
    starts, ends = column(rows, "start"), column(rows, "end")
    want = column(rows, "result_sliding" if sliding else "result_no_sliding")
    short = np.linalg.norm(ends - starts, axis=1) < 0.26
    got, _ = navmesh.step(starts, ends, sliding)
    off = np.linalg.norm(got - want, axis=1)
    assert (off[short] < 0.01).mean() >= 0.975
    origins = navmesh.snap(starts)
    on_floor = np.linalg.norm(origins - starts, axis=1) < 1e-3
    assert navmesh.is_navigable(got[on_floor]).all()
    if not sliding:
        return
    # Habitat's local search may reach round a corner. Where that leaves us farther from the wanted end than it, no
    # point of the floor within a straight line's reach is nearer than ours: held against 20,000 points tried
    ground = [0, 2]
    ours, theirs = (np.linalg.norm((x - ends)[:, ground], axis=1) for x in (got, want))
    reached, _ = navmesh.step(origins, want, sliding=False)
    legal = np.linalg.norm((reached - want)[:, ground], axis=1) < 1e-4
    farther = short & (ours > theirs + 0.01)
    assert not (farther & legal).any() and farther.sum() < 0.02 * short.sum()
    for i in np.flatnonzero(farther):
        rng = np.random.default_rng(int(i))
        angle, radius = rng.uniform(0, 2 * np.pi, 20_000), ours[i] * np.sqrt(rng.random(20_000))
        tried = ends[i] + np.stack([radius * np.cos(angle), np.zeros(20_000), radius * np.sin(angle)], axis=1)
        tried[:, 1] = origins[i, 1]
        tried = tried[np.linalg.norm((navmesh.snap(tried) - tried)[:, ground], axis=1) < 1e-6]
        stopped, _ = navmesh.step(np.broadcast_to(origins[i], tried.shape), tried, sliding=False)
        tried = tried[np.linalg.norm((stopped - tried)[:, ground], axis=1) < 3e-4]
        assert (np.linalg.norm((tried - ends[i])[:, ground], axis=1) > ours[i] - 2e-3).all()


def test_geodesics_are_never_longer_than_habitats(scene):
    navmesh, golden = load(scene)
    rows = golden["geodesic"]
    a, b, want = column(rows, "start"), column(rows, "end"), numbers(rows, "geodesic_distance")
    got = navmesh.distances(a, b)
    assert np.array_equal(np.isfinite(got), np.isfinite(want))
    reached = np.isfinite(want)
    assert (got[reached] - want[reached]).max() < 1e-3
    assert np.array_equal(got, navmesh.distances(b, a))
    fields = GoalFields(NavMeshSet([navmesh]), len(b))
    fields.prepare(np.arange(len(b)), np.zeros(len(b)), b)
    field, _ = fields.query(np.arange(len(b)), a)
    assert np.array_equal(np.isfinite(field), reached)
    assert np.abs(field[reached] - got[reached]).max() < 1e-9


@pytest.mark.parametrize("name", ["small_house", "iai_apartment"])
def test_geodesics_are_exact(name):
    navmesh, golden = load(name)
    rows = json.loads((Path(GOLDEN) / name / "exact_geodesic.json").read_text())
    pairs = golden["geodesic"]
    for row in rows:
        path = navmesh.path(pairs[row["pair"]]["start"], pairs[row["pair"]]["end"])
        ground = np.linalg.norm(np.diff(path[:, [0, 2]], axis=0), axis=1).sum()
        assert ground == pytest.approx(row["exact_xz"], rel=5e-4)


def test_pairs_off_the_floor(scene):
    navmesh, golden = load(scene)
    rows = golden["geodesic_offmesh"]
    got, want = navmesh.distances(column(rows, "start"), column(rows, "end")), numbers(rows, "geodesic_distance")
    assert np.array_equal(np.isfinite(got), np.isfinite(want))
    # the way is the shortest over the floor; where an end hangs in the air, a longer first leg would hide more of its
    # height, so that a way longer over the floor can be shorter in space: so far only ends above the body's knees
    for i in np.flatnonzero(got > want + 1e-3):
        a, b, path = rows[i]["start"], rows[i]["end"], np.array(rows[i]["points"])
        ours = navmesh.path(a, b)
        ground = [np.linalg.norm(np.diff(way[:, [0, 2]], axis=0), axis=1).sum() for way in (ours, path)]
        assert ground[0] <= ground[1] + 1e-5
        assert max(abs(navmesh.snap(p)[0, 1] - p[1]) for p in (a, b)) > 0.5
    assert (got > want + 1e-3).sum() <= 2


def test_the_triangle_inequality_holds_over_the_ground_and_nearly_in_space(scene):
    """Turning points are chosen over the ground, so a slope that a way over a third point avoids costs some length."""
    navmesh, _ = load(scene)
    areas = [island.area for island in navmesh.islands]
    points = navmesh.random_points(1500, 0)
    points = points[navmesh.island_of(points) == np.argmax(areas)][:100]
    table = np.array([navmesh.distances(points, p) for p in points])
    excess = np.array([table - (table[:, [k]] + table[[k]]) for k in range(len(points))])
    if np.ptp(points[:, 1]) < 1e-6:
        assert excess.max() < 2e-6
    assert excess.max() < 0.12 and (excess > 0.02 * table).sum() == 0
    assert (excess > 1e-6).mean() < 1e-3


def test_topdown_map(scene):
    navmesh, golden = load(scene)
    path = Path(GOLDEN) / scene / "topdown.npz"
    if not path.exists():
        pytest.skip(f"no map was recorded of {scene}")
    view = golden["topdown"]
    with np.load(path) as stored:
        want = stored[stored.files[0]]
    got = navmesh.topdown(view["height"], view["meters_per_pixel"], view["eps"])
    assert got.shape == want.shape and (got == want).mean() >= 0.999


def test_points_on_and_beside_corners_and_edges_keep_the_laws(scene):
    """Rounding has most to say where a path starts or ends on a corner, on an edge, or a hair beside one."""
    navmesh, _ = load(scene)
    rng = np.random.default_rng(0)
    s = navmesh.surface
    a = rng.permutation(len(s.corner))[:12]
    begin, edge = s.corner[a], s.corner[s.following[a]] - s.corner[a]
    parts = [begin, begin + 0.5 * edge, begin + rng.random((12, 1)) * edge]
    parts += [begin + rng.normal(size=(12, 3)) * size for size in (1e-9, 1e-7, 1e-6, 1e-5)]
    points = navmesh.snap(np.concatenate([*parts, navmesh.random_points(10, 0)]))
    count = len(points)
    table = np.array([navmesh.distances(points, p) for p in points])
    fields = GoalFields(NavMeshSet([navmesh]), count)
    fields.prepare(np.arange(count), np.zeros(count), points)
    field = np.array([fields.query(np.full(count, i), points)[0] for i in range(count)])
    island = navmesh.island_of(points)
    same = island[:, None] == island[None]
    assert np.array_equal(np.isfinite(table), same) and np.array_equal(np.isfinite(field), same)
    assert np.array_equal(table, table.T)
    assert np.abs(table[same] - field[same]).max() < 2e-6
    ground = np.full((count, count), np.inf)
    for i, j in zip(*np.nonzero(np.tril(same)), strict=True):
        ground[i, j] = ground[j, i] = np.linalg.norm(
            np.diff(navmesh.path(points[i], points[j])[:, [0, 2]], axis=0), axis=1
        ).sum()
    through = np.min([ground[:, [k]] + ground[[k]] for k in range(count)], axis=0)
    assert (ground[same] - through[same]).max() < 2e-6


def test_the_nearest_of_several_goals(scene):
    navmesh, golden = load(scene)
    for row in golden["multi_goal"]:
        want = np.inf if row["geodesic_distance"] is None else row["geodesic_distance"]
        got = navmesh.distances(row["start"], row["ends"])  # one to many
        assert np.isfinite(got.min()) == np.isfinite(want)
        assert np.isinf(want) or got.min() < want + 1e-5


@cache
def van_gogh():
    if not (root := os.environ.get("PRNAV_REAL_DATA")):
        pytest.skip("set PRNAV_REAL_DATA to the folder of real inputs")
    return NavMesh.load(Path(root) / "navmesh" / "van-gogh-room.navmesh")


def test_habitat_labs_own_geodesics_on_a_version_1_file():
    navmesh = van_gogh()
    rows = json.loads((Path(GOLDEN) / "test-sim-geodesic-distance-test-golden.json").read_text())
    for row in rows["single_end"]:
        assert navmesh.distance(row["start"], row["end"]) == pytest.approx(row["expected"], abs=1e-6)
    for row in rows["multi_end"]:
        assert navmesh.distances(row["start"], row["ends"]).min() == pytest.approx(row["expected"], abs=1e-6)


def test_habitat_labs_own_trajectory_and_map():
    navmesh = van_gogh()
    record = json.loads((Path(GOLDEN) / "habitat-sim_trajectory_data.json").read_text())
    positions, yaws = np.array(record["positions"]), quaternion_to_yaw(np.array(record["rotations"]))
    ahead = np.array(record["actions"][:-1]) == "move_forward"
    got, _ = navmesh.step(positions[:-1], positions[:-1] + 0.25 * forward(yaws[:-1]))
    assert ahead.sum() > 40 and np.abs(got - positions[1:])[ahead].max() < 1e-6
    obstacles = np.array([np.nan if d is None else d for d in record["distances_to_obstacles"]])
    known = np.isfinite(obstacles)
    assert np.abs(navmesh.clearance(positions) - obstacles)[known].max() < 1e-6
    picture = np.load(Path(GOLDEN) / "van-gogh-room_topdown_binary.npy")
    assert np.array_equal(navmesh.topdown(positions[0, 1], 0.1), picture)
