"""What agents sense, one module a sensor. Adding one is a module and a line in :data:`SENSORS`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from prnav.domains.navigation.sensors.sensor import Sensor, SensorType, Situation
from prnav.errors import ConfigError
from prnav.registry import resolve

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design

SENSORS: dict[str, str] = {
    "compass": "prnav.domains.navigation.sensors.compass:Compass",
    "design": "prnav.domains.navigation.sensors.design_vector:DesignVector",
    "gps": "prnav.domains.navigation.sensors.gps:Gps",
    "pointgoal": "prnav.domains.navigation.sensors.pointgoal:PointGoal",
    "camera": "prnav.domains.navigation.sensors.camera:CameraSensor",
    "photoreceptors": "prnav.domains.navigation.sensors.photoreceptors:PhotoreceptorSensor",
}
"""Name of a sensor, and of what it observes -> module and class, imported when an environment has it."""

SEEING = ("receptors", "image")
"""Kinds of observations that light is needed for: left out for a blind agent."""


def sensor_type(name: str) -> SensorType:
    """Class of the sensor of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in SENSORS:
        raise ConfigError(f"sensor {name!r} is not known; valid: {', '.join(map(repr, SENSORS))}")
    made: SensorType = resolve(SENSORS, name)
    return made


def make_sensors(names: Iterable[str], config: NavigationConfig, design: Design) -> Mapping[str, Sensor]:
    """Sensors by name, in that order.

    Without ``config.vision`` those that need light are left out. Where some do, the design vector is there too, since
    policies read light together with where it was received.

    Raises:
        ConfigError: there is no such sensor, or one does not fit the settings.
    """
    sensors = {name: sensor_type(name)(config, design) for name in names}
    if not config.vision:
        sensors = {name: sensor for name, sensor in sensors.items() if sensor.spec.kind not in SEEING}
    kinds = {sensor.spec.kind for sensor in sensors.values()}
    if kinds & set(SEEING) and "design" not in kinds:
        sensors["design"] = sensor_type("design")(config, design)
    return sensors


__all__ = ["SEEING", "SENSORS", "Sensor", "SensorType", "Situation", "make_sensors", "sensor_type"]
