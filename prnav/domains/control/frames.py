"""From a body's frame to the world's, for many sensors at once.

Sums of products are written out: the bits of one sensor must not depend on how many are computed with it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]


def rotation(quaternions: ArrayLike) -> Float64:
    """Rotation matrices (..., 3, 3) of quaternions (w, x, y, z) of any length but 0, (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternions, np.float64), -1, 0)
    length = np.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / length, x / length, y / length, z / length
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def to_world(places: Float64, axes: Float64, body_places: Float64, body_axes: Float64) -> tuple[Float64, Float64]:
    """Places (..., 3) [m] and axes (..., 3, 3, as columns) of sensors in the world.

    Args:
        places: of the sensors in their bodies' frames [m], (..., 3).
        axes: of the sensors in their bodies' frames, (..., 3, 3).
        body_places: of their bodies in the world [m], (..., 3).
        body_axes: of their bodies in the world, (..., 3, 3).
    """
    turned = (
        body_axes[..., 0] * places[..., 0, None]
        + body_axes[..., 1] * places[..., 1, None]
        + body_axes[..., 2] * places[..., 2, None]
    )
    world_axes = (
        body_axes[..., :, 0, None] * axes[..., None, 0, :]
        + body_axes[..., :, 1, None] * axes[..., None, 1, :]
        + body_axes[..., :, 2, None] * axes[..., None, 2, :]
    )
    return body_places + turned, world_axes
