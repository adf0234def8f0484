"""The builder on scans as they are: vertices off by a centimetre, triangles missing, doubled and turned over."""

import os
from pathlib import Path

import numpy as np
import pytest

from prnav.navmesh import NavMesh, NavMeshSettings
from prnav.navmesh.build import build_polygons

REAL = os.environ.get("PRNAV_REAL_DATA")
MAIN = 5.0  #: islands above this area are main ones [m2]


def sheet(origin, u, v, size=0.06):
    """A rectangle of small triangles whose normal is u x v."""
    origin, u, v = (np.asarray(x, float) for x in (origin, u, v))
    n, m = (max(1, int(np.ceil(np.linalg.norm(x) / size))) for x in (u, v))
    i, j = np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij")
    points = origin + i[..., None] / n * u + j[..., None] / m * v
    row = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    quads = np.stack([row[:-1, :-1], row[1:, :-1], row[1:, 1:], row[:-1, 1:]], axis=-1).reshape(-1, 4)
    return points.reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def block(x0, z0, x1, z1, low, high):
    """Sides and both faces of a box."""
    dx, dz, dy = (x1 - x0, 0, 0), (0, 0, z1 - z0), (0, high - low, 0)
    return [
        sheet((x0, high, z0), dz, dx),
        sheet((x0, low, z0), dx, dz),
        sheet((x0, low, z0), dy, dx),
        sheet((x0, low, z1), dx, dy),
        sheet((x0, low, z0), dz, dy),
        sheet((x1, low, z0), dy, dz),
    ]


def join(parts):
    offsets = np.cumsum([0, *(len(points) for points, _ in parts)])
    return np.concatenate([p for p, _ in parts]), np.concatenate(
        [f + o for (_, f), o in zip(parts, offsets, strict=False)]
    )


@pytest.fixture(scope="module")
def room():
    """8 x 6 m with a wall with a door, a table too low to pass under, a shelf high enough, and a second storey."""
    parts = [sheet((0, 0, 0), (0, 0, 6), (8, 0, 0))]
    parts += block(4, 0, 4.2, 2.4, -0.1, 2.6) + block(4, 3.4, 4.2, 6, -0.1, 2.6)
    parts += block(1, 1, 2, 2, 0.7, 0.8)
    parts += block(5.5, 3, 6.5, 4, 1.95, 2.05)
    parts += block(0, 0, 8, 6, 2.6, 3.0)
    return join(parts)


def disturbed(vertices, faces, jitter, dropped, seed=0):
    rng = np.random.default_rng(seed)
    faces = faces[rng.random(len(faces)) >= dropped]
    doubled = faces[rng.random(len(faces)) < 0.01]
    turned = faces[rng.random(len(faces)) < 0.01][:, ::-1]
    return vertices + rng.normal(size=vertices.shape) * jitter, np.concatenate([faces, doubled, turned])


def main_areas(navmesh):
    return sorted((island.area for island in navmesh.islands if island.area > MAIN), reverse=True)


def test_the_clean_room_is_as_it_was_made(room):
    navmesh = NavMesh(build_polygons(*room), NavMeshSettings())
    areas = main_areas(navmesh)
    assert len(areas) == 2 and areas[0] == pytest.approx((8 - 0.3) * (6 - 0.3), abs=0.2)  # upstairs
    under_table, under_shelf, in_door = (1.5, 0.2, 1.5), (6.0, 0.2, 3.5), (4.1, 0.2, 2.9)
    assert np.array_equal(navmesh.is_navigable([under_table, under_shelf, in_door]), [False, True, True])


@pytest.mark.parametrize(("jitter", "dropped"), [(0.005, 0.0), (0.01, 0.0), (0.0, 0.03), (0.01, 0.02)])
def test_noise_costs_little_floor_and_no_ways(room, jitter, dropped):
    clean = NavMesh(build_polygons(*room), NavMeshSettings())
    noisy = NavMesh(build_polygons(*disturbed(*room, jitter, dropped)), NavMeshSettings())
    assert main_areas(noisy) == pytest.approx(main_areas(clean), rel=0.06)
    assert np.array_equal(noisy.is_navigable([(1.5, 0.2, 1.5), (4.1, 0.2, 2.9)]), [False, True])
    a, b = clean.random_points(300, 0), clean.random_points(300, 1)
    want, got = clean.distances(a, b), noisy.distances(a, b)
    assert np.array_equal(np.isfinite(want), np.isfinite(got))
    reached = np.isfinite(want) & (want > 0.5)
    assert np.quantile(np.abs(got[reached] / want[reached] - 1), 0.95) < 0.08


@pytest.mark.skipif(not REAL, reason="set PRNAV_REAL_DATA to the folder of real inputs")
@pytest.mark.parametrize("name", ["aws_small_house/small_house", "pal_home/home", "aws_bookstore/bookstore"])
def test_noise_on_real_scenes(name):
    from prnav.scene import load_scene

    scene = load_scene(Path(REAL) / "scenes" / f"{name}.glb")
    clean = NavMesh(build_polygons(scene.vertices, scene.faces), NavMeshSettings())
    vertices, faces = disturbed(scene.vertices.astype(float), scene.faces, 0.01, 0.02)
    noisy = NavMesh(build_polygons(vertices, faces), NavMeshSettings())
    assert main_areas(noisy) == pytest.approx(main_areas(clean), rel=0.03)
    a, b = clean.random_points(300, 0), clean.random_points(300, 1)
    want, got = clean.distances(a, b), noisy.distances(a, b)
    assert (np.isfinite(want) != np.isfinite(got)).mean() <= 0.01
    both = np.isfinite(want) & np.isfinite(got)
    off = np.abs(got[both] / want[both] - 1)
    assert np.median(off) < 0.01 and np.quantile(off, 0.95) < 0.06


@pytest.mark.parametrize("seed", range(4))
def test_damage_never_stops_the_builder(room, seed):
    """Far worse than any scan: vertices at NaN-free random places, most triangles gone, others without area."""
    rng = np.random.default_rng(seed)
    vertices, faces = room
    vertices = vertices.copy()
    wild = rng.random(len(vertices)) < 0.02
    vertices[wild] = rng.uniform(-3, 11, (int(wild.sum()), 3))
    faces = faces[rng.random(len(faces)) < rng.choice([0.3, 0.9])].copy()
    flat = rng.random(len(faces)) < 0.05
    faces[flat, 1] = faces[flat, 0]
    mesh = build_polygons(vertices, faces)
    assert np.isfinite(mesh.vertices).all() and (mesh.polygon_areas() > 0).all()
    if mesh.num_polygons:
        navmesh = NavMesh(mesh, NavMeshSettings())
        a, b = navmesh.random_points(50, 0), navmesh.random_points(50, 1)
        same = navmesh.island_of(a) == navmesh.island_of(b)
        assert np.array_equal(np.isfinite(navmesh.distances(a, b)), same)
