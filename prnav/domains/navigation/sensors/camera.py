"""Sensor "camera": a picture from each sensor of the design in bytes, top row first."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gymnasium import spaces

from prnav.aliases import Untyped
from prnav.contracts import ObservationSpec
from prnav.domains.navigation.sensors.sensor import Situation, box
from prnav.errors import ConfigError

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design


class CameraSensor:
    """See :class:`prnav.domains.navigation.sensors.Sensor`."""

    name = "camera"

    def __init__(self, config: NavigationConfig, design: Design) -> None:
        """K cameras of ``config.camera_size`` pixels a side.

        Raises:
            ConfigError: there is no size.
        """
        size = self.size = config.camera_size
        if size < 1:
            raise ConfigError(f"sensor 'camera' has camera_size {size}; give the pixels of a side, such as 128")
        self.spec = ObservationSpec((design.num_sensors, size, size, 3), "image", "uint8", 0.0, 255.0)

    @property
    def space(self) -> spaces.Box:
        """(K, size, size, 3)."""
        return box(self.spec)

    def read(self, now: Situation) -> Untyped:
        """(n, K, size, size, 3) uint8."""
        assert now.light is not None
        return now.light.pictures(now.viewpoints, self.size)
