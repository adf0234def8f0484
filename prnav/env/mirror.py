"""A home's mirror image without a second mesh: an agent whose left and right are exchanged cannot tell the difference.

The agent stands in the home as it is. Its sensors sit where their mirror images would, each picture is turned over, and
all that is signed (bearings, headings, the GPS's right, the two turns) changes its sign. N agents, (n,) of them asked.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prnav.sim import LEFT, RIGHT

ASYMMETRIC = np.array([-1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
"""Signs of a sensor's x, y, z, yaw, pitch, roll and field of view behind the mirror, which is the plane x = 0."""


def mirrored_poses(poses: NDArray[np.float64], mirrored: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Sensor poses (n, K, 7) in the body's frame, mirrored for the agents (n,) that are."""
    return np.where(mirrored[:, None, None], poses * ASYMMETRIC, poses)


def mirrored_actions(actions: NDArray[np.int64], mirrored: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Actions (N,) with the turns exchanged for the agents that are mirrored."""
    turns = mirrored & ((actions == LEFT) | (actions == RIGHT))
    return np.where(turns, LEFT + RIGHT - actions, actions)


def mirrored_observations(
    observations: dict[str, NDArray[np.float32]], mirrored: NDArray[np.bool_]
) -> dict[str, NDArray[np.float32]]:
    """Observations (n, ...) as the mirrored agents (n,) have them; "photoreceptors" come from mirrored poses."""
    signs = np.where(mirrored, np.float32(-1.0), np.float32(1.0))
    result = dict(observations)
    result["compass"] = observations["compass"] * signs[:, None]
    for name in ("gps", "pointgoal"):  # (ahead, right) and (distance, bearing)
        if name in observations:
            result[name] = np.stack([observations[name][:, 0], observations[name][:, 1] * signs], axis=1)
    if "photoreceptors" in observations:
        readings = observations["photoreceptors"]
        agents, sensors, receptors, _ = readings.shape
        grid = round(receptors**0.5)
        turned = readings.reshape(agents, sensors, grid, grid, 3)[:, :, :, ::-1].reshape(readings.shape)
        result["photoreceptors"] = np.where(mirrored[:, None, None, None], turned, readings)
    return result
