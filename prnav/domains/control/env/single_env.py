"""Continuous control as a plain Gymnasium environment: exactly a batch of one."""

from __future__ import annotations

from typing import ClassVar

import gymnasium
import numpy as np

from prnav.aliases import Array, JSONObject, Untyped
from prnav.domains.control.env.config import ControlConfig
from prnav.domains.control.env.seeds import EpisodeSeeds
from prnav.domains.control.env.slots import ControlSlots
from prnav.domains.control.env.spaces import action_space, observation_space
from prnav.domains.control.env.vector_env import configure
from prnav.domains.control.eyes import Mounts

Observation = dict[str, Array]


class ControlEnv(gymnasium.Env):
    """One agent that plays one control task; ``info`` holds an episode's measures when it ends.

    A step is one decision: its action lasts ``config.repeat`` simulation steps, whose rewards are summed. Episodes are
    truncated after 1,000 simulation steps, and terminated only where the simulation diverged.
    """

    metadata = {"render_modes": []}
    config_type: ClassVar[type[ControlConfig]] = ControlConfig
    """Of a task's own class, where it is made without a config."""

    def __init__(
        self,
        config: ControlConfig | None = None,
        mounts: Mounts | None = None,
        **settings: Untyped,
    ):
        """Environment as ``config`` or single settings of :class:`ControlConfig` say.

        Args:
            config: all settings; defaults where None.
            mounts: sensors to take in place of the design that the config names.
            settings: single settings instead of a config, for ``gymnasium.make``.

        Raises:
            PrnavError: a setting is wrong, MuJoCo is missing, or the design does not fit the body.
        """
        self.config = configure(config, settings, type(self))
        self.slots = ControlSlots(self.config, 1, mounts=mounts)
        self.observation_space = observation_space(self.slots.observation_specs)
        self.action_space = action_space(self.slots.action_spec)
        self._order: EpisodeSeeds | None = None

    def reset(self, *, seed: int | None = None, options: JSONObject | None = None) -> tuple[Observation, dict]:
        """Begin the next episode; a seed starts the sequence of episodes anew.

        ``options={"episode": seed}`` begins the episode with this seed instead.
        """
        super().reset(seed=seed)
        if seed is not None or self._order is None:
            first = int(self.np_random.integers(1 << 31)) if seed is None else seed
            self._order = EpisodeSeeds(np.array([first]))
        chosen = (options or {}).get("episode")
        self.slots.begin_seeds([0], self._order.draw(np.array([0])) if chosen is None else [chosen])
        return self._observation(), self._facts()

    def step(self, action: Untyped) -> tuple[Observation, float, bool, bool, JSONObject]:
        """Take one action (D,): observation, reward, terminated, truncated, info."""
        ended = self.slots.advance(np.asarray(action, np.float64)[None])[0]
        info = self._facts()
        if ended:
            info.update(self.slots.outcome(0))
        slots = self.slots
        return self._observation(), float(slots.rewards[0]), bool(slots.terminated[0]), bool(slots.truncated[0]), info

    def _observation(self) -> Observation:
        return {name: value[0] for name, value in self.slots.observe().items()}

    def _facts(self) -> JSONObject:
        return {"episode_seed": int(self.slots.seed[0])}
