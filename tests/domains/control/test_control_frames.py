"""Frames against scipy's rotations, and the same bits for one sensor or many."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from prnav.domains.control.frames import rotation, to_world


def test_rotations_are_scipys_whatever_the_length():
    quaternions = np.random.default_rng(0).normal(size=(50, 4))
    np.testing.assert_allclose(
        rotation(quaternions), Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix(), atol=1e-14
    )


def test_to_world_is_the_matrix_product_and_does_not_depend_on_the_batch():
    random = np.random.default_rng(1)
    places, body_places = random.normal(size=(2, 40, 3))
    axes, body_axes = rotation(random.normal(size=(2, 40, 4)))
    world_places, world_axes = to_world(places, axes, body_places, body_axes)
    np.testing.assert_allclose(world_places, body_places + (body_axes @ places[..., None])[..., 0], atol=1e-14)
    np.testing.assert_allclose(world_axes, body_axes @ axes, atol=1e-14)
    for row in (0, 17, 39):
        at = slice(row, row + 1)
        one_place, one_axes = to_world(places[at], axes[at], body_places[at], body_axes[at])
        np.testing.assert_array_equal(one_place[0], world_places[row])
        np.testing.assert_array_equal(one_axes[0], world_axes[row])
