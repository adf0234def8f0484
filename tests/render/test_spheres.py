"""Spheres that agents look for: seen, hidden, hiding, each by its own agent alone."""

import numpy as np
import pytest

from prnav.errors import RenderError
from prnav.render import Renderer

LOOK = np.array([[[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, np.radians(60)]]])
HERE = (np.zeros(1, int), np.zeros((1, 3)), np.zeros(1), LOOK)


@pytest.fixture(scope="module")
def spheres():
    rng = np.random.default_rng(2)
    balls = np.concatenate([rng.uniform([-2, 0.5, -2], [2, 2, 2], (12, 3)), rng.uniform(0.2, 0.6, (12, 1))], axis=1)
    balls[::4, 3] = 0.0
    return balls


def test_spheres_are_those_of_brute_force(caster, rooms, batch, spheres):
    options = {"rays_per_receptor": 4, "sphere_color": (0.9, 0.1, 0.2)}
    fast, slow = caster(rooms, **options), Renderer(rooms, engine="reference", **options)
    error = np.abs(fast.read(*batch, spheres=spheres) - slow.read(*batch, spheres=spheres)) * 255
    assert error.mean() <= 0.2
    assert (error < 0.01).mean() > 0.99
    depths = [renderer.depth(*batch, size=8, spheres=spheres) for renderer in (fast, slow)]
    np.testing.assert_allclose(*depths, rtol=1e-4)
    seen = np.abs(fast.read(*batch, spheres=spheres) - fast.read(*batch)).max((1, 2, 3, 4)) > 0.01
    assert seen.any() and not seen[::4].any()  # a radius of 0 is no sphere


def test_the_share_of_a_patch_is_the_discs(caster, room):
    from prnav.scene import SceneMesh, TextureAtlas

    wall = np.array([[-90, -90, -20], [90, -90, -20], [0, 120, -20]], np.float32)
    scene = SceneMesh(
        "wall",
        wall,
        np.zeros((3, 2), np.float32),
        np.zeros((3, 3), np.uint8),
        np.array([[0, 1, 2]], np.int32),
        np.zeros(1, np.int32),
        TextureAtlas.from_images([]),
    )
    ball = np.array([[0.0, 1.0, -4.0, 0.5]])
    renderer = caster([scene], rays_per_receptor=10000)
    reading = renderer.read(*HERE, grid=1, spheres=ball)[0, 0, 0, 0]
    disc = np.tan(np.arcsin(0.5 / 4.0))  # radius on the image plane
    np.testing.assert_allclose(reading, [0.0, np.pi * disc**2 / (2 * np.tan(np.radians(30))) ** 2, 0.0], rtol=1e-2)
    np.testing.assert_allclose(renderer.depth(*HERE, size=1, spheres=ball), 3.5, rtol=1e-6)
    behind = np.array([[0.0, 1.0, -30.0, 5.0]])
    np.testing.assert_array_equal(renderer.read(*HERE, spheres=behind), renderer.read(*HERE))
    np.testing.assert_allclose(renderer.depth(*HERE, size=1, spheres=[[0, 1, 4, 0.5]]), 20.0)  # at one's back
    np.testing.assert_allclose(renderer.depth(*HERE, size=1, spheres=[[0, 1, 0, 0.5]]), 0.5)  # from inside


def test_bad_spheres_are_named(room):
    for bad in (np.zeros((2, 4)), np.zeros((1, 3)), [[0, 0, 0, -1.0]], [[np.nan, 0, 0, 1.0]]):
        with pytest.raises(RenderError, match=r"they must be \(1, 4\), finite: x, y, z and a radius of at least 0 m"):
            Renderer([room]).read(*HERE, spheres=bad)
    with pytest.raises(RenderError, match="sphere_color is .* it must be red, green, blue from 0 to 1"):
        Renderer([room], sphere_color=(0, 255, 0))
