"""Sensor "design": the normalised design of the agent's eyes, seven numbers for each; see docs/design.md."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from prnav.contracts import ObservationSpec
from prnav.domains.navigation.sensors.sensor import Situation, box

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design


class DesignVector:
    """See :class:`prnav.domains.navigation.sensors.Sensor`."""

    name = "design"

    def __init__(self, config: NavigationConfig, design: Design) -> None:
        """Of K sensors."""
        self.spec = ObservationSpec((design.num_sensors, 7), "design")

    @property
    def space(self) -> spaces.Box:
        """(K, 7)."""
        return box(self.spec)

    def read(self, now: Situation) -> NDArray[np.float32]:
        """(n, K, 7)."""
        return now.theta.astype(np.float32)
