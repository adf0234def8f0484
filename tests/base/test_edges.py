"""The Python interface at its edges: our own errors, which name the argument."""

import copy
import pickle

import numpy as np
import pytest

from prnav.errors import NavMeshError, RenderError
from prnav.navmesh import GoalFields, NavMesh, NavMeshSet
from prnav.navmesh.build import build_polygons
from prnav.navmesh.settings import NavMeshSettings
from prnav.render import Renderer
from prnav.scene import SceneMesh, TextureAtlas


@pytest.fixture(scope="module")
def floor():
    points = np.array([(0, 0, 0), (0, 0, 4), (4, 0, 4), (4, 0, 0)], float)
    return NavMesh(build_polygons(points, np.array([(0, 1, 2), (0, 2, 3)])), NavMeshSettings())


@pytest.fixture(scope="module")
def square():
    vertices = np.array([(0, 0, 0), (0, 0, 4), (4, 0, 4), (4, 0, 0)], np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    zeros = np.zeros((4, 2), np.float32), np.full((4, 3), 255, np.uint8)
    return SceneMesh("square", vertices, *zeros, faces, np.zeros(2, np.int32), TextureAtlas.from_images([]))


POINT = [1.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("ask", "match"),
    [
        (
            lambda n: n.distances(np.zeros((3, 3)), np.zeros((2, 3))),
            "a are 3 points and b are 2; there must",
        ),
        (lambda n: n.step(np.zeros((3, 3)), np.zeros((2, 3))), "starts are 3 points and ends are 2"),
        (
            lambda n: n.path(np.zeros((2, 3)), np.zeros((1, 3))),
            "a path is from one point to one point, not",
        ),
        (lambda n: n.snap([["a", "b", "c"]]), "points are not an array of numbers"),
        (lambda n: n.snap([[1, 2, 3], [1, 2]]), "points are not an array of numbers"),
        (lambda n: n.snap([1.0, 2.0]), r"points have shape \(2,\)"),
        (lambda n: n.random_points(-1), "n is -1; it must be a whole number from 0"),
        (lambda n: n.random_points(10**13), r"n is 10000000000000; .* \(they would take gigabytes\)"),
        (lambda n: n.random_points(2.5), "n is 2.5; it must be a whole number"),
        (lambda n: n.random_points(2, -1), "seed is -1; it must be a whole number"),
        (lambda n: n.topdown(np.nan), "height is nan; it must be a number"),
        (lambda n: n.topdown(0.0, np.nan), "metres_per_pixel is nan"),
        (lambda n: n.topdown(0.0, 1e-12), "metres_per_pixel is 1e-12; a map of .* cells has more than"),
        (lambda n: n.topdown("a"), "height is 'a'; it must be a number"),
        (lambda n: n.clearance([POINT], -1.0), "max_radius is -1.0; it must be a number from 0"),
        (lambda n: n.is_navigable([POINT], np.nan), "max_y_delta is nan"),
        (lambda n: NavMeshSet([]), "of no scenes"),
        (lambda n: NavMeshSet([n]).snap([0.5], [POINT]), "scene indices are float64 with fractions"),
        (lambda n: NavMeshSet([n]).snap([3], [POINT]), r"scene index 3\.\.3 out of range"),
        (lambda n: GoalFields(NavMeshSet([n]), 2.5), "slots is 2.5"),
        (
            lambda n: GoalFields(NavMeshSet([n]), 1).prepare([0], [0], [[np.nan, 0, 0]]),
            r"goals\[0\] is \[nan",
        ),
        (lambda n: GoalFields(NavMeshSet([n]), 1).prepare([0.2], [0], [POINT]), "slots are float64 with fractions"),
        (lambda n: GoalFields(NavMeshSet([n]), 1).num_windows(7), "slot 7..7 out of range"),
    ],
)
def test_navmeshes(floor, ask, match):
    with pytest.raises(NavMeshError, match=match):
        ask(floor)


def view(**changes):
    design = np.array([[[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]]])
    return {"scene_ids": [0], "positions": [POINT], "yaws": [0.0], "designs": design} | changes


@pytest.mark.parametrize(
    ("ask", "match"),
    [
        (lambda r: r.read(**view(designs=np.full((1, 1, 7), 1e300))), "hold a number beyond 1e.09"),
        (lambda r: r.read(**view(positions=[[1e300, 0, 0]])), "positions of agent 0 hold a number beyond"),
        (lambda r: r.read(**view(positions=[["a", 0, 0]])), "positions are not an array of numbers"),
        (lambda r: r.read(**view(), grid=10**9), "grid is 1000000000; at most 8192"),
        (lambda r: r.read(**view(), grid=True), "grid is True; it must be a whole number"),
        (lambda r: r.image(**view(), size=1e18), "size is 1e.18; it must be a whole number"),
        (lambda r: r.depth(**view(), size=0), "size is 0; it must be a whole number"),
        (
            lambda r: r.image([0] * 40, [POINT] * 40, [0.0] * 40, np.tile(view()["designs"], (40, 1, 1)), size=8192),
            "the request asks for 2,684,354,560 colours, 32.2 GB",
        ),
        (lambda r: r.read(**view(scene_ids=[0.5])), "whole numbers"),
        (lambda r: r.read(**view(scene_ids=[4])), "scene id 4 does not exist"),
    ],
)
def test_renderers(square, ask, match):
    with pytest.raises(RenderError, match=match):
        ask(Renderer([square], rays_per_receptor=1))


def test_renderers_are_pickled_and_copied(square):
    renderer = Renderer([square], rays_per_receptor=4, background=(0.5, 0.25, 0.0))
    want = renderer.read(**view())
    for again in (pickle.loads(pickle.dumps(renderer)), copy.deepcopy(renderer), copy.copy(renderer)):
        np.testing.assert_array_equal(again.read(**view()), want)


def test_navmeshes_are_copied(floor):
    for again in (copy.deepcopy(floor), pickle.loads(pickle.dumps(floor))):
        assert again.distance(POINT, [3.0, 0.0, 3.0]) == floor.distance(POINT, [3.0, 0.0, 3.0])
