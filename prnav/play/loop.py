"""The one loop that plays episodes: each of a list once, over N slots, a slot taking the next when its own ends.

Validation, evaluation, the judging of designs and state probes all play through :func:`play`; what they want to know
they learn as observers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.contracts.agents import Agent, Turn
from prnav.contracts.envs import EpisodeSlots
from prnav.contracts.records import Outcome, Played, Trace
from prnav.contracts.spaces import BoxActions
from prnav.play.noise import episode_key

Rows = NDArray[np.int64]


class Observer(Protocol):
    """Told what happens while episodes are played."""

    def begun(self, slots: EpisodeSlots, rows: Rows) -> None:
        """Slots (n,) are at the start of an episode."""
        ...

    def stepped(self, slots: EpisodeSlots, turn: Turn, rows: Rows) -> None:
        """Slots (n,) took a step; ``turn`` is what the agent had been shown before it."""
        ...

    def ended(self, slot: int, episode: int, outcome: Outcome) -> None:
        """The episode of a slot ended with its last step."""
        ...


def play(
    agent: Agent, slots: EpisodeSlots, episodes: Iterable[int], seed: int, observers: Sequence[Observer] = ()
) -> None:
    """Play each of ``episodes`` (indices into ``slots.episode_ids``) once.

    What happens in an episode depends on the episode, the agent and the seed alone, as long as the agent's answer to
    a row of observations does not depend on the other rows. Episodes end in an order that does depend on the number
    of slots.
    """
    count = slots.num_slots
    shape = (count, slots.action_spec.size) if isinstance(slots.action_spec, BoxActions) else (count,)
    waiting = iter(episodes)
    playing = np.full(count, -1, dtype=np.int64)  # index of the episode in each slot, -1 in an idle one
    steps = np.zeros(count, dtype=np.int64)
    keys = np.zeros(count, dtype=np.uint64)
    free = np.arange(count)
    while True:
        begun = [(slot, episode) for slot, episode in zip(free, waiting, strict=False)]
        if begun:
            starting = np.array([slot for slot, _ in begun], dtype=np.int64)
            playing[starting] = [episode for _, episode in begun]
            steps[starting] = 0
            keys[starting] = [episode_key(seed, *slots.episode_ids[episode]) for _, episode in begun]
            slots.begin(starting, playing[starting])
            for observer in observers:
                observer.begun(slots, starting)
        active = playing >= 0
        if not active.any():
            return
        turn = Turn(_observe(slots, active), active & (steps == 0), active, keys.copy(), steps.copy())
        answer = np.asarray(agent.act(turn))
        assert answer.shape == shape, f"agent {agent.name} gave actions {answer.shape} where {shape} are needed"
        ended = slots.advance(answer, active) & active
        steps[active] += 1
        rows = np.flatnonzero(active)
        for observer in observers:
            observer.stepped(slots, turn, rows)
        free = np.flatnonzero(ended)
        for slot in free.tolist():
            outcome = slots.outcome(slot)
            for observer in observers:
                observer.ended(slot, int(playing[slot]), outcome)
        playing[free] = -1


def _observe(slots: EpisodeSlots, active: NDArray[np.bool_]) -> dict[str, Array]:
    """Observations (N, ...), zeros in idle slots: what nobody will use need not be rendered."""
    rows = np.flatnonzero(active)
    observations = slots.observe(rows)
    if len(rows) == len(active):
        return dict(observations)
    filled = {name: np.zeros((len(active), *part.shape[1:]), part.dtype) for name, part in observations.items()}
    for name, part in observations.items():
        filled[name][rows] = part
    return filled


class Outcomes:
    """Observer that keeps the measures of each episode, in the order of the list."""

    def __init__(self) -> None:
        self.rows: dict[int, Outcome] = {}

    def begun(self, slots: EpisodeSlots, rows: Rows) -> None:
        """Nothing to keep."""

    def stepped(self, slots: EpisodeSlots, turn: Turn, rows: Rows) -> None:
        """Nothing to keep."""

    def ended(self, slot: int, episode: int, outcome: Outcome) -> None:
        """Keep the outcome."""
        self.rows[episode] = outcome

    def measures(self) -> dict[str, NDArray[np.float64]]:
        """Each measure over the episodes, ordered by their index, (E,)."""
        ordered = [self.rows[episode] for episode in sorted(self.rows)]
        names = [name for name, value in ordered[0].items() if isinstance(value, int | float)] if ordered else []
        return {name: np.array([row[name] for row in ordered], np.float64) for name in names}


class TraceRecorder:
    """Observer that keeps whole traces, in arrays that grow, time on the second axis; hands on what is finished."""

    def __init__(self, on_played: Callable[[Played], None], length: int = 64) -> None:
        self.on_played = on_played
        self._length = length
        self._states: dict[str, Array] = {}
        self._events: dict[str, Array] = {}
        self._steps = np.zeros(0, np.int64)

    def begun(self, slots: EpisodeSlots, rows: Rows) -> None:
        """Write the first states."""
        if len(self._steps) != slots.num_slots:
            self._steps = np.zeros(slots.num_slots, np.int64)
        self._steps[rows] = 0
        self._write(self._states, slots.state(rows), rows, self._steps[rows], slots.num_slots)

    def stepped(self, slots: EpisodeSlots, turn: Turn, rows: Rows) -> None:
        """Write what the step did, and the states after it."""
        self._write(self._events, slots.events(rows), rows, self._steps[rows], slots.num_slots)
        self._steps[rows] += 1
        self._write(self._states, slots.state(rows), rows, self._steps[rows], slots.num_slots)

    def ended(self, slot: int, episode: int, outcome: Outcome) -> None:
        """Hand the episode on."""
        length = int(self._steps[slot])
        states = {name: values[slot, : length + 1].copy() for name, values in self._states.items()}
        steps = {name: values[slot, :length].copy() for name, values in self._events.items()}
        self.on_played(Played(episode, outcome, Trace(states, steps)))

    def _write(
        self,
        storage: dict[str, Array],
        values: Mapping[str, Array],
        rows: Rows,
        time: Rows,
        count: int,
    ) -> None:
        for name, value in values.items():
            if name not in storage:
                storage[name] = np.zeros((count, self._length, *value.shape[1:]), value.dtype)
            while len(time) and time.max() >= storage[name].shape[1]:
                storage[name] = np.concatenate([storage[name], np.zeros_like(storage[name])], axis=1)
            storage[name][rows, time] = value
