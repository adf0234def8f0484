"""What an agent observes and can do: specs, and the same as Gymnasium spaces."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.domains.navigation.env.config import NavigationConfig

PI = float(np.float32(np.pi) + np.float32(1e-6))


def action_spec(config: NavigationConfig) -> DiscreteActions:
    """Stop, forward, left and right; a task without stop has the last three."""
    return DiscreteActions(4 if config.kind.has_stop else 3)


def observation_specs(config: NavigationConfig, num_sensors: int) -> dict[str, ObservationSpec]:
    """One agent's observations by name.

    ``photoreceptors`` (K, B*B, 3) in 0..1, left out without vision; in their place, where a ``camera_size`` is given,
    ``camera`` (K, H, W, 3) uint8, top row first; ``design`` (K, 7) normalised; ``gps`` (2,) metres
    ahead and right of the start; ``compass`` (1,) radians from the start's heading; ``pointgoal`` (2,) distance [m]
    and bearing [rad, left positive] from where the agent is, where the task shows the goal.
    """
    specs = {
        "compass": ObservationSpec((1,), "vector", low=-PI, high=PI),
        "design": ObservationSpec((num_sensors, 7), "design"),
        "gps": ObservationSpec((2,), "vector"),
    }
    if config.kind.shows_goal:
        specs["pointgoal"] = ObservationSpec((2,), "vector")
    if config.vision and config.camera_size:
        size = config.camera_size
        specs["camera"] = ObservationSpec((num_sensors, size, size, 3), "image", "uint8", 0.0, 255.0)
    elif config.vision:
        specs["photoreceptors"] = ObservationSpec((num_sensors, config.grid**2, 3), "receptors", low=0.0, high=1.0)
    return specs


def observation_space(config: NavigationConfig, num_sensors: int) -> spaces.Dict:
    """Space of one agent's observations, as :func:`observation_specs` has them."""
    boxes: dict[str, spaces.Space] = {}
    for name, spec in observation_specs(config, num_sensors).items():
        dtype = np.uint8 if spec.dtype == "uint8" else np.float32
        boxes[name] = spaces.Box(dtype(spec.low), dtype(spec.high), spec.shape, dtype)
    if config.kind.shows_goal:
        low, high = np.array([0.0, -PI], np.float32), np.array([np.inf, PI], np.float32)
        boxes["pointgoal"] = spaces.Box(low, high, dtype=np.float32)
    return spaces.Dict(boxes)
