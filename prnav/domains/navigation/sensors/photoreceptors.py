"""Sensor "photoreceptors": what every receptor of every grid reads, 0 to 1, row by row from the top left."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gymnasium import spaces

from prnav.aliases import Untyped
from prnav.contracts import ObservationSpec
from prnav.domains.navigation.sensors.sensor import Situation, box

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design


class PhotoreceptorSensor:
    """See :class:`prnav.domains.navigation.sensors.Sensor`."""

    name = "photoreceptors"

    def __init__(self, config: NavigationConfig, design: Design) -> None:
        """K grids of ``config.grid`` x ``config.grid`` receptors."""
        self.grid = config.grid
        self.spec = ObservationSpec((design.num_sensors, self.grid**2, 3), "receptors", low=0.0, high=1.0)

    @property
    def space(self) -> spaces.Box:
        """(K, grid * grid, 3)."""
        return box(self.spec)

    def read(self, now: Situation) -> Untyped:
        """(n, K, grid * grid, 3) float32."""
        assert now.light is not None
        return now.light.readings(now.viewpoints, self.grid)
