"""Sensor "pointgoal": distance [m] and bearing [rad, left positive] of the goal from where the agent is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from prnav.contracts import ObservationSpec
from prnav.domains.navigation.sensors.sensor import PI, Situation
from prnav.errors import ConfigError
from prnav.sensors import pointgoal

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design


class PointGoal:
    """See :class:`prnav.domains.navigation.sensors.Sensor`."""

    name = "pointgoal"
    spec = ObservationSpec((2,), "vector")

    def __init__(self, config: NavigationConfig, design: Design) -> None:
        """Nothing to set.

        Raises:
            ConfigError: the task is to find the goal without being told where it is.
        """
        if not config.kind.shows_goal:
            raise ConfigError(
                f"sensor 'pointgoal' needs a goal to tell, and {config.kind.name} does not tell where it is"
            )

    @property
    def space(self) -> spaces.Box:
        """(2,): distances from 0, bearings within half a turn."""
        return spaces.Box(np.array([0.0, -PI], np.float32), np.array([np.inf, PI], np.float32), dtype=np.float32)

    def read(self, now: Situation) -> NDArray[np.float32]:
        """(n, 2)."""
        return pointgoal(now.positions, now.yaws, now.goals)
