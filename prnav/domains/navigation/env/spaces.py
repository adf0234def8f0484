"""What an agent observes and can do, as Gymnasium spaces."""

from __future__ import annotations

from collections.abc import Mapping

from gymnasium import spaces

from prnav.contracts import DiscreteActions
from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.sensors import Sensor


def action_spec(config: NavigationConfig) -> DiscreteActions:
    """Stop, forward, left and right; a task without stop has the last three."""
    return DiscreteActions(4 if config.kind.has_stop else 3)


def observation_space(sensors: Mapping[str, Sensor]) -> spaces.Dict:
    """Space of one agent's observations by its sensors."""
    return spaces.Dict({name: sensor.space for name, sensor in sensors.items()})
