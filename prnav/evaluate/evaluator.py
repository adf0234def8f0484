"""Running episodes: each of a list once, over N slots, a slot taking the next episode when its own ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prnav.evaluate.agents import Agent, Turn
from prnav.evaluate.sampling import episode_key
from prnav.evaluate.slots import HOLD, EpisodeSlots


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What an agent did in an episode of T steps."""

    positions: NDArray[np.float64]
    """Positions [m] before the first step and after each, shape (T + 1, 3)."""
    yaws: NDArray[np.float64]
    """Yaws [rad], shape (T + 1,)."""
    actions: NDArray[np.int8]
    """Actions taken, shape (T,)."""
    collisions: NDArray[np.bool_]
    """Steps that hit something, shape (T,)."""


@dataclass(frozen=True, eq=False)
class Played:
    """One finished episode: its place in the list, its row of measures, its trajectory."""

    index: int
    row: dict[str, Any]
    trajectory: Trajectory


def play_episodes(
    slots: EpisodeSlots, agent: Agent, episodes: Iterable[int], seed: int, on_played: Callable[[Played], None]
) -> None:
    """Play each of ``episodes`` (indices into ``slots.episode_ids``) once.

    What happens in an episode depends on the episode, the agent and the seed alone, as long as the agent's answer to
    a row of observations does not depend on the other rows. ``on_played`` is called as episodes end, in an order
    that does depend on the number of slots.
    """
    count = slots.num_slots
    waiting = iter(episodes)
    playing = np.full(count, -1, dtype=np.int64)  # index of the episode in each slot, -1 in an idle one
    steps = np.zeros(count, dtype=np.int64)
    keys = np.zeros(count, dtype=np.uint64)
    tracks = _Tracks(count)
    free = np.arange(count)
    while True:
        begun = [(slot, episode) for slot, episode in zip(free, waiting, strict=False)]
        if begun:
            starting = np.array([slot for slot, _ in begun], dtype=np.int64)
            playing[starting] = [episode for _, episode in begun]
            steps[starting] = 0
            keys[starting] = [episode_key(seed, *slots.episode_ids[episode]) for _, episode in begun]
            slots.begin(starting, playing[starting])
            tracks.begin(starting, slots)
        active = playing >= 0
        if not active.any():
            return
        answer = agent.act(Turn(_observe(slots, active), active & (steps == 0), active, keys, steps))
        actions = np.where(active, answer, HOLD)
        ended = slots.advance(actions) & active
        steps[active] += 1
        tracks.append(active, steps, actions, slots)
        free = np.flatnonzero(ended)
        for slot in free:
            on_played(Played(int(playing[slot]), slots.outcome(int(slot)), tracks.take(int(slot), int(steps[slot]))))
        playing[free] = -1


def _observe(slots: EpisodeSlots, active: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """Observations (N, ...), zeros in idle slots: what nobody will use need not be rendered."""
    rows = np.flatnonzero(active)
    observations = slots.observe(rows)
    if len(rows) == len(active):
        return dict(observations)
    filled = {name: np.zeros((len(active), *part.shape[1:]), part.dtype) for name, part in observations.items()}
    for name, part in observations.items():
        filled[name][rows] = part
    return filled


class _Tracks:
    """Growing trajectories of all slots in four arrays, time on the second axis."""

    def __init__(self, count: int, length: int = 64) -> None:
        self.positions = np.zeros((count, length + 1, 3))
        self.yaws = np.zeros((count, length + 1))
        self.actions = np.zeros((count, length), dtype=np.int8)
        self.collisions = np.zeros((count, length), dtype=np.bool_)

    def begin(self, starting: NDArray[np.int64], slots: EpisodeSlots) -> None:
        self.positions[starting, 0] = slots.positions[starting]
        self.yaws[starting, 0] = slots.yaws[starting]

    def append(
        self,
        active: NDArray[np.bool_],
        steps: NDArray[np.int64],
        actions: NDArray[np.int64],
        slots: EpisodeSlots,
    ) -> None:
        """Write the step that just ended: ``steps`` (N,) counts it already."""
        if steps.max() > self.actions.shape[1]:
            for name in ("positions", "yaws", "actions", "collisions"):
                old = getattr(self, name)
                setattr(self, name, np.concatenate([old, np.zeros_like(old)], axis=1))
        moved = np.flatnonzero(active)
        time = steps[moved]
        self.positions[moved, time] = slots.positions[moved]
        self.yaws[moved, time] = slots.yaws[moved]
        self.actions[moved, time - 1] = actions[moved]
        self.collisions[moved, time - 1] = slots.collided[moved]

    def take(self, slot: int, length: int) -> Trajectory:
        return Trajectory(
            self.positions[slot, : length + 1].copy(),
            self.yaws[slot, : length + 1].copy(),
            self.actions[slot, :length].copy(),
            self.collisions[slot, :length].copy(),
        )
