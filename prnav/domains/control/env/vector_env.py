"""Continuous control as a native Gymnasium vector environment: N agents in one call, restarted in the same step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import JSONObject, Untyped
from prnav.config import from_mapping
from prnav.contracts import BoxActions, ObservationSpec
from prnav.domains.control.env.config import ControlConfig
from prnav.domains.control.env.seeds import EpisodeSeeds, seeds_of
from prnav.domains.control.env.slots import ControlSlots, Observations
from prnav.domains.control.env.spaces import action_space, observation_space
from prnav.domains.control.eyes import Mounts
from prnav.errors import ConfigError, DesignError

if TYPE_CHECKING:
    from prnav.domains.control.env.single_env import ControlEnv


class ControlVectorEnv(VectorEnv):
    """N agents that play one control task.

    An episode that ends is followed by the next one in the same step (Gymnasium's ``SAME_STEP``): the returned
    observation is the new episode's first, ``info["final_obs"]`` holds the old one's last (a dictionary per agent, None
    where no episode ended) and ``info["final_info"]`` its measures, each with the mask of the agents concerned under
    the same name with ``_`` in front.

    A step is one decision: its action lasts ``config.repeat`` simulation steps, whose rewards are summed. Episodes are
    truncated after 1,000 simulation steps, and terminated only where the simulation diverged.

    Agent i, seeded s, plays the same episodes as a single environment seeded s + i.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}
    config_type: ClassVar[type[ControlConfig]] = ControlConfig
    """Of a task's own class, where it is made without a config."""

    def __init__(
        self,
        num_envs: int = 1,
        config: ControlConfig | None = None,
        mounts: Mounts | None = None,
        **settings: Untyped,
    ):
        """Environment of ``num_envs`` agents.

        Args:
            num_envs: N.
            config: all settings; defaults where None.
            mounts: sensors to take in place of the design that the config names.
            settings: single settings of :class:`ControlConfig` instead of a config, for ``gymnasium.make_vec``.

        Raises:
            PrnavError: a setting is wrong, MuJoCo is missing, or the design does not fit the body.
        """
        self.config = configure(config, settings, type(self))
        if num_envs < 1:
            raise ConfigError(f"num_envs is {num_envs}; it must be at least 1")
        self.slots = ControlSlots(self.config, num_envs, mounts=mounts)
        self.num_envs = num_envs
        self.render_mode = None
        self.single_observation_space = observation_space(self.slots.observation_specs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = action_space(self.slots.action_spec)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.order = EpisodeSeeds(np.zeros(num_envs, np.int64))
        self._next_theta: dict[int, NDArray[np.float64]] = {}
        self._observations: Observations = {}

    @property
    def observation_specs(self) -> dict[str, ObservationSpec]:
        """What one agent is shown, by name."""
        return self.slots.observation_specs

    @property
    def action_spec(self) -> BoxActions:
        """What one agent can do."""
        return self.slots.action_spec

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: JSONObject | None = None
    ) -> tuple[Observations, JSONObject]:
        """Begin a new episode in every agent, from new seeds if given (one, or one per agent).

        Without a seed the sequences of episodes go on; the first reset without one draws seeds at random.
        ``options={"episodes": seeds}`` begins the episodes with these seeds (N,) instead.
        """
        if seed is not None or not self.order.drawn.any():
            self.order = EpisodeSeeds(seeds_of(seed, self.num_envs))
        everyone = np.arange(self.num_envs)
        chosen = (options or {}).get("episodes")
        self._begin(everyone, self.order.draw(everyone) if chosen is None else np.asarray(chosen, np.int64))
        self._observations = self.slots.observe()
        return self.observations(), self._facts()

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], JSONObject]:
        """One action per agent (N, D): observations, rewards (N,), terminated (N,), truncated (N,), info."""
        slots = self.slots
        ended = slots.advance(actions)
        rewards, terminated, truncated = slots.rewards.copy(), slots.terminated.copy(), slots.truncated.copy()
        self._observations = slots.observe()
        info: JSONObject = {}
        if ended.any():
            over = np.flatnonzero(ended)
            info["final_obs"] = self._final_observations(over)
            info["_final_obs"] = ended
            info["final_info"] = self._final_measures(over, ended)
            info["_final_info"] = ended
            self._begin(over, self.order.draw(over))
            for name, value in slots.observe(over).items():
                self._observations[name][over] = value
        return self.observations(), rewards, terminated, truncated, {**self._facts(), **info}

    def set_designs(self, agents: ArrayLike, theta: ArrayLike) -> None:
        """Give agents (n,) normalised designs (n, K, 7) from their next episodes on.

        Raises:
            DesignError: an agent or a shape is wrong, or a number is not finite.
        """
        agents = np.asarray(agents, np.int64)
        wrong = agents[(agents < 0) | (agents >= self.num_envs)]
        if len(wrong):
            raise DesignError(f"agent {wrong[0]} of {self.num_envs}; they are counted from 0")
        values = self.slots.checked_theta(len(agents), theta)
        for row, agent in enumerate(agents):
            self._next_theta[int(agent)] = values[row].copy()

    def snapshot(self) -> JSONObject:
        """All that :meth:`restore` needs to continue exactly here."""
        waiting = sorted(self._next_theta)
        shape = (len(waiting), self.slots.num_sensors, 7)
        return {
            "slots": self.slots.snapshot(),
            "order_seeds": self.order.seeds.copy(),
            "order_drawn": self.order.drawn.copy(),
            "next_theta_agents": np.array(waiting, np.int64),
            "next_theta": np.array([self._next_theta[agent] for agent in waiting], np.float64).reshape(shape),
        }

    def restore(self, state: JSONObject) -> None:
        """Continue where :meth:`snapshot` was taken, in environments made alike."""
        self.slots.restore(state["slots"])
        self.order = EpisodeSeeds(np.asarray(state["order_seeds"], np.int64))
        self.order.drawn[:] = state["order_drawn"]
        agents = np.asarray(state["next_theta_agents"], np.int64)
        waiting = np.asarray(state["next_theta"], np.float64)
        self._next_theta = {int(agent): theta.copy() for agent, theta in zip(agents, waiting, strict=True)}
        self._observations = self.slots.observe()

    def observations(self) -> Observations:
        """The observations that the last reset, step or :meth:`restore` left, each (N, ...)."""
        return {name: value.copy() for name, value in self._observations.items()}

    def close_extras(self, **kwargs: Untyped) -> None:
        """Nothing is held that needs closing."""

    def _begin(self, agents: NDArray[np.int64], seeds: NDArray[np.int64]) -> None:
        changed = [int(agent) for agent in agents if int(agent) in self._next_theta]
        if changed:
            self.slots.set_designs(changed, np.stack([self._next_theta.pop(agent) for agent in changed]))
        self.slots.begin_seeds(agents, seeds)

    def _facts(self) -> JSONObject:
        return {"episode_seed": self.slots.seed.copy(), "_episode_seed": np.ones(self.num_envs, np.bool_)}

    def _final_observations(self, over: NDArray[np.int64]) -> NDArray[np.object_]:
        """One dictionary for each agent whose episode ended, None for the others: Gymnasium's layout."""
        final = np.full(self.num_envs, None, dtype=object)
        for agent in over:
            final[agent] = {name: value[agent].copy() for name, value in self._observations.items()}
        return final

    def _final_measures(self, over: NDArray[np.int64], ended: NDArray[np.bool_]) -> JSONObject:
        final: JSONObject = {}
        for name, value in self.slots.measures(over).items():
            rows = np.zeros(self.num_envs)
            rows[over] = value
            final[name], final[f"_{name}"] = rows, ended
        texts = {"scene_id": self.config.task, "episode_id": None}
        for name, text in texts.items():
            column = np.full(self.num_envs, None, dtype=object)
            column[over] = [str(seed) for seed in self.slots.seed[over]] if text is None else text
            final[name], final[f"_{name}"] = column, ended
        return final


def configure(
    config: ControlConfig | None, settings: JSONObject, owner: type[ControlVectorEnv] | type[ControlEnv]
) -> ControlConfig:
    """A config, or one made of single settings as they come from ``gymnasium.make``.

    Args:
        config: the config, or None.
        settings: single settings instead of it.
        owner: class of the environment; that of a single task takes the task's configs alone.

    Raises:
        ConfigError: both are given, a setting is unknown or wrong, or the config is another task's.
    """
    wanted = owner.config_type
    if config is not None and settings:
        raise ConfigError(f"give either a config or single settings, not both: {', '.join(settings)}")
    if config is None and wanted is ControlConfig:
        raise ConfigError(f"{owner.__name__} plays any task: give it the config of one, such as WalkerWalkConfig()")
    if config is None:
        return from_mapping(wanted, settings, "environment settings")
    if not isinstance(config, wanted):
        raise ConfigError(
            f"the environment is for {wanted.task} and its config for {config.task}; give a {wanted.__name__}, or take "
            "the other environment"
        )
    return config
