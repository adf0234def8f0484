"""Navigation as a native Gymnasium vector environment: N agents in one call, restarted in the same step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array, JSONObject, Progress, Untyped
from prnav.arguments import indices, whole
from prnav.config import from_mapping
from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
from prnav.domains.navigation.env.order import EpisodeOrder
from prnav.domains.navigation.env.screen import FPS, RENDER_MODES, RenderScreen, check_render_mode
from prnav.domains.navigation.env.slots import NavigationSlots, Observations
from prnav.domains.navigation.env.spaces import observation_space
from prnav.errors import ConfigError, DesignError, EnvError

if TYPE_CHECKING:
    from prnav.domains.navigation.env.single_env import NavigationEnv


MAX_SEED = 2**62
"""Largest seed of an environment; those of its agents are counted up from it."""


class NavigationVectorEnv(VectorEnv):
    """N agents over one simulator, playing the task that their config names.

    An episode that ends is followed by the next one in the same step (Gymnasium's ``SAME_STEP``): the returned
    observation is the new episode's first, ``info["final_obs"]`` holds the old one's last (a dictionary per agent, None
    where no episode ended) and ``info["final_info"]`` its measures, each with the mask of the agents concerned under
    the same name with ``_`` in front.

    Agent i, seeded s, plays the same episodes as a single environment seeded s + i.
    """

    metadata = {"render_modes": [*RENDER_MODES], "render_fps": FPS, "autoreset_mode": AutoresetMode.SAME_STEP}
    config_type: ClassVar[type[NavigationConfig]] = NavigationConfig
    """Of a task's own class, where it is made without a config."""

    def __init__(
        self,
        num_envs: int = 1,
        config: NavigationConfig | None = None,
        source: EpisodeSource | None = None,
        progress: Progress | None = None,
        render_mode: str | None = None,
        **settings: Untyped,
    ):
        """Environment of ``num_envs`` agents.

        Args:
            num_envs: N.
            config: all settings; defaults where None.
            source: scenes and episodes loaded before, shared between environments; else they are loaded as the config
                says.
            progress: called while scenes load.
            render_mode: "rgb_array" for :meth:`render`, or None.
            settings: single settings of :class:`NavigationConfig` instead of a config, for ``gymnasium.make``.

        Raises:
            PrnavError: a setting, a scene or an episode is wrong.
        """
        self.config = configure(config, settings, type(self))
        num_envs = whole(num_envs, "num_envs", 1, 65_536, ConfigError, "each is an agent with its own state")
        self.render_mode = check_render_mode(render_mode)
        source = load_source(self.config, progress) if source is None else source
        self.slots = NavigationSlots(source, num_envs, self.config)
        self.num_envs = num_envs
        self.observation_specs, self.action_spec = self.slots.observation_specs, self.slots.action_spec
        self.single_observation_space = observation_space(self.slots.sensors)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = gymnasium.spaces.Discrete(self.slots.action_spec.n)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.order = EpisodeOrder(len(source), np.zeros(num_envs, np.int64))
        self._next_theta: dict[int, NDArray[np.float64]] = {}
        self._observations: Observations = {}
        self.on_device = self.slots.light is not None and self.slots.light.is_on_gpu
        """Whether readings stay on the renderer's device as tensors, for a policy that is there too."""
        self._screen = RenderScreen(self.slots) if render_mode is not None else None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: JSONObject | None = None
    ) -> tuple[Observations, JSONObject]:
        """Begin a new episode in every agent, from new seeds if given (one, or one per agent).

        Without a seed the order of episodes goes on; the first reset without one draws seeds at random.
        ``options={"episodes": indices}`` begins these rows of the source instead.
        """
        if self.closed:
            raise ClosedEnvironmentError("the environment is closed; make another one")
        seeds = self._seeds(seed)
        if seeds is not None:
            self.order = EpisodeOrder(len(self.slots.source), seeds)
        everyone = np.arange(self.num_envs)
        chosen = option_of(options, "episodes")
        if chosen is not None:
            chosen = indices(chosen, 'options["episodes"]', len(self.slots.source), EnvError, self.num_envs)
        episodes = self.order.draw(everyone) if chosen is None else chosen
        self._begin(everyone, episodes)
        self._observations = self._observe()
        return self._copy(), self._facts()

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], JSONObject]:
        """One action per agent (N,): observations, rewards (N,), terminated (N,), truncated (N,), info.

        Raises:
            EnvError: the actions are not whole numbers of this task, one per agent.
            ResetNeeded: nothing has begun.
            ClosedEnvironmentError: the environment is closed.
        """
        if self.closed:
            raise ClosedEnvironmentError("the environment is closed; make another one")
        if not self._observations:
            raise ResetNeeded("the environment has not begun; call reset() before step()")
        actions = indices(actions, "actions", self.slots.action_spec.n, EnvError, self.num_envs)
        ended = self.slots.advance(actions)
        if self._screen is not None:
            self._screen.go()
        rewards, terminated, truncated = (
            self.slots.rewards.copy(),
            self.slots.terminated.copy(),
            self.slots.truncated.copy(),
        )
        self._observations = self._observe()
        info: JSONObject = {}
        if ended.any():
            over = np.flatnonzero(ended)
            info["final_obs"] = self._final_observations(over)
            info["_final_obs"] = ended
            info["final_info"] = self._final_measures(over, ended)
            info["_final_info"] = ended
            self._begin(over, self.order.draw(over))
            for name, value in self._observe(over).items():
                self._observations[name][over] = value
        return self._copy(), rewards, terminated, truncated, {**self._facts(), **info}

    def expert_actions(self) -> NDArray[np.int64]:
        """What the shortest-path follower would do now, (N,), as this environment numbers actions."""
        return self.slots.expert_actions()

    def set_designs(self, agents: ArrayLike, theta: ArrayLike) -> None:
        """Give agents (n,) normalised designs (n, K, 7) from their next episodes on.

        Raises:
            DesignError: there is no such agent, the shape is wrong, or a number is not finite or beyond reason.
        """
        agents = indices(agents, "agents", self.num_envs, DesignError)
        values = self.slots.checked_theta(len(agents), theta)
        for row, agent in enumerate(agents):
            self._next_theta[int(agent)] = values[row].copy()

    def snapshot(self) -> dict[str, Array]:
        """All arrays that :meth:`restore` needs to resume exactly here."""
        state = {**self.slots.snapshot(), "order_seeds": self.order.seeds, "order_drawn": self.order.drawn}
        waiting = sorted(self._next_theta)
        state["next_theta_agents"] = np.array(waiting, np.int64)
        shape = (len(waiting), self.slots.num_sensors, 7)
        state["next_theta"] = np.array([self._next_theta[agent] for agent in waiting], np.float64).reshape(shape)
        return {name: value.copy() for name, value in state.items()}

    def restore(self, state: dict[str, Array]) -> None:
        """Resume where :meth:`snapshot` was called; scenes, episodes and config must be the same."""
        self.slots.restore(state)
        self.order = EpisodeOrder(len(self.slots.source), state["order_seeds"])
        self.order.drawn[:] = state["order_drawn"]
        agents = state["next_theta_agents"]
        self._next_theta = {int(agent): theta for agent, theta in zip(agents, state["next_theta"], strict=True)}
        if self._screen is not None:  # the way up to here is not known
            self._screen.begin(np.arange(self.num_envs))
        self._observations = self._observe()

    def observations(self) -> Observations:
        """The observations that the last reset, step or :meth:`restore` left, each (N, ...)."""
        return self._copy()

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """With ``render_mode="rgb_array"`` a picture (H, W, 3) of each agent: its way on the map, and what it sees.

        Where an episode has just ended, it is the next one's first.
        """
        if self._screen is None:
            return None
        return tuple(
            self._screen.picture(agent, {name: value[agent] for name, value in self._observations.items()})
            for agent in range(self.num_envs)
        )

    def close_extras(self, **kwargs: Untyped) -> None:
        """Nothing is held that needs closing."""

    def _begin(self, agents: NDArray[np.int64], episodes: NDArray[np.int64]) -> None:
        for agent in agents:
            if int(agent) in self._next_theta:
                self.slots.set_designs([agent], self._next_theta.pop(int(agent))[None])
        self.slots.begin(agents, episodes)
        if self._screen is not None:
            self._screen.begin(agents)

    def _observe(self, agents: NDArray[np.int64] | None = None) -> Observations:
        return self.slots.observe(agents, self.on_device)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> NDArray[np.int64] | None:
        if seed is None:
            if self.order.drawn.any():
                return None
            seed = int(np.random.SeedSequence().generate_state(1)[0])
        if isinstance(seed, int | np.integer | float | str):
            return whole(seed, "seed", 0, MAX_SEED, EnvError) + np.arange(self.num_envs)
        if len(seed) != self.num_envs:
            raise EnvError(f"seed holds {len(seed)} numbers; it must be one whole number, or {self.num_envs} of them")
        return np.array([whole(value, "seed", 0, MAX_SEED, EnvError) for value in seed], np.int64)

    def _copy(self) -> Observations:
        return {name: copied(value) for name, value in self._observations.items()}

    def _facts(self) -> JSONObject:
        everyone = np.ones(self.num_envs, np.bool_)
        scenes, episodes = self.slots.source.names(self.slots.episode)
        return {
            "scene_id": scenes,
            "_scene_id": everyone,
            "episode_id": episodes,
            "_episode_id": everyone,
            "distance_to_goal": self.slots.distance.copy(),
            "_distance_to_goal": everyone,
        }

    def _final_observations(self, over: NDArray[np.int64]) -> NDArray[np.object_]:
        """One dictionary for each agent whose episode ended, None for the others: Gymnasium's layout."""
        final = np.full(self.num_envs, None, dtype=object)
        for agent in over:
            final[agent] = {name: copied(value[agent]) for name, value in self._observations.items()}
        return final

    def _final_measures(self, over: NDArray[np.int64], ended: NDArray[np.bool_]) -> JSONObject:
        final: JSONObject = {}
        for name, value in self.slots.measures(over).items():
            rows = np.zeros(self.num_envs)
            rows[over] = value
            final[name], final[f"_{name}"] = rows, ended
        for name, values in zip(
            ("scene_id", "episode_id"), self.slots.source.names(self.slots.episode[over]), strict=True
        ):
            texts = np.full(self.num_envs, None, dtype=object)
            texts[over] = values
            final[name], final[f"_{name}"] = texts, ended
        return final


