"""Navigation as plain Gymnasium environments: exactly a batch of one."""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from prnav.domains.navigation.env.config import EnvConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
from prnav.domains.navigation.env.order import EpisodeOrder
from prnav.domains.navigation.env.slots import NavigationSlots
from prnav.domains.navigation.env.spaces import num_actions, observation_space
from prnav.domains.navigation.env.vector_env import configure, task_actions

Observation = dict[str, NDArray[np.float32]]


class NavigationEnv(gymnasium.Env):
    """One agent, playing the task that its config names; ``info`` holds an episode's measures when it ends."""

    metadata = {"render_modes": []}
    task: ClassVar[str | None] = None
    """The only task that a class plays; None takes the config's."""

    def __init__(self, config: EnvConfig | None = None, source: EpisodeSource | None = None, **settings: Any):
        """Environment as ``config`` or single settings of :class:`EnvConfig` say, over ``source`` if given.

        Raises:
            PrnavError: a setting, a scene or an episode is wrong.
        """
        self.config = configure(config, settings, self.task)
        self.slots = NavigationSlots(load_source(self.config) if source is None else source, 1, self.config)
        self.observation_space = observation_space(self.config, self.slots.num_sensors)
        self.action_space = gymnasium.spaces.Discrete(num_actions(self.config))
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
            raise ValueError(f"action is {action!r}; it must be an integer from 0 to {num_actions(self.config) - 1}")
        ended = self.slots.advance([int(action) + self.slots.first_action])[0]
        info = self._facts()
        if ended:
            info.update(self.slots.outcome(0))
        slots = self.slots
        return self._observation(), float(slots.rewards[0]), bool(slots.terminated[0]), bool(slots.truncated[0]), info

    def expert_action(self) -> int:
        """What the shortest-path follower would do now, as this environment numbers actions."""
        return int(task_actions(self.slots.expert_actions(), self.slots.first_action)[0])

    def _observation(self) -> Observation:
        return {name: value[0] for name, value in self.slots.observe().items()}

    def _facts(self) -> dict[str, Any]:
        scene_id, episode_id = self.slots.source.id(self.slots.episode[0])
        return {"scene_id": scene_id, "episode_id": episode_id, "distance_to_goal": float(self.slots.distance[0])}


class PointGoalNavEnv(NavigationEnv):
    """One PointGoalNav agent (paper, appendix "PointGoal Navigation Setting").

    Actions are 0 stop, 1 forward 0.25 m, 2 left and 3 right by 30 degrees. An episode is terminated by stop and
    truncated after 500 steps.
    """

    task = "pointgoal"


class TargetNavEnv(NavigationEnv):
    """One TargetNav agent (paper, appendix "Target Navigation Setting").

    Actions are 0 forward 0.25 m, 1 left and 2 right by 30 degrees; there is no stop, and no goal among the
    observations. An episode is terminated where the agent is within 0.8 m of the green sphere, and truncated after
    1,500 steps.
    """

    task = "targetnav"
