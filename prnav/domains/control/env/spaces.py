"""What an agent is shown and can do: specs for learning, and the same as Gymnasium's spaces."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from prnav.contracts import BoxActions, ObservationSpec
from prnav.domains.control.env.config import ControlConfig


def observation_specs(config: ControlConfig, num_sensors: int) -> dict[str, ObservationSpec]:
    """Specs of one agent's observations with K sensors on its body.

    ``photoreceptors`` (K, B*B, 3) in 0..1, or ``camera`` (K, H, W, 3) in bytes, top row first (K is 1 for the third
    person's), or ``state`` (n,), the suite's own observation; and where a design places sensors, ``design`` (K, 7)
    normalised, which is all that a blind agent is shown and says nothing about the world.
    """
    specs: dict[str, ObservationSpec] = {}
    size = config.camera_size
    if config.senses == "receptors":
        shape = (num_sensors, config.grid**2, 3)
        specs["photoreceptors"] = ObservationSpec(shape, "receptors", low=0.0, high=1.0)
    elif config.senses in ("camera", "third-person"):
        count = num_sensors if config.designed else 1
        specs["camera"] = ObservationSpec((count, size, size, 3), "image", "uint8", 0.0, 255.0)
    elif config.senses == "state":
        specs["state"] = ObservationSpec((config.facts.observation_size,), "vector")
    if config.designed:
        specs["design"] = ObservationSpec((num_sensors, 7), "design")
    return specs


def action_spec(config: ControlConfig) -> BoxActions:
    """A number in -1..1 for each motor."""
    return BoxActions((-1.0,) * config.facts.actions, (1.0,) * config.facts.actions)


def observation_space(specs: dict[str, ObservationSpec]) -> spaces.Dict:
    """The space of observations with these specs."""
    boxes = {
        name: spaces.Box(
            np.dtype(spec.dtype).type(spec.low),
            np.dtype(spec.dtype).type(spec.high),
            spec.shape,
            np.dtype(spec.dtype).type,
        )
        for name, spec in specs.items()
    }
    return spaces.Dict(dict(boxes))


def action_space(spec: BoxActions) -> spaces.Box:
    """The space of actions with this spec."""
    return spaces.Box(np.array(spec.low, np.float32), np.array(spec.high, np.float32), dtype=np.float32)
