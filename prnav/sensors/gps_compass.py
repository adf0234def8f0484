"""Ideal GPS, compass and the point goal, as pure functions of poses.

The start frame is the agent's own at the start of its episode: ahead is along its heading then. Heights do not count.
All functions take any leading shape and return float32.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.frames import to_body_frame, wrap_angle

Float32 = NDArray[np.float32]


def gps(positions: ArrayLike, start_positions: ArrayLike, start_yaws: ArrayLike) -> Float32:
    """Displacement [m] from the start in the start frame: ahead (-z), right (+x); shape (..., 2)."""
    offset = np.asarray(positions, dtype=np.float64) - np.asarray(start_positions, dtype=np.float64)
    local = to_body_frame(offset, start_yaws)
    return np.stack([-local[..., 2], local[..., 0]], axis=-1).astype(np.float32)


def compass(yaws: ArrayLike, start_yaws: ArrayLike) -> Float32:
    """Heading relative to the start [rad], in [-pi, pi), positive to the left; shape (...)."""
    return wrap_angle(np.asarray(yaws, dtype=np.float64) - np.asarray(start_yaws, dtype=np.float64)).astype(np.float32)


def pointgoal(positions: ArrayLike, yaws: ArrayLike, goals: ArrayLike) -> Float32:
    """The goal seen from the current pose: distance [m] in the ground plane, bearing [rad]; shape (..., 2).

    The bearing lies in [-pi, pi], positive to the left, 0 straight ahead and on the goal itself.
    """
    local = to_body_frame(np.asarray(goals, dtype=np.float64) - np.asarray(positions, dtype=np.float64), yaws)
    ahead, left = -local[..., 2] + 0.0, -local[..., 0] + 0.0
    return np.stack([np.hypot(ahead, left), np.arctan2(left, ahead)], axis=-1).astype(np.float32)
