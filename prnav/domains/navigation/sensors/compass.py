"""Sensor "compass": the heading relative to the start's [rad], positive to the left."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from prnav.contracts import ObservationSpec
from prnav.domains.navigation.sensors.sensor import PI, Situation, box
from prnav.sensors import compass

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design


class Compass:
    """See :class:`prnav.domains.navigation.sensors.Sensor`."""

    name = "compass"
    spec = ObservationSpec((1,), "vector", low=-PI, high=PI)

    def __init__(self, config: NavigationConfig, design: Design) -> None:
        """Nothing to set."""

    @property
    def space(self) -> spaces.Box:
        """(1,) [rad]."""
        return box(self.spec)

    def read(self, now: Situation) -> NDArray[np.float32]:
        """(n, 1)."""
        return compass(now.yaws, now.start_yaws)[:, None]
