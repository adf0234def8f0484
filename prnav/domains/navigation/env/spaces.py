"""What an agent observes and can do, as Gymnasium spaces."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from prnav.domains.navigation.env.config import EnvConfig


def num_actions(config: EnvConfig) -> int:
    """Stop, forward, left and right; TargetNav has no stop."""
    return 4 if config.targetnav is None else 3


def observation_space(config: EnvConfig, num_sensors: int) -> spaces.Dict:
    """Space of one agent's observations, all float32 but pictures.

    ``photoreceptors`` (K, B*B, 3) in 0..1, left out without vision; in their place, where a ``camera_size`` is given,
    ``camera`` (K, H, W, 3) uint8, top row first; ``design`` (K, 7) normalised; ``gps`` (2,) metres
    ahead and right of the start; ``compass`` (1,) radians from the start's heading; ``pointgoal`` (2,) distance [m]
    and bearing [rad, left positive] from where the agent is, in PointGoalNav alone.
    """
    pi = np.float32(np.pi) + np.float32(1e-6)
    boxes: dict[str, spaces.Space] = {
        "compass": spaces.Box(-pi, pi, (1,), np.float32),
        "design": spaces.Box(-np.inf, np.inf, (num_sensors, 7), np.float32),
        "gps": spaces.Box(-np.inf, np.inf, (2,), np.float32),
    }
    if config.targetnav is None:
        low, high = np.array([0.0, -pi], np.float32), np.array([np.inf, pi], np.float32)
        boxes["pointgoal"] = spaces.Box(low, high, dtype=np.float32)
    if config.vision and config.camera_size:
        boxes["camera"] = spaces.Box(0, 255, (num_sensors, config.camera_size, config.camera_size, 3), np.uint8)
    elif config.vision:
        boxes["photoreceptors"] = spaces.Box(0.0, 1.0, (num_sensors, config.grid**2, 3), np.float32)
    return spaces.Dict(boxes)
