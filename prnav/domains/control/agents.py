"""Reference agents of the control tasks: what any trained one is measured against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.contracts import Agent, Turn
from prnav.errors import ConfigError
from prnav.play import uniforms_of_width

REFERENCE_AGENTS: tuple[str, ...] = ("random", "still")


@dataclass(frozen=True)
class RandomAgent:
    """Every motor anywhere in -1..1, anew with each decision."""

    motors: int
    name: str = "random"
    actions: str = "sampled"

    def act(self, turn: Turn) -> NDArray[np.float64]:
        """Actions (N, D), drawn from (seed, episode, step) alone."""
        return 2.0 * uniforms_of_width(turn.keys, turn.steps, self.motors) - 1.0


@dataclass(frozen=True)
class StillAgent:
    """No motor does anything."""

    motors: int
    name: str = "still"
    actions: str = "rule"

    def act(self, turn: Turn) -> NDArray[np.float64]:
        """Zeros (N, D)."""
        return np.zeros((len(turn.keys), self.motors))


def reference_agent(name: str, motors: int) -> Agent:
    """Agent of that name from :data:`REFERENCE_AGENTS` for a body with so many motors.

    Raises:
        ConfigError: there is none.
    """
    agents: dict[str, Agent] = {"random": RandomAgent(motors), "still": StillAgent(motors)}
    if name not in agents:
        raise ConfigError(f"agent {name!r} is not known; valid: {', '.join(REFERENCE_AGENTS)}")
    return agents[name]
