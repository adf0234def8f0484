"""Sets of several tiles, laid out as Detour lays them out, against the same floor in one piece."""

import itertools

import numpy as np
import pytest
from rooms import grid_mesh, random_room

from prnav.navmesh import GoalFields, NavMesh, NavMeshSet, NavMeshSettings
from prnav.navmesh.detour_format import EXTERNAL, POLYGON, SET_HEADER, SETTINGS, TILE_ENTRY, TILE_HEADER
from prnav.navmesh.detour_write import navmesh_bytes

SETTINGS_USED = NavMeshSettings(cell_height=0.05)
SIDES = (4, 2, 0, 6)  #: Detour's side that edge k of a cell of grid_mesh faces: -x, +z, +x, -z
HEAD = SET_HEADER.itemsize + SETTINGS.itemsize


def tile_data(free, xs, zs, column, row, slope):
    """One tile as a file holds it: each edge on its rim is a portal, whether or not there is a neighbour behind it."""
    mesh = grid_mesh(free, xs, zs, slope)
    data = bytearray(navmesh_bytes(mesh, SETTINGS_USED)[HEAD + TILE_ENTRY.itemsize :])
    header = np.frombuffer(data, TILE_HEADER, 1)
    header["x"], header["y"] = column, row
    polys = np.frombuffer(data, POLYGON, mesh.num_polygons, TILE_HEADER.itemsize + 12 * len(mesh.vertices))
    rows, columns = np.nonzero(free)
    rim = (columns == 0, rows == free.shape[0] - 1, columns == free.shape[1] - 1, rows == 0)
    for k, (side, here) in enumerate(zip(SIDES, rim, strict=True)):
        polys["neighbours"][here, k] = EXTERNAL | side
    return bytes(data)


def tiled_file(free, xs, zs, slope, version=2, order=None, cuts=3):
    """A file of ``cuts`` x ``cuts`` tiles of a grid floor, tiles in any order; tiles without floor are left out."""
    size = free.shape[0] // cuts
    tiles = []
    for row, column in itertools.product(range(cuts), repeat=2):
        r, c = slice(row * size, (row + 1) * size), slice(column * size, (column + 1) * size)
        if free[r, c].any():
            lines = xs[c.start : c.stop + 1], zs[r.start : r.stop + 1]
            tiles.append(tile_data(free[r, c], *lines, column, row, slope))
    head = bytearray(navmesh_bytes(grid_mesh(free, xs, zs, slope), SETTINGS_USED)[:HEAD])
    header = np.frombuffer(head, SET_HEADER, 1)
    header["version"], header["tiles"], header["max_tiles"], header["max_polys"] = version, len(tiles), 16, 64
    header["tile_width"], header["tile_height"] = xs[size] - xs[0], zs[size] - zs[0]
    chosen = range(len(tiles)) if order is None else order(len(tiles)).tolist()
    body = [
        ((1 << 12) | (i << 8)).to_bytes(4, "little") + len(tiles[i]).to_bytes(4, "little") + tiles[i] for i in chosen
    ]
    return bytes(head[: SET_HEADER.itemsize] if version == 1 else head) + b"".join(body)


@pytest.mark.parametrize("seed", range(6))
def test_nine_tiles_answer_as_one(seed, tmp_path):
    whole, free, xs, zs = random_room(seed, size=9)
    rng = np.random.default_rng(seed)
    path = tmp_path / "nine.navmesh"
    path.write_bytes(tiled_file(free, xs, zs, 0.25, order=rng.permutation))
    tiled = NavMesh.load(path)
    assert tiled.area == pytest.approx(whole.area, rel=1e-9)
    assert sorted(i.area for i in tiled.islands) == pytest.approx(sorted(i.area for i in whole.islands))
    assert sorted(i.radius for i in tiled.islands) == pytest.approx(sorted(i.radius for i in whole.islands), rel=0.3)
    a, b = whole.random_points(300, 1), whole.random_points(300, 2)
    want = whole.distances(a, b)
    assert np.isfinite(want).any()
    np.testing.assert_allclose(tiled.distances(a, b), want, atol=1e-6)
    fields = GoalFields(NavMeshSet([tiled]), len(b))
    fields.prepare(np.arange(len(b)), np.zeros(len(b)), b)
    np.testing.assert_allclose(fields.query(np.arange(len(b)), a)[0], want, atol=1e-6)
    np.testing.assert_allclose(tiled.clearance(a), whole.clearance(a), atol=1e-9)
    np.testing.assert_allclose(tiled.snap(b), whole.snap(b), atol=1e-6)
    for reach, sliding in itertools.product((0.25, 2.0), (True, False)):
        angle = rng.uniform(0, 2 * np.pi, len(a))
        ends = a + reach * np.stack([np.cos(angle), np.zeros(len(a)), np.sin(angle)], axis=1)
        here, there = tiled.step(a, ends, sliding), whole.step(a, ends, sliding)
        np.testing.assert_allclose(here[0][:, [0, 2]], there[0][:, [0, 2]], atol=3e-4)
        assert (here[1] == there[1]).mean() > 0.99  # a wall met at the very end