def option_of(options: JSONObject | None, name: str) -> Untyped:
    """The only option that a reset knows, None where it is not given.

    Raises:
        EnvError: there are others.
    """
    others = sorted(set(options or {}) - {name})
    if others:
        raise EnvError(f"reset knows no option {others[0]!r}; valid: {name!r}")
    return (options or {}).get(name)


def copied(values: Untyped) -> Untyped:
    """A copy of an array, or of a tensor where it lies."""
    return values.copy() if isinstance(values, np.ndarray) else values.clone()


def configure(
    config: NavigationConfig | None, settings: JSONObject, owner: type[NavigationVectorEnv] | type[NavigationEnv]
) -> NavigationConfig:
    """A config, or one made of single settings as they come from ``gymnasium.make``.

    Args:
        config: the config, or None.
        settings: single settings instead of it.
        owner: class of the environment; that of a single task takes the task's configs alone.

    Raises:
        ConfigError: both are given, a setting is unknown or wrong, or the config is another task's.
    """
    wanted = owner.config_type
    if config is None:
        return from_mapping(wanted, settings, "environment settings")
    if settings:
        raise ConfigError(f"give either a config or single settings, not both: {', '.join(settings)}")
    if not isinstance(config, wanted):
        raise ConfigError(
            f"the environment is for {wanted.kind.name} and its config for {config.kind.name}; give a "
            f"{wanted.__name__}, or take the other environment"
        )
    return config
