"""Sensor "gps": where the agent is, in metres ahead and right of where its episode started."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from prnav.contracts import ObservationSpec
from prnav.domains.navigation.sensors.sensor import Situation, box
from prnav.sensors import gps

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design


class Gps:
    """See :class:`prnav.domains.navigation.sensors.Sensor`."""

    name = "gps"
    spec = ObservationSpec((2,), "vector")

    def __init__(self, config: NavigationConfig, design: Design) -> None:
        """Nothing to set."""

    @property
    def space(self) -> spaces.Box:
        """(2,) [m]."""
        return box(self.spec)

    def read(self, now: Situation) -> NDArray[np.float32]:
        """(n, 2)."""
        return gps(now.positions, now.starts, now.start_yaws)
