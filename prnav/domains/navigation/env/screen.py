"""``render_mode="rgb_array"``: pictures of agents as they are now, with the ways that they took."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON
from prnav.domains.navigation.env.trails import Trails
from prnav.errors import ConfigError

if TYPE_CHECKING:
    from prnav.domains.navigation.env.slots import NavigationSlots
    from prnav.domains.navigation.pictures.live import LivePictures

RENDER_MODES = ("rgb_array",)

FPS = 8
"""Pictures per second of a film: so many steps an agent takes in one."""


def check_render_mode(mode: str | None) -> str | None:
    """``mode``, if there is such a one.

    Raises:
        ConfigError: there is none.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise ConfigError(f"render_mode is {mode!r}; valid: {', '.join(map(repr, RENDER_MODES))}, or None")
    return mode


class RenderScreen:
    """Keeps the ways of agents and draws them; what draws is imported when the first picture is asked for."""

    def __init__(self, slots: NavigationSlots) -> None:
        """Of all agents in ``slots``."""
        self.slots = slots
        self.trails = Trails(slots.num_slots)

    def begin(self, agents: NDArray[np.int64]) -> None:
        """Agents (n,) stand where their way begins."""
        self.trails.begin(agents, self.slots.positions)

    def go(self) -> None:
        """All agents have taken a step."""
        self.trails.go(self.slots.positions, self.slots.collided)

    @cached_property
    def _pictures(self) -> LivePictures:
        from prnav.domains.navigation.pictures.live import LivePictures

        return LivePictures(self.slots)

    def picture(self, agent: int, observations: Mapping[str, JSON]) -> NDArray[np.uint8]:
        """An agent's way on the floor plan beside what it sees, (H, W, 3).

        Args:
            agent: which.
            observations: what it was last shown, without a batch axis.

        Raises:
            ConfigError: no episode has begun.
        """
        if self.slots.episode[agent] < 0:
            raise ConfigError("there is nothing to render before the first reset(); call it first")
        return self._pictures.frame(agent, self.trails, observations)
