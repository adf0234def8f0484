"""What acts in episodes: a trained policy or a rule, asked for the actions of all slots at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array


@dataclass(frozen=True, eq=False)
class Turn:
    """What an agent is shown before each step; N slots, of which the active ones are in an episode."""

    observations: Mapping[str, Array]
    """Batched observations, each (N, ...); rows of idle slots mean nothing."""
    starts: NDArray[np.bool_]
    """True where the episode begins with this step: memory must be cleared, shape (N,)."""
    active: NDArray[np.bool_]
    """True where an answer is used, shape (N,)."""
    keys: NDArray[np.uint64]
    """Key of (seed, episode) for :func:`prnav.play.noise.uniforms`, shape (N,)."""
    steps: NDArray[np.int64]
    """Steps taken so far in the episode, shape (N,)."""


class Agent(Protocol):
    """Anything that answers a turn with one action per slot."""

    @property
    def name(self) -> str:
        """The agent's name in records and tables."""
        ...

    @property
    def actions(self) -> str:
        """How actions are chosen: "greedy", "sampled", or "rule" for an agent that has no distribution."""
        ...

    def act(self, turn: Turn) -> Array:
        """Actions as the task's :class:`~prnav.contracts.spaces.ActionSpec` has them; those of idle slots are ignored.

        (N,) integers, or (N, D) numbers.
        """
        ...