@pytest.mark.parametrize("version", [1, 2])
def test_sets_of_tiles_are_written_as_they_were_read(version, tmp_path):
    free = np.ones((6, 6), bool)
    free[2, :5] = False
    xs = zs = np.arange(7.0)
    data = tiled_file(free, xs, zs, 0.0, version)
    path, again = tmp_path / "tiles.navmesh", tmp_path / "again.navmesh"
    path.write_bytes(data)
    navmesh = NavMesh.load(path)
    navmesh.save(again)
    written = again.read_bytes()
    if version == 2:
        assert written == data
    else:  # version 1 has no settings; the tiles are the same
        assert written[HEAD:] == data[SET_HEADER.itemsize :] and written[4] == 2
    twice = NavMesh.load(again)
    for name, array in navmesh.mesh.to_arrays().items():
        np.testing.assert_array_equal(array, twice.mesh.to_arrays()[name])
    twice.save(path)
    assert path.read_bytes() == written
    assert navmesh.distance([0.5, 0, 0.5], [0.5, 0, 5.5]) == pytest.approx(np.hypot(4.5, 1.5) + 1 + np.hypot(4.5, 2.5))


def test_a_tile_that_is_missing_is_a_hole():
    """A portal with nothing behind it is a wall, as in Detour."""
    xs = zs = np.arange(10.0)
    free = np.ones((9, 9), bool)
    free[3:6, 3:6] = False
    whole = NavMesh(grid_mesh(free, xs, zs, 0.0), SETTINGS_USED)
    from prnav.navmesh.detour import parse_navmesh

    stored = parse_navmesh(tiled_file(free, xs, zs, 0.0), "ring")
    ring = NavMesh(stored.mesh, stored.settings)
    assert stored.tiles == 8 and ring.area == pytest.approx(72)
    a, b = [2.5, 0, 4.5], [6.5, 0, 4.5]
    assert ring.distance(a, b) == pytest.approx(whole.distance(a, b)) == pytest.approx(2 * np.hypot(0.5, 1.5) + 3)
    stopped, collided = ring.step([a], [b], sliding=False)
    np.testing.assert_allclose(stopped, [[3.0, 0, 4.5]], atol=2e-4)
    assert collided[0]


@pytest.mark.parametrize(("rise", "joined"), [(0.3, True), (0.39, True), (0.41, False), (2.0, False)])
def test_portals_join_up_to_twice_the_climb(rise, joined):
    from prnav.navmesh.detour import parse_navmesh

    xs, zs = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    low = tile_data(np.ones((2, 2), bool), xs, zs, 0, 0, 0.0)
    high = bytearray(tile_data(np.ones((2, 2), bool), xs + 2.0, zs, 1, 0, 0.0))
    np.frombuffer(high, "<f4", 27, TILE_HEADER.itemsize)[1::3] += np.float32(rise)
    head = bytearray(navmesh_bytes(grid_mesh(np.ones((2, 2), bool), xs, zs, 0.0), SETTINGS_USED)[:HEAD])
    np.frombuffer(head, SET_HEADER, 1)["tiles"] = 2
    entries = [
        (4096 + 256 * i).to_bytes(4, "little") + len(t).to_bytes(4, "little") + t for i, t in enumerate((low, high))
    ]
    stored = parse_navmesh(bytes(head) + b"".join(entries), "step")
    assert len(NavMesh(stored.mesh, stored.settings).islands) == (1 if joined else 2)
