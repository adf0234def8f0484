"""Navigation as plain Gymnasium environments: exactly a batch of one."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
from prnav.domains.navigation.env.order import EpisodeOrder
from prnav.domains.navigation.env.slots import NavigationSlots
from prnav.domains.navigation.env.spaces import observation_space
from prnav.domains.navigation.env.vector_env import configure

Observation = dict[str, NDArray[np.float32]]


class NavigationEnv(gymnasium.Env):
    """One agent, playing the task that its config names; ``info`` holds an episode's measures when it ends."""

    metadata = {"render_modes": []}
    config_type: ClassVar[type[NavigationConfig]] = NavigationConfig
    """Of a task's own class, where it is made without a config."""

    def __init__(self, config: NavigationConfig | None = None, source: EpisodeSource | None = None, **settings: Any):
        """Environment as ``config`` or single settings of :class:`NavigationConfig` say, over ``source`` if given.

        Raises:
            PrnavError: a setting, a scene or an episode is wrong.
        """
        self.config = configure(config, settings, type(self))
        self.slots = NavigationSlots(load_source(self.config) if source is None else source, 1, self.config)
        self.observation_space = observation_space(self.config, self.slots.num_sensors)
        self.action_space = gymnasium.spaces.Discrete(self.slots.action_spec.n)
        self._order: EpisodeOrder | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Begin the next episode; a seed starts the order of episodes anew."""
        super().reset(seed=seed)
        if seed is not None or self._order is None:
            first = int(self.np_random.integers(1 << 31)) if seed is None else seed
            self._order = EpisodeOrder(len(self.slots.source), np.array([first]))
        chosen = (options or {}).get("episode")
        episode = self._order.draw(np.array([0])) if chosen is None else np.array([chosen])
        self.slots.begin([0], episode)
        return self._observation(), self._facts()

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take one action: observation, reward, terminated, truncated, info."""
        if not self.action_space.contains(action):
            raise ValueError(f"action is {action!r}; it must be an integer from 0 to {self.slots.action_spec.n - 1}")
        ended = self.slots.advance([int(action)])[0]
        info = self._facts()
        if ended:
            info.update(self.slots.outcome(0))
        slots = self.slots
        return self._observation(), float(slots.rewards[0]), bool(slots.terminated[0]), bool(slots.truncated[0]), info

    def expert_action(self) -> int:
        """What the shortest-path follower would do now, as this environment numbers actions."""
        return int(self.slots.expert_actions()[0])

    def _observation(self) -> Observation:
        return {name: value[0] for name, value in self.slots.observe().items()}

    def _facts(self) -> dict[str, Any]:
        scene_id, episode_id = self.slots.source.id(self.slots.episode[0])
        return {"scene_id": scene_id, "episode_id": episode_id, "distance_to_goal": float(self.slots.distance[0])}
