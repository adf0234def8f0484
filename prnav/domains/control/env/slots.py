"""A control task over N slots, each playing one episode at a time: the core that every environment is a layer on.

There is no reset on its own here: :meth:`ControlSlots.begin` puts a slot at an episode's start. All arrays have the
slots on the first axis; nothing loops over them but the drawing of starts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array, JSONObject
from prnav.contracts import BoxActions, ObservationSpec
from prnav.domains.control.env.config import ControlConfig
from prnav.domains.control.env.spaces import action_spec, observation_specs
from prnav.domains.control.eyes import Eyes, Mounts, open_eyes
from prnav.domains.control.facts import EPISODE_STEPS
from prnav.domains.control.physics import Physics
from prnav.domains.control.tasks import make_task, start
from prnav.errors import ConfigError, DesignError, EpisodeError

Observations = dict[str, Array]
"""float32, but for pictures, which are bytes."""

_STATE = ("seed", "steps", "total_reward", "diverged", "theta", "suite_state")
"""Arrays that, with the physics', say everything about the slots."""


class ControlSlots:
    """N agents playing episodes; what happens in one slot depends on its episode's seed and actions alone.

    An episode is named by its seed, 0 to 2^32 - 1. It lasts 1,000 simulation steps; one that diverges ends at once, is
    counted, and gives no reward for that step.
    """

    def __init__(self, config: ControlConfig, num_slots: int, seeds: Sequence[int] = (), mounts: Mounts | None = None):
        """Slots that play no episode yet.

        Args:
            config: task and senses.
            num_slots: N.
            seeds: of a list of episodes, which :meth:`begin` counts through.
            mounts: sensors to take in place of the design that the config names.

        Raises:
            PrnavError: MuJoCo is missing, or the design does not fit the body.
        """
        if num_slots < 1:
            raise ConfigError(f"there are {num_slots} slots; there must be at least 1")
        self.config = config
        self.facts = config.facts
        self.num_slots = num_slots
        self.seeds = np.array(seeds, np.int64)
        self.task = make_task(config.task)
        self.model = self.task.build()
        self.eyes: Eyes | None = open_eyes(self.model, config, num_slots, mounts)
        derived = (*self.task.derived, *(self.eyes.derived if self.eyes else ()))
        self.physics = Physics(
            self.model,
            num_slots,
            self.facts.physics_steps,
            tuple(dict.fromkeys(derived)),
            self.task.expanded,
            min(config.threads, num_slots),
        )
        self.num_sensors = self.eyes.num_sensors if self.eyes else 0
        self.observation_specs: dict[str, ObservationSpec] = observation_specs(config, self.num_sensors)
        self.action_spec: BoxActions = action_spec(config)
        self.seed = np.full(num_slots, -1, np.int64)  #: of the episode, -1 before the first
        self.steps = np.zeros(num_slots, np.int64)  #: simulation steps so far
        self.total_reward = np.zeros(num_slots)
        self.diverged = np.zeros(num_slots, np.bool_)
        self.theta = np.zeros((num_slots, self.num_sensors, 7))  #: normalised designs
        self.suite_state = np.zeros((num_slots, self.facts.observation_size))  #: the suite's own observation
        self.actions = np.zeros((num_slots, self.facts.actions))  #: the last ones
        self.rewards = np.zeros(num_slots)  #: of the last action
        self.terminated = np.zeros(num_slots, np.bool_)
        self.truncated = np.zeros(num_slots, np.bool_)
        self._aim(np.arange(num_slots))

    @property
    def episode_ids(self) -> tuple[tuple[str, str], ...]:
        """(task, seed) of every episode of the list."""
        return tuple((self.config.task, str(seed)) for seed in self.seeds)

    def begin(self, slots: ArrayLike, episodes: ArrayLike) -> None:
        """Put slots (n,) at the starts of the list's episodes with these indices (n,)."""
        indices = np.asarray(episodes, np.int64)
        if len(indices) and not 0 <= indices.min() <= indices.max() < len(self.seeds):
            raise EpisodeError(f"episode {int(indices.max())} of {len(self.seeds)}; they are counted from 0")
        self.begin_seeds(slots, self.seeds[indices])

    def begin_seeds(self, slots: ArrayLike, seeds: ArrayLike) -> None:
        """Put slots (n,) at the starts of the episodes with these seeds (n,)."""
        slots, seeds = np.asarray(slots, np.int64), np.asarray(seeds, np.int64)
        if not len(slots):
            return
        if not 0 <= seeds.min() <= seeds.max() < 1 << 32:
            wrong = seeds[(seeds < 0) | (seeds >= 1 << 32)][0]
            raise EpisodeError(f"seed of an episode is {wrong}; it must be 0 to {(1 << 32) - 1}")
        start(self.task, self.physics, slots, seeds)
        self.seed[slots] = seeds
        for array in (self.steps, self.total_reward, self.rewards, self.diverged, self.terminated, self.truncated):
            array[slots] = 0
        self.suite_state[slots] = self.task.observe(self.physics)[slots]

    def advance(self, actions: ArrayLike, acting: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
        """Take one action in the slots where ``acting`` (N,), or all; True where the episode ended with it, (N,).

        Args:
            actions: (N, D); numbers beyond -1..1 count as the bounds.
            acting: which slots take one; None is all.

        Raises:
            ValueError: actions have the wrong shape or are not finite.
        """
        actions = np.asarray(actions, np.float64)
        if actions.shape != (self.num_slots, self.facts.actions):
            raise ValueError(
                f"actions have shape {actions.shape}; it must be {(self.num_slots, self.facts.actions)}, "
                "numbers in -1..1"
            )
        rows = None if acting is None or bool(acting.all()) else np.flatnonzero(acting)
        at = slice(None) if rows is None else rows
        if not np.isfinite(actions[at]).all():
            raise ValueError("actions hold numbers that are not finite; all must lie in -1..1")
        self.actions[at] = actions[at]
        moving = np.zeros(self.num_slots, np.bool_)
        moving[at] = True
        alive = moving.copy()
        self.rewards[:] = 0.0
        if moving.any():
            for _ in range(self.config.repeat):
                alive[at] &= ~self.physics.step(actions[at], rows)
                self.rewards += np.where(alive, self.task.reward(self.physics), 0.0)
            self.suite_state[at] = self.task.observe(self.physics)[at]
        self.steps += self.config.repeat * moving
        self.total_reward += self.rewards
        self.terminated = moving & ~alive
        self.diverged |= self.terminated
        self.truncated = alive & (self.steps >= EPISODE_STEPS)
        return self.terminated | self.truncated

    def observe(self, slots: ArrayLike | None = None) -> Observations:
        """Observations of slots (n,), all of them by default: new arrays, each (n, ...)."""
        rows = slice(None) if slots is None else np.asarray(slots, np.int64)
        observations: Observations = {}
        if self.config.senses == "state":
            observations["state"] = self.suite_state[rows].astype(np.float32)
        elif self.config.senses == "receptors":
            observations["photoreceptors"] = self._eyes.read(self.physics, rows)
        elif self.config.senses in ("camera", "third-person"):
            observations["camera"] = self._eyes.picture(self.physics, rows)
        if self.config.designed:
            observations["design"] = self.theta[rows].astype(np.float32)
        return observations

    def measures(self, slots: ArrayLike | None = None) -> dict[str, NDArray[np.float64]]:
        """Measures of slots (n,) so far, each (n,) float64; final once the episode has ended.

        ``return`` is the sum of rewards, 1,000 at most; ``steps`` counts simulation steps; ``diverged`` is 1 where the
        simulation did.
        """
        rows = slice(None) if slots is None else np.asarray(slots, np.int64)
        values = {"return": self.total_reward, "steps": self.steps, "diverged": self.diverged}
        return {name: np.array(value[rows], np.float64) for name, value in values.items()}

    def outcome(self, slot: int) -> JSONObject:
        """Measures and facts of one slot's episode, as plain numbers and strings."""
        return {
            "scene_id": self.config.task,
            "episode_id": str(self.seed[slot]),
            "return": float(self.total_reward[slot]),
            "steps": int(self.steps[slot]),
            "diverged": int(self.diverged[slot]),
        }

    def state(self, slots: ArrayLike) -> dict[str, Array]:
        """Where slots (n,) are: joint positions and velocities, targets [m] and the suite's own observation."""
        rows = np.asarray(slots, np.int64)
        return {
            "qpos": self.physics.qpos[rows],
            "qvel": self.physics.qvel[rows],
            "target": self.task.target(self.physics)[rows],
            "suite_state": self.suite_state[rows],
        }

    def events(self, slots: ArrayLike) -> dict[str, Array]:
        """The last actions of slots (n,), what they were rewarded with, and whether the simulation diverged."""
        rows = np.asarray(slots, np.int64)
        return {
            "actions": self.actions[rows].astype(np.float32),
            "reward": self.rewards[rows],
            "diverged": self.diverged[rows],
        }

    def set_designs(self, slots: ArrayLike, theta: ArrayLike) -> None:
        """Give slots (n,) normalised designs (n, K, 7) from now on.

        Raises:
            DesignError: the shape is wrong, or a number is not finite.
        """
        rows = np.asarray(slots, np.int64)
        self.theta[rows] = self.checked_theta(len(rows), theta)
        self._aim(rows)

    def checked_theta(self, count: int, theta: ArrayLike) -> NDArray[np.float64]:
        """``count`` normalised designs (count, K, 7).

        Raises:
            DesignError: the shape is wrong, or a number is not finite.
        """
        if not self.config.designed:
            raise DesignError(f"an agent with senses {self.config.senses!r} has no sensors to place")
        values = np.asarray(theta, np.float64)
        want = (count, self.num_sensors, 7)
        if values.shape != want:
            raise DesignError(f"designs have shape {values.shape}; for this environment it must be {want}")
        if not np.isfinite(values).all():
            raise DesignError("a design holds numbers that are not finite; all 7 entries of each sensor must be finite")
        return values

    def snapshot(self) -> JSONObject:
        """Copies of all that :meth:`restore` needs to continue exactly here."""
        return {**{name: getattr(self, name).copy() for name in _STATE}, "physics": self.physics.get_state()}

    def restore(self, state: JSONObject) -> None:
        """Continue where :meth:`snapshot` was taken, with the same config and number of slots.

        Raises:
            ConfigError: the snapshot is of another number of slots or another task.
        """
        for name in _STATE:
            array = getattr(self, name)
            value = np.asarray(state[name])
            if value.shape != array.shape:
                raise ConfigError(f"the snapshot's {name} has shape {value.shape}; here it must be {array.shape}")
            array[...] = value
        self.physics.set_state(state["physics"])
        self._aim(np.arange(self.num_slots))

    @property
    def _eyes(self) -> Eyes:
        assert self.eyes is not None
        return self.eyes

    def _aim(self, rows: NDArray[np.int64]) -> None:
        if self.config.designed and self.eyes is not None:
            self.eyes.aim(rows, self.theta[rows])
