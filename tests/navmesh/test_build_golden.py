"""The builder against the navigation meshes that Habitat-sim built from the same files."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from prnav.navmesh.build import build_polygons
from prnav.navmesh.settings import NavMeshSettings
from prnav.scene import load_scene

SCENES = {
    "simple_room": ("habitat_simple_room/simple_room.glb", "z"),
    "small_house": ("aws_small_house/small_house.glb", "y"),
    "dream_apartment": ("dream_apartment/dream_apartment.glb", "y"),
    "iai_apartment": ("iai_apartment/apartment.glb", "y"),
    "hospital_two_floors": ("aws_hospital/hospital_two_floors.glb", "y"),
}
SLOW = {"iai_apartment", "hospital_two_floors"}
POLYGON = np.dtype(
    [("link", "<u4"), ("v", "<u2", 6), ("n", "<u2", 6), ("flags", "<u2"), ("count", "u1"), ("area", "u1")]
)
DETAIL = np.dtype([("vertex", "<u4"), ("triangle", "<u4"), ("vertices", "u1"), ("triangles", "u1"), ("pad", "<u2")])


def recorded_tile(path):
    """Vertices, polygons, detail records, detail vertices and triangles of a file with one tile."""
    data = path.read_bytes()
    offset = 40 + 56 + 8
    counts = struct.unpack_from("<15i", data, offset)
    polygons, vertices, links, details, detail_vertices, detail_triangles = counts[6:12]
    offset += 100
    sections = []
    for dtype, rows in [
        (np.dtype(("<f4", 3)), vertices),
        (POLYGON, polygons),
        (np.dtype("V12"), links),
        (DETAIL, details),
        (np.dtype(("<f4", 3)), detail_vertices),
        (np.dtype(("u1", 4)), detail_triangles),
    ]:
        sections.append(np.frombuffer(data, dtype, rows, offset))
        offset += rows * dtype.itemsize
    return sections[0], sections[1], sections[3], sections[4], sections[5]


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in SCENES],
)
def case(request, real_data, golden):
    file, up = SCENES[request.param]
    folder = golden / request.param
    answers = json.loads((folder / "golden.json").read_text())
    settings = {key: value for key, value in answers["settings"].items() if key != "include_static_objects"}
    scene = load_scene(real_data / "scenes" / file, up=up)
    mesh = build_polygons(scene.vertices, scene.faces, NavMeshSettings(**settings))
    return mesh, answers, recorded_tile(folder / "scene.navmesh")


def triangle_areas(mesh):
    a, b, c = np.moveaxis(mesh.all_vertices[mesh.detail_triangles], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_area_and_islands(case):
    mesh, answers, _ = case
    assert triangle_areas(mesh).sum() == pytest.approx(answers["navigable_area"], rel=1e-3)
    linked = mesh.neighbours >= 0
    pair = (mesh.polygon_of_corner()[linked], mesh.neighbours[linked])
    graph = coo_array((np.ones(linked.sum()), pair), shape=(mesh.num_polygons,) * 2)
    island = connected_components(graph, directed=False)[1]
    owner = np.repeat(np.arange(mesh.num_polygons), np.diff(mesh.detail_start))
    areas = np.sort(np.bincount(island[owner], weights=triangle_areas(mesh)))
    np.testing.assert_allclose(areas, np.sort(answers["island_area"]), rtol=1e-2, atol=1e-3)
    np.testing.assert_allclose(mesh.bounds, answers["bounds_after_load"], atol=1e-5)


def test_polygons_are_habitats_own(case):
    mesh, _, (vertices, polygons, *_) = case
    np.testing.assert_allclose(mesh.vertices, vertices, atol=1e-5)
    used = np.arange(6) < polygons["count"][:, None]
    np.testing.assert_array_equal(np.diff(mesh.polygon_start), polygons["count"])
    np.testing.assert_array_equal(mesh.polygon_vertices, polygons["v"][used])
    np.testing.assert_array_equal(mesh.neighbours, polygons["n"].astype(int)[used] - 1)
    np.testing.assert_array_equal(mesh.flags, polygons["flags"])


def test_height_detail_is_habitats_own(case):
    mesh, _, (_, polygons, details, vertices, triangles) = case
    np.testing.assert_array_equal(np.diff(mesh.detail_vertex_start), details["vertices"])
    np.testing.assert_allclose(mesh.detail_vertices, vertices, atol=1e-5)
    np.testing.assert_array_equal(np.diff(mesh.detail_start), details["triangles"])
    np.testing.assert_array_equal(mesh.detail_flags, triangles[:, 3])
    for p in range(mesh.num_polygons):
        corners = mesh.polygon_vertices[mesh.polygon_start[p] : mesh.polygon_start[p + 1]]
        first = len(mesh.vertices) + mesh.detail_vertex_start[p]
        own = np.concatenate([corners, np.arange(first, first + details["vertices"][p])])
        rows = slice(mesh.detail_start[p], mesh.detail_start[p + 1])
        np.testing.assert_array_equal(mesh.detail_triangles[rows], own[triangles[rows, :3]])
