"""Navigation as plain Gymnasium environments: exactly a batch of one."""

from __future__ import annotations

from typing import ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from numpy.typing import NDArray

from prnav.aliases import JSONObject, Untyped
from prnav.arguments import indices, whole
from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
from prnav.domains.navigation.env.order import EpisodeOrder
from prnav.domains.navigation.env.screen import FPS, RENDER_MODES, RenderScreen, check_render_mode
from prnav.domains.navigation.env.slots import NavigationSlots
from prnav.domains.navigation.env.spaces import observation_space
from prnav.domains.navigation.env.vector_env import MAX_SEED, configure, option_of
from prnav.errors import EnvError

Observation = dict[str, NDArray[np.float32]]


class NavigationEnv(gymnasium.Env):
    """One agent, playing the task that its config names; ``info`` holds an episode's measures when it ends."""

    metadata = {"render_modes": [*RENDER_MODES], "render_fps": FPS}
    config_type: ClassVar[type[NavigationConfig]] = NavigationConfig
    """Of a task's own class, where it is made without a config."""

    def __init__(
        self,
        config: NavigationConfig | None = None,
        source: EpisodeSource | None = None,
        render_mode: str | None = None,
        **settings: Untyped,
    ):
        """Environment as ``config`` or single settings of :class:`NavigationConfig` say, over ``source`` if given.

        Args:
            config: all settings.
            source: scenes and episodes loaded before.
            render_mode: "rgb_array" for :meth:`render`, or None.
            settings: single settings instead of a config, for ``gymnasium.make``.

        Raises:
            PrnavError: a setting, a scene or an episode is wrong.
        """
        self.config = configure(config, settings, type(self))
        self.render_mode = check_render_mode(render_mode)
        self.slots = NavigationSlots(load_source(self.config) if source is None else source, 1, self.config)
        self.observation_space = observation_space(self.slots.sensors)
        self.action_space = gymnasium.spaces.Discrete(self.slots.action_spec.n)
        self._order: EpisodeOrder | None = None
        self._playing = self._closed = False
        self._seen: Observation = {}
        self._screen = RenderScreen(self.slots) if render_mode is not None else None

    def close(self) -> None:
        """Play no more; there is nothing else to let go of."""
        self._closed = True

    def reset(self, *, seed: int | None = None, options: JSONObject | None = None) -> tuple[Observation, dict]:
        """Begin the next episode; a seed starts the order of episodes anew."""
        if self._closed:
            raise ClosedEnvironmentError("the environment is closed; make another one")
        if seed is not None:
            seed = whole(seed, "seed", 0, MAX_SEED, EnvError)
        super().reset(seed=seed)
        if seed is not None or self._order is None:
            first = int(self.np_random.integers(1 << 31)) if seed is None else seed
            self._order = EpisodeOrder(len(self.slots.source), np.array([first]))
        chosen = option_of(options, "episode")
        if chosen is not None:
            chosen = indices(chosen, 'options["episode"]', len(self.slots.source), EnvError, 1)
        episode = self._order.draw(np.array([0])) if chosen is None else chosen
        self.slots.begin([0], episode)
        self._playing = True
        if self._screen is not None:
            self._screen.begin(np.array([0]))
        return self._observation(), self._facts()

    def step(self, action: Untyped) -> tuple[Observation, float, bool, bool, JSONObject]:
        """Take one action: observation, reward, terminated, truncated, info.

        Raises:
            EnvError: the action is not a whole number of this task.
            ResetNeeded: no episode has begun, or it has ended.
            ClosedEnvironmentError: the environment is closed.
        """
        if self._closed:
            raise ClosedEnvironmentError("the environment is closed; make another one")
        if not self._playing:
            raise ResetNeeded("no episode is being played; call reset() before step()")
        if not self.action_space.contains(action):
            raise EnvError(f"action is {action!r}; it must be an integer from 0 to {self.slots.action_spec.n - 1}")
        ended = self.slots.advance([int(action)])[0]
        self._playing = not ended
        if self._screen is not None:
            self._screen.go()
        info = self._facts()
        if ended:
            info.update(self.slots.outcome(0))
        slots = self.slots
        return self._observation(), float(slots.rewards[0]), bool(slots.terminated[0]), bool(slots.truncated[0]), info

    def render(self) -> NDArray[np.uint8] | None:
        """With ``render_mode="rgb_array"`` a picture (H, W, 3): the agent's way on the map, and what it sees."""
        return None if self._screen is None else self._screen.picture(0, self._seen)

    def expert_action(self) -> int:
        """What the shortest-path follower would do now, as this environment numbers actions."""
        return int(self.slots.expert_actions()[0])

    def _observation(self) -> Observation:
        self._seen = {name: value[0] for name, value in self.slots.observe().items()}
        return dict(self._seen)

    def _facts(self) -> JSONObject:
        scene_id, episode_id = self.slots.source.id(self.slots.episode[0])
        return {"scene_id": scene_id, "episode_id": episode_id, "distance_to_goal": float(self.slots.distance[0])}
