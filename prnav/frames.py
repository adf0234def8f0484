"""Axes, yaw, quaternions and units: written once, used everywhere.

The world is right-handed, in metres, with y up. At yaw 0 an agent looks along -z, its right is +x. Positive yaw turns
left, counter-clockwise seen from above. Angles are radians. Quaternions are x, y, z, w, as in Habitat's episode files.
All functions take and return arrays with any leading shape.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import SceneError

UP_AXES = ("y", "z")
"""Up axes a mesh file may have: plain glTF is y-up, Habitat's own stage files are z-up."""

_Z_UP_TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def wrap_angle(angle: ArrayLike) -> NDArray[np.float64]:
    """Angle in [-pi, pi), shape of the input."""
    return (np.asarray(angle, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi


def forward(yaw: ArrayLike) -> NDArray[np.float64]:
    """Unit vector an agent at this yaw looks along, shape (..., 3)."""
    yaw = np.asarray(yaw, dtype=np.float64)
    return np.stack([-np.sin(yaw), np.zeros_like(yaw), -np.cos(yaw)], axis=-1)


def yaw_towards(offsets: ArrayLike) -> NDArray[np.float64]:
    """Yaw [rad] at which an agent looks along ``offsets`` (..., 3), heights ignored; 0 for a zero offset."""
    offsets = np.asarray(offsets, dtype=np.float64)
    return np.arctan2(-offsets[..., 0], -offsets[..., 2] + 0.0) * np.any(offsets[..., [0, 2]] != 0.0, axis=-1)


def to_body_frame(offsets: ArrayLike, yaw: ArrayLike) -> NDArray[np.float64]:
    """World offsets (..., 3) as seen by a body at ``yaw`` (...): x right, y up, -z ahead."""
    offsets = np.asarray(offsets, dtype=np.float64)
    yaw = np.asarray(yaw, dtype=np.float64)
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = offsets[..., 0], offsets[..., 1], offsets[..., 2]
    return np.stack([c * x - s * z, y, s * x + c * z], axis=-1)


def from_body_frame(offsets: ArrayLike, yaw: ArrayLike) -> NDArray[np.float64]:
    """Inverse of :func:`to_body_frame`."""
    return to_body_frame(offsets, -np.asarray(yaw, dtype=np.float64))


def sensor_axes(
    yaw: NDArray[np.float64], pitch: NDArray[np.float64], roll: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Right, up and optical axis of sensors, unit vectors (..., 3), in the frame that their angles (...) refer to.

    The rotation is Ry(yaw) Rx(pitch) Rz(roll): positive pitch looks up, positive roll turns the image clockwise (the
    sensor itself tilts to its left).
    """
    cy, sy, cp, sp, cr, sr = (f(angle) for angle in (yaw, pitch, roll) for f in (np.cos, np.sin))
    right = np.stack([cy * cr + sy * sp * sr, cp * sr, -sy * cr + cy * sp * sr], axis=-1)
    up = np.stack([-cy * sr + sy * sp * cr, cp * cr, sy * sr + cy * sp * cr], axis=-1)
    return right, up, np.stack([-sy * cp, sp, -cy * cp], axis=-1)


def yaw_to_quaternion(yaw: ArrayLike) -> NDArray[np.float64]:
    """Rotation about y as x, y, z, w, shape (..., 4)."""
    half = 0.5 * np.asarray(yaw, dtype=np.float64)
    zero = np.zeros_like(half)
    return np.stack([zero, np.sin(half), zero, np.cos(half)], axis=-1)


def quaternion_to_yaw(quaternion: ArrayLike) -> NDArray[np.float64]:
    """Yaw [rad] of the direction that -z is rotated to, from quaternions x, y, z, w (..., 4); q and -q agree."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    # the rotated -z axis is -(2(xz + wy), 2(yz - wx), 1 - 2(x^2 + y^2)) for a unit quaternion
    return np.arctan2(2.0 * (x * z + w * y), w * w + z * z - x * x - y * y)


def quaternion_to_matrix(quaternion: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrices (..., 3, 3) of quaternions x, y, z, w (..., 4), which need not be of length 1."""
    quaternion = np.asarray(quaternion, dtype=np.float64)
    x, y, z, w = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_y_up(points: ArrayLike, up: str) -> NDArray[np.float64]:
    """Points or vectors (..., 3) of a file with the given up axis, in the y-up world frame.

    Raises:
        SceneError: ``up`` is neither "y" nor "z".
    """
    if up not in UP_AXES:
        raise SceneError(f"up axis {up!r} is not known; valid: {', '.join(UP_AXES)}")
    points = np.asarray(points, dtype=np.float64)
    return points if up == "y" else points @ _Z_UP_TO_Y_UP.T
