"""What navigation tasks have in common: settings of their rules, and the judgement of a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


class Rules(Protocol):
    """Settings that every navigation task has."""

    @property
    def success_distance(self) -> float:
        """How near to the goal counts as there [m], geodesic."""
        ...

    @property
    def max_steps(self) -> int:
        """Steps after which an episode is cut off."""
        ...

    @property
    def success_reward(self) -> float:
        """Reward of success."""
        ...

    @property
    def slack(self) -> float:
        """Cost of each step, c^slack in the paper."""
        ...


class Verdict(NamedTuple):
    """What a step of N agents was worth."""

    success: Bools
    """Whether the episode succeeded with it, (N,)."""
    rewards: Floats
    """(N,)."""
    terminated: Bools
    """Whether the episode ended with it, not counting the time limit, (N,)."""


@dataclass(frozen=True)
class TaskKind:
    """What tells one navigation task from another."""

    name: str
    has_stop: bool
    """Whether action 0 is stop; without it actions begin with forward."""
    shows_goal: bool
    """Whether agents are told distance and bearing of the goal."""
    judge: Callable[[Untyped, Bools, Floats, Floats], Verdict]
    """(rules, where agents stopped (N,), geodesic distance to the goal before and after the step (N,) [m])."""
    spheres: Callable[[Floats, Untyped], Floats] | None = None
    """(goals (n, 3) [m], rules) -> centres and radii [m] (n, 4) of what hangs over them to be seen."""
