"""Habitat's navmesh files: written and read back, several tiles, and files that are broken."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rooms import grid_mesh, random_room

from prnav.errors import NavMeshError
from prnav.navmesh import NavMesh, NavMeshSettings
from prnav.navmesh.detour import parse_navmesh
from prnav.navmesh.detour_format import EXTERNAL, POLYGON, SET_HEADER, SETTINGS, TILE_ENTRY, TILE_HEADER
from prnav.navmesh.detour_write import navmesh_bytes

BODY = SET_HEADER.itemsize + SETTINGS.itemsize
TILE = BODY + TILE_ENTRY.itemsize


def equal_meshes(a, b):
    return all(np.array_equal(x, y) for x, y in zip(a.to_arrays().values(), b.to_arrays().values(), strict=True))


def test_a_written_file_is_read_back_bit_for_bit(tmp_path):
    navmesh, *_ = random_room(0)
    navmesh.save(tmp_path / "a.navmesh")
    again = NavMesh.load(tmp_path / "a.navmesh")
    assert equal_meshes(navmesh.mesh, again.mesh) and again.settings == navmesh.settings
    again.save(tmp_path / "b.navmesh")
    assert (tmp_path / "a.navmesh").read_bytes() == (tmp_path / "b.navmesh").read_bytes()
    anew = dataclasses.replace(again, file_tiles=None)
    anew.save(tmp_path / "c.navmesh")
    assert (tmp_path / "a.navmesh").read_bytes() == (tmp_path / "c.navmesh").read_bytes()


def test_version_1_takes_its_settings_from_the_tile():
    navmesh, *_ = random_room(1)
    data = navmesh_bytes(navmesh.mesh, NavMeshSettings(agent_radius=0.2, agent_height=1.0))
    old = data[:4] + (1).to_bytes(4, "little") + data[8 : SET_HEADER.itemsize] + data[BODY:]
    stored = parse_navmesh(old, "old")
    assert equal_meshes(stored.mesh, navmesh.mesh)
    assert stored.settings == NavMeshSettings(agent_radius=0.2, agent_height=1.0)


def tiled_file(left_lines, right_lines, gap=0.0):
    """A floor of two tiles side by side whose grid lines along z differ; ``gap`` moves the right one away."""
    tiles = []
    for number, zs in enumerate((left_lines, right_lines)):
        xs = np.array([0.0, 1.0]) + number * (1.0 + gap)
        mesh = grid_mesh(np.ones((len(zs) - 1, 1), bool), xs, np.array(zs, float), slope=0.0)
        data = bytearray(navmesh_bytes(mesh, NavMeshSettings()))[TILE:]
        header = np.frombuffer(data, TILE_HEADER, 1)
        header["x"] = number
        polys = np.frombuffer(data, POLYGON, len(zs) - 1, TILE_HEADER.itemsize + 12 * len(mesh.vertices))
        polys["neighbours"][:, 2 if number == 0 else 0] = EXTERNAL | (0 if number == 0 else 4)
        tiles.append(bytes(data))
    head = bytearray(navmesh_bytes(mesh, NavMeshSettings())[:BODY])
    np.frombuffer(head, SET_HEADER, 1)["tiles"] = 2
    body = b"".join((1 + i).to_bytes(4, "little") + len(t).to_bytes(4, "little") + t for i, t in enumerate(tiles))
    return bytes(head) + body


@pytest.mark.parametrize("right", [[0, 1, 2, 3], [0, 3], [0, 0.5, 1.7, 3], [0.5, 2.5]])
def test_tiles_are_joined_where_their_borders_overlap(right, tmp_path):
    (tmp_path / "two.navmesh").write_bytes(tiled_file([0, 1, 2, 3], right))
    navmesh = NavMesh.load(tmp_path / "two.navmesh")
    assert navmesh.area == pytest.approx(3 + right[-1] - right[0])
    assert len(navmesh.islands) == 1
    a, b = navmesh.random_points(200, 0), navmesh.random_points(200, 1)
    if (right[0], right[-1]) == (0, 3):  # one rectangle: all ways are straight
        assert np.allclose(navmesh.distances(a, b), np.linalg.norm(a - b, axis=1))
    got, collided = navmesh.step([[0.9, 0, 1.5]], [[1.15, 0, 1.6]])
    assert np.allclose(got, [[1.15, 0, 1.6]]) and not collided[0]
    if right == [0.5, 2.5]:
        assert navmesh.distance([0.5, 0, 0.1], [1.5, 0, 0.6]) == pytest.approx(np.hypot(0.5, 0.4) + np.hypot(0.5, 0.1))
        got, collided = navmesh.step([[0.9, 0, 0.2]], [[1.15, 0, 0.2]], sliding=False)
        assert np.allclose(got, [[1.0, 0, 0.2]], atol=2e-4) and collided[0]
    navmesh.save(tmp_path / "again.navmesh")
    assert (tmp_path / "again.navmesh").read_bytes() == (tmp_path / "two.navmesh").read_bytes()


def test_tiles_apart_are_not_joined(tmp_path):
    (tmp_path / "two.navmesh").write_bytes(tiled_file([0, 1, 2, 3], [0, 3], gap=0.1))
    navmesh = NavMesh.load(tmp_path / "two.navmesh")
    assert len(navmesh.islands) == 2
    assert navmesh.distance([0.5, 0, 1], [1.6, 0, 1]) == np.inf


def broken(data, offset, kind, value):
    data = bytearray(data)
    data[offset : offset + np.dtype(kind).itemsize] = np.array([value], kind).tobytes()
    return bytes(data)


def test_broken_files_are_named_with_their_fault(tmp_path):
    good = navmesh_bytes(random_room(0)[0].mesh, NavMeshSettings())
    header = TILE
    verts = header + TILE_HEADER.itemsize
    polys = verts + 12 * int(np.frombuffer(good, TILE_HEADER, 1, header)["verts"][0])
    first = verts + 12 * int(np.frombuffer(good, "<u2", 1, polys + 4)[0])  # the first polygon's first vertex
    cases = {
        "the magic number is 0x4d534154, not 0x4d534554": broken(good, 0, "<u4", 0x4D534154),
        "MSET version 3 is not known; valid: 1 and 2": broken(good, 4, "<i4", 3),
        "are too few for a header": good[:20],
        "the settings end after 60 bytes": good[:60],
        "1000000 tiles do not fit": broken(good, 8, "<i4", 1_000_000),
        "it has no tiles": broken(good, 8, "<i4", 0),
        "the file is truncated": good[:-1],
        "too few for its header": broken(good, BODY + 4, "<i4", 50),
        "polys do not fit": broken(good, header + 24, "<i4", 2**30),
        "verts do not fit": broken(good, header + 28, "<i4", -1),
        "off-mesh connections": broken(good, header + 52, "<i4", 1) + bytes(36),
        "vertices are not finite": broken(good, verts, "<f4", np.nan),
        "has 9 corners; valid: 3 to 6": broken(good, polys + 30, "u1", 9),
        "names a vertex beyond": broken(good, polys + 4, "<u2", 60000),
        "names a neighbour beyond": broken(good, polys + 16, "<u2", 30000),
        "is not convex and counter-clockwise": broken(good, first, "<f4", 1000.0),
        "settings are broken: cell_size is -1": broken(good, SET_HEADER.itemsize, "<f4", -1.0),
    }
    cases["off-mesh connections"] = broken(cases["off-mesh connections"], BODY + 4, "<i4", len(good) - TILE + 36)
    for text, data in cases.items():
        path = tmp_path / "broken.navmesh"
        path.write_bytes(data)
        with pytest.raises(NavMeshError, match=text) as error:
            NavMesh.load(path)
        assert "broken.navmesh" in str(error.value) and "\n" not in str(error.value)
    with pytest.raises(NavMeshError, match="cannot be read"):
        NavMesh.load(tmp_path / "missing.navmesh")


def test_another_magic_is_refused():
    root = os.environ.get("PRNAV_REAL_DATA")
    if not root:
        pytest.skip("set PRNAV_REAL_DATA to the folder of real inputs")
    with pytest.raises(NavMeshError, match="the magic number is 0x4d534154, not 0x4d534554"):
        NavMesh.load(Path(root) / "navmesh" / "wrong_magic_tile_set.bin")


GOOD = navmesh_bytes(random_room(0, size=4)[0].mesh, NavMeshSettings())
TWO = tiled_file([0, 1, 2, 3], [0, 0.5, 1.7, 3])


def survives(data, tmp_path):
    path = tmp_path / "fuzz.navmesh"
    path.write_bytes(data)
    try:
        navmesh = NavMesh.load(path)
    except NavMeshError:
        return
    a, b = navmesh.random_points(4, 0), navmesh.random_points(4, 1)
    navmesh.snap(np.concatenate([a, b + 1]))
    navmesh.step(a, b)
    navmesh.distances(a, b)
    navmesh.clearance(a)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    source=st.sampled_from([GOOD, TWO]),
    flips=st.lists(st.tuples(st.integers(0, len(TWO) - 1), st.integers(0, 255)), max_size=6),
    end=st.one_of(st.none(), st.integers(0, len(TWO))),
)
def test_fuzzed_files_give_nothing_but_our_own_errors(source, flips, end, tmp_path):
    data = bytearray(source)
    for at, value in flips:
        data[at % len(data)] = value
    survives(bytes(data[:end]), tmp_path)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    source=st.sampled_from([GOOD, TWO]),
    words=st.lists(
        st.tuples(
            st.integers(0, len(TWO) // 4),
            st.sampled_from([0, 1, 2**31 - 1, 2**32 - 1, 0x7F800000, 0x7FC00000, 0x80000000, 0x47C34FF3, 0x42C80000]),
        ),
        max_size=3,
    ),
)
def test_fuzzed_words_give_nothing_but_our_own_errors(source, words, tmp_path):
    data = bytearray(source)
    for at, value in words:
        at = 4 * at % (len(data) - 4)
        data[at : at + 4] = value.to_bytes(4, "little")
    survives(bytes(data), tmp_path)
