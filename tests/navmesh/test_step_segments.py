"""No step passes a wall: the whole segment walked stays on the floor, whatever its length, sliding or not."""

import os
from pathlib import Path

import numpy as np
import pytest
from rooms import blocked_boxes, random_room, visible

from prnav.navmesh import NavMesh

GOLDEN = os.environ.get("PRNAV_GOLDEN")
SCENES = ["simple_room", "small_house", "iai_apartment", "dream_apartment", "hospital_two_floors"]
REACHES = (0.25, 1.0, 5.0)
SLACK = 2e-4  #: a step that ends on an infinitely thin wall is moved off it by 0.1 mm, as Habitat does [m]


def outside(navmesh, points, island):
    """Brute force: distance in the ground plane from points (n, 3) to the nearest polygon of an island, (n,)."""
    s = navmesh.surface
    ground = points[:, [0, 2]]
    result = np.full(len(points), np.inf)
    for p in np.flatnonzero(s.island == island):
        corners = s.corner[s.start[p] : s.start[p + 1]][:, [0, 2]]
        edges = np.roll(corners, -1, axis=0) - corners
        offset = ground[:, None] - corners
        inside = (edges[:, 1] * offset[..., 0] - edges[:, 0] * offset[..., 1] >= 0).all(axis=1)
        t = np.clip((offset * edges).sum(axis=2) / np.maximum((edges**2).sum(axis=1), 1e-30), 0, 1)
        away = np.linalg.norm(offset - t[..., None] * edges, axis=2).min(axis=1)
        result = np.minimum(result, np.where(inside, 0.0, away))
    return result


def moves(navmesh, count, reach, seed):
    rng = np.random.default_rng(seed)
    starts = navmesh.random_points(count, seed)
    angle = rng.uniform(0, 2 * np.pi, count)
    return starts, starts + reach * np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1)


@pytest.mark.parametrize("sliding", [True, False])
@pytest.mark.parametrize("reach", REACHES)
@pytest.mark.parametrize("seed", range(3))
def test_no_step_crosses_a_blocked_cell(seed, reach, sliding):
    navmesh, free, xs, zs = random_room(seed, size=8, blocked=0.35)
    starts, ends = moves(navmesh, 200, reach, seed)
    got, _ = navmesh.step(starts, ends, sliding)
    boxes = blocked_boxes(free, xs, zs)
    boxes[:, :2] += SLACK
    boxes[:, 2:] -= SLACK
    low, high = np.array([xs[0], zs[0]]) - SLACK, np.array([xs[-1], zs[-1]]) + SLACK
    for a, b in zip(starts[:, [0, 2]], got[:, [0, 2]], strict=True):
        assert visible(a, b, boxes, low, high)


@pytest.mark.skipif(not GOLDEN, reason="set PRNAV_GOLDEN to the folder of Habitat's recorded answers")
@pytest.mark.parametrize("sliding", [True, False])
@pytest.mark.parametrize("scene", SCENES)
def test_every_point_of_a_step_is_on_the_floor_of_real_scenes(scene, sliding):
    navmesh = NavMesh.load(Path(GOLDEN) / scene / "scene.navmesh")
    for seed, reach in enumerate(REACHES):
        starts, ends = moves(navmesh, 60, reach, seed)
        got, _ = navmesh.step(starts, ends, sliding)
        islands = navmesh.island_of(starts)
        t = np.linspace(0, 1, max(9, int(reach / 0.04)))[None, :, None]
        ways = starts[:, None] + t * (got - starts)[:, None]
        for island in np.unique(islands):
            points = ways[islands == island].reshape(-1, 3)
            assert outside(navmesh, points, island).max() < SLACK, (reach, island)
        assert np.array_equal(navmesh.island_of(got), islands)
        # sliding never ends farther from the wanted end than stopping does
        stopped, _ = navmesh.step(starts, ends, False)
        gap = [np.linalg.norm((x - ends)[:, [0, 2]], axis=1) for x in (got, stopped)]
        assert (gap[0] - gap[1]).max() < SLACK


def test_steps_on_one_storey_never_end_on_another(slabs_on_two_storeys):
    navmesh = slabs_on_two_storeys
    starts, ends = moves(navmesh, 400, 2.0, 0)
    for sliding in (True, False):
        got, _ = navmesh.step(starts, ends, sliding)
        np.testing.assert_allclose(got[:, 1], starts[:, 1], atol=1e-6)
