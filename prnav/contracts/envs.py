"""Batched environments as the trainer sees them, and the abilities that some have, each a protocol of its own.

Letters in shapes: N environments, n of them, K sensors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array, JSONObject, Untyped
from prnav.contracts.records import Outcome
from prnav.contracts.spaces import ActionSpec, ObservationSpecs

Observations = dict[str, Untyped]
"""Arrays (N, ...) by name: NumPy's on the host, or anything that speaks DLPack where it lies."""

State = JSONObject
"""A snapshot: nested dictionaries of arrays, numbers and strings, which a checkpoint stores as they are."""

Info = dict[str, Untyped]
"""What Gymnasium's environments tell beside observations and rewards."""

StepResult = tuple[Observations, Array, NDArray[np.bool_], NDArray[np.bool_], Info]
"""Observations, rewards (N,), terminated (N,), truncated (N,), info."""


@runtime_checkable
class BatchEnv(Protocol):
    """N environments stepped together, each starting its next episode in the step that ends one.

    This is Gymnasium's vector interface with ``AutoresetMode.SAME_STEP``: where an episode ended, the observation is
    the next one's first, ``info["final_obs"]`` holds the old one's last, and ``info["final_info"]`` its measures.
    Specs take the place of spaces, and the state can be taken and put back whole.
    """

    @property
    def num_envs(self) -> int:
        """N."""
        ...

    @property
    def observation_specs(self) -> ObservationSpecs:
        """What one agent is shown, by name."""
        ...

    @property
    def action_spec(self) -> ActionSpec:
        """What one agent can do."""
        ...

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Info | None = None
    ) -> tuple[Observations, Info]:
        """Start a new episode in every environment; environment i is seeded ``seed + i``."""
        ...

    def step(self, actions: Array) -> StepResult:
        """Take actions: (N,) integers of :class:`DiscreteActions`, (N, D) float32 of :class:`BoxActions`."""
        ...

    def snapshot(self) -> State:
        """All that :meth:`restore` needs to continue exactly here."""
        ...

    def restore(self, state: State) -> None:
        """Continue where :meth:`snapshot` was taken, in environments made alike."""
        ...


@runtime_checkable
class HasExpert(Protocol):
    """Environments with an oracle that can be imitated."""

    def expert_actions(self) -> Array:
        """The oracle's action in every environment, as :attr:`BatchEnv.action_spec` has them, (N,) or (N, D)."""
        ...


@runtime_checkable
class Designable(Protocol):
    """Environments whose agents' sensor designs can be set."""

    def set_designs(self, agents: ArrayLike, theta: ArrayLike) -> None:
        """Normalised designs (n, K, 7) of agents (n,), from their next episodes on.

        Raises:
            DesignError: an agent or a shape is wrong, or a number is not finite.
        """
        ...


@runtime_checkable
class EpisodeSlots(Protocol):
    """N slots that are handed the episodes of a list one by one: what evaluation, validation and judging play on.

    What happens in a slot depends on its episode and the actions taken in it alone.
    """

    @property
    def num_slots(self) -> int:
        """N."""
        ...

    @property
    def observation_specs(self) -> ObservationSpecs:
        """What one agent is shown, by name."""
        ...

    @property
    def action_spec(self) -> ActionSpec:
        """What one agent can do."""
        ...

    @property
    def episode_ids(self) -> Sequence[tuple[str, str]]:
        """(scene_id, episode_id) of every episode of the list, in its order."""
        ...

    def begin(self, slots: NDArray[np.int64], episodes: NDArray[np.int64]) -> None:
        """Put slots (n,) at the starts of the episodes with these indices (n,)."""
        ...

    def observe(self, slots: NDArray[np.int64]) -> Observations:
        """Observations of slots (n,), each (n, ...)."""
        ...

    def advance(self, actions: Array, acting: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Take a step in the slots where ``acting`` (N,); True where the episode ended with it, (N,).

        Args:
            actions: as :attr:`action_spec` has them, (N,) or (N, D); those of other slots are ignored.
            acting: which slots are in an episode.
        """
        ...

    def outcome(self, slot: int) -> Outcome:
        """Measures and facts of the episode that a slot plays, final once it has ended."""
        ...

    def state(self, slots: NDArray[np.int64]) -> Mapping[str, Array]:
        """Where slots (n,) are now, by name, each (n, ...): what a trace keeps of every state."""
        ...

    def events(self, slots: NDArray[np.int64]) -> Mapping[str, Array]:
        """What the last step of slots (n,) did and met, by name, each (n, ...); ``actions`` is among them."""
        ...
