"""Sensors on geoms: places stay on the surface, maps have exact inverses, and metres are metres."""

from __future__ import annotations

import math

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')

from prnav.domains.control.surfaces import GeomSurface, geom_surface  # noqa: E402
from prnav.errors import DesignError  # noqa: E402

SIZES = {
    "sphere": (2, (0.07, 0.0, 0.0)),
    "capsule": (3, (0.05, 0.2, 0.0)),
    "ellipsoid": (4, (0.1, 0.2, 0.05)),
    "cylinder": (5, (0.04, 0.1, 0.0)),
    "box": (6, (0.1, 0.05, 0.2)),
}


def turned(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.fixture(params=SIZES)
def surface(request):
    kind, size = SIZES[request.param]
    return GeomSurface(kind, np.array(size), np.array([0.1, -0.2, 0.3]), turned(kind))


def places(surface, count, seed):
    return surface.sample(np.random.default_rng(seed).random((count, 3)))


def test_samples_and_moved_sensors_lie_on_the_surface(surface):
    points = places(surface, 400, 0)
    pushes = np.random.default_rng(1).normal(size=points.shape) * 0.3
    assert surface.distance(points).max() < 1e-12
    assert surface.distance(surface.move(points, pushes)).max() < 1e-12


def test_push_is_the_inverse_of_move(surface):
    points, targets = places(surface, 500, 2), places(surface, 500, 3)
    np.testing.assert_allclose(surface.move(points, surface.push(points, targets)), targets, atol=1e-9)


def test_no_push_leaves_every_bit_and_small_pushes_move_as_far(surface):
    points = places(surface, 200, 4)
    assert (surface.move(points, np.zeros(3)) == points).all()
    towards = places(surface, 200, 5)
    small = 1e-6 * surface.push(points, towards)
    assert (np.linalg.norm(surface.move(points, small) - points, axis=1) < 1e-4).all()


def test_what_points_into_the_body_has_no_effect_on_a_sphere_and_a_capsules_side():
    sphere = GeomSurface(2, np.array([0.1, 0.0, 0.0]), np.zeros(3), np.eye(3))
    points = places(sphere, 50, 6)
    np.testing.assert_allclose(sphere.move(points, -0.5 * points), points, atol=1e-12)
    capsule = GeomSurface(3, np.array([0.05, 0.2, 0.0]), np.zeros(3), np.eye(3))
    np.testing.assert_allclose(capsule.move([0.05, 0.0, 0.1], [-0.3, 0.0, 0.0]), [0.05, 0.0, 0.1], atol=1e-12)


def test_metres_on_a_capsule_are_true_along_its_meridian_and_around_its_waist():
    capsule = GeomSurface(3, np.array([0.05, 0.2, 0.0]), np.zeros(3), np.eye(3))
    start = [0.05, 0.0, 0.1]
    np.testing.assert_allclose(capsule.move(start, [0.0, 0.0, -0.25]), [0.05, 0.0, -0.15], atol=1e-12)
    np.testing.assert_allclose(capsule.move(start, [0.0, 0.05 * math.pi / 2, 0.0]), [0.0, 0.05, 0.1], atol=1e-12)
    pole = capsule.move(start, [0.0, 0.0, 0.1 + 0.05 * math.pi / 2])
    np.testing.assert_allclose(pole, [0.0, 0.0, 0.25], atol=1e-12)
    beyond = capsule.move(start, [0.0, 0.0, 0.1 + 0.05 * math.pi + 0.1])
    np.testing.assert_allclose(beyond, [-0.05, 0.0, 0.1], atol=1e-12)


def test_a_turn_by_the_whole_circumference_of_a_sphere_comes_back():
    sphere = GeomSurface(2, np.array([0.1, 0.0, 0.0]), np.zeros(3), np.eye(3))
    np.testing.assert_allclose(sphere.move([0.1, 0.0, 0.0], [0.0, 0.2 * math.pi, 0.0]), [0.1, 0.0, 0.0], atol=1e-12)


def test_projection_is_idempotent_and_leaves_the_inside(surface):
    points = np.random.default_rng(7).normal(size=(300, 3)) * 0.3
    on = surface.project(points)
    assert surface.distance(on).max() < 1e-12
    assert not surface.contains(surface.centre + 1.001 * (on - surface.centre)).any()
    assert surface.contains(surface.centre + 0.999 * (on - surface.centre)).all()
    np.testing.assert_allclose(surface.project(on), on, atol=1e-12)


def test_one_row_has_the_same_bits_in_any_batch(surface):
    points, pushes = places(surface, 33, 8), np.random.default_rng(9).normal(size=(33, 3)) * 0.1
    whole = surface.move(points, pushes)
    for row in (0, 7, 32):
        assert (surface.move(points[row], pushes[row]) == whole[row]).all()
        assert (surface.move(points[row : row + 1], pushes[row : row + 1])[0] == whole[row]).all()


def test_outlines_are_on_the_surface(surface):
    vertices, faces = surface.outline()
    assert surface.distance(vertices).max() < 1e-9
    assert faces.min() >= 0 and faces.max() < len(vertices)


def test_places_are_held_whole_or_not_at_all(surface):
    points = places(surface, 3, 10)
    assert (surface.move(points, np.ones(3), (True, True, True)) == points).all()
    with pytest.raises(DesignError, match="frozen together or not at all"):
        surface.move(points, np.ones(3), (True, False, False))


def test_planes_and_unknown_geoms_carry_no_sensors():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom name="g" type="plane" size="1 1 1"/></worldbody></mujoco>'
    )
    for name in ("g", "nothing"):
        with pytest.raises(DesignError, match=f"geom '{name}' is not one that sensors can sit on"):
            geom_surface(model, name)
