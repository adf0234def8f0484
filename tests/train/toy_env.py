"""A task that needs memory: a cue is shown at the first step only, and the last action must answer it.

It has the vector interface of the navigation environments: same-step resets, ``final_obs`` and ``final_info``, an
oracle, and a state that can be saved.
"""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from prnav.contracts import DiscreteActions, ObservationSpec

CUES = 3


class CueEnv(VectorEnv):
    """N agents; an episode lasts ``length`` steps and ends by itself, or by a time limit where ``cut``."""

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(self, num_envs: int = 8, length: int = 3, cut: bool = False) -> None:
        self.num_envs, self.length, self.cut = num_envs, length, cut
        self.action_spec = DiscreteActions(CUES)
        self.observation_specs = {
            "photoreceptors": ObservationSpec((1, 1, 3), "receptors"),
            "design": ObservationSpec((1, 7), "design"),
            "clock": ObservationSpec((1,), "vector"),
        }
        self.single_observation_space = gymnasium.spaces.Dict(
            {
                "photoreceptors": gymnasium.spaces.Box(0, 1, (1, 1, 3), np.float32),
                "design": gymnasium.spaces.Box(-1, 1, (1, 7), np.float32),
                "clock": gymnasium.spaces.Box(0, np.inf, (1,), np.float32),
            }
        )
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.single_action_space = gymnasium.spaces.Discrete(CUES)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed=None, options=None):
        self.generator = np.random.Generator(np.random.PCG64(seed))
        self.cue = self.generator.integers(0, CUES, self.num_envs)
        self.time = self.generator.integers(0, self.length, self.num_envs)  # so that episodes end at different steps
        self.right = np.zeros(self.num_envs)
        return self._observe(), {}

    def step(self, actions):
        assert actions.shape == (self.num_envs,) and actions.dtype == np.int64
        last = self.time == self.length - 1
        rewards = np.where(last, (actions == self.cue).astype(np.float64), 0.0)
        self.time = self.time + 1
        info = {}
        if last.any():
            before = self._observe()
            info["final_obs"] = before
            info["final_info"] = {"success": rewards, "reward": rewards, "scene_id": np.array(["toy"] * self.num_envs)}
        self.cue = np.where(last, self.generator.integers(0, CUES, self.num_envs), self.cue)
        self.time[last] = 0
        ended = last.copy()
        nothing = np.zeros_like(last)
        return self._observe(), rewards, nothing if self.cut else ended, ended if self.cut else nothing, info

    def expert_actions(self):
        return self.cue.astype(np.int64)

    def snapshot(self):
        state = self.generator.bit_generator.state
        return {"cue": self.cue.copy(), "time": self.time.copy(), "generator": state}

    def restore(self, state):
        self.cue, self.time = state["cue"].copy(), state["time"].copy()
        self.generator.bit_generator.state = state["generator"]

    def _observe(self):
        readings = np.zeros((self.num_envs, 1, 1, 3), np.float32)
        shown = self.time == 0
        readings[shown, 0, 0, self.cue[shown]] = 1.0
        return {
            "photoreceptors": readings,
            "design": np.zeros((self.num_envs, 1, 7), np.float32),
            "clock": self.time[:, None].astype(np.float32),
        }


class CueSlots:
    """The same task as a list of episodes, one for each slot, whose cues are drawn from a seed."""

    def __init__(self, num_slots: int, length: int = 3) -> None:
        self.envs = CueEnv(num_slots, length)
        self.num_slots = num_slots
        self.observation_specs, self.action_spec = self.envs.observation_specs, self.envs.action_spec
        self.episode_ids = [("toy", str(index)) for index in range(num_slots)]
        self.cues = np.random.default_rng(5).integers(0, CUES, num_slots)
        self.envs.reset(seed=0)

    def begin(self, slots, episodes):
        self.envs.time[slots] = 0
        self.envs.cue[slots] = self.cues[episodes]
        self.envs.right[slots] = 0.0

    def observe(self, slots):
        return {name: value[slots] for name, value in self.envs._observe().items()}

    def advance(self, actions, acting):
        last = acting & (self.envs.time == self.envs.length - 1)
        self.envs.right = np.where(last, actions == self.envs.cue, self.envs.right)
        self.envs.time = self.envs.time + acting
        return last

    def outcome(self, slot):
        return {"scene_id": "toy", "episode_id": str(slot), "success": float(self.envs.right[slot])}

    def state(self, slots):
        return {"time": self.envs.time[slots]}

    def events(self, slots):
        return {"actions": np.zeros(len(slots), np.int64)}
