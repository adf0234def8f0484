"""A task of a domain of its own: a point on a line is pushed towards a mark. Everything a task brings, in one module.

It knows contracts alone, has continuous actions and no sensors that could be drawn; its state probe prefers designs
that look ahead.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from prnav.contracts import BoxActions, ObservationSpec
from prnav.errors import ConfigError

SPECS = {"state": ObservationSpec((2,), "vector")}
ACTIONS = BoxActions((-0.5,), (0.5,))


@dataclass(frozen=True)
class ReachConfig:
    """Settings of the task."""

    episodes: int = 12
    length: int = 6
    """Steps of an episode."""
    tolerance: float = 0.1
    split: str = "train"


@dataclass(frozen=True)
class ReachProbeConfig:
    """Settings of the state probe."""

    cost_steps: int = 1


class Line:
    """N points on a line, and their marks."""

    num_slots: int

    def __init__(self, config, world, count):
        self.config, self.world, self.num_envs, self.num_slots = config, world, count, count
        self.x, self.mark, self.return_ = np.zeros(count), np.zeros(count), np.zeros(count)
        self.time = np.zeros(count, np.int64)
        self.last = np.zeros((count, 1), np.float32)

    observation_specs = SPECS
    action_spec = ACTIONS

    def observe(self, slots):
        return {"state": np.stack([self.x, self.mark], axis=-1).astype(np.float32)[slots]}

    def move(self, actions, acting):
        """Push the points where ``acting``; rewards (N,) and where the episode ended with it (N,)."""
        self.last = np.where(acting[:, None], actions, self.last).astype(np.float32)
        self.x = np.clip(self.x + np.where(acting, np.clip(self.last[:, 0], -0.5, 0.5), 0.0), -2.0, 2.0)
        rewards = np.where(acting, -np.abs(self.x - self.mark), 0.0)
        self.return_ += rewards
        self.time += acting
        return rewards, acting & (self.time >= self.config.length)

    def measures(self):
        near = np.abs(self.x - self.mark) < self.config.tolerance
        return {"success": near.astype(np.float64), "steps": self.time.astype(np.float64), "reward": self.return_.copy()}


class ReachEnvs(Line):
    """Batched environments that restart in the step that ends an episode."""

    def reset(self, *, seed=None, options=None):
        self.generator = np.random.Generator(np.random.PCG64(seed))
        self._start(np.arange(self.num_envs))
        return self.observe(slice(None)), {}

    def step(self, actions):
        rewards, over = self.move(actions, np.ones(self.num_envs, bool))
        info = {}
        if over.any():
            info = {"final_obs": self.observe(slice(None)), "final_info": self.measures()}
            self._start(np.flatnonzero(over))
        return self.observe(slice(None)), rewards, np.zeros(self.num_envs, bool), over, info

    def _start(self, agents):
        self.x[agents], self.mark[agents] = self.generator.uniform(-1.0, 1.0, (2, len(agents)))
        self.time[agents], self.return_[agents] = 0, 0.0

    def snapshot(self):
        arrays = {name: getattr(self, name).copy() for name in ("x", "mark", "time", "return_", "last")}
        return {**arrays, "generator": self.generator.bit_generator.state}

    def restore(self, state):
        for name in ("x", "mark", "time", "return_", "last"):
            setattr(self, name, np.array(state[name]))
        self.generator.bit_generator.state = state["generator"]


class ReachSlots(Line):
    """Slots that are handed the world's episodes."""

    @property
    def episode_ids(self):
        return [("line", str(index)) for index in range(len(self.world))]

    def begin(self, slots, episodes):
        self.x[slots], self.mark[slots] = self.world[episodes].T
        self.time[slots], self.return_[slots] = 0, 0.0

    def advance(self, actions, acting):
        return self.move(actions, acting)[1]

    def outcome(self, slot):
        numbers = {name: float(values[slot]) for name, values in self.measures().items()}
        scene, episode = "line", str(int(np.flatnonzero((self.world[:, 1] == self.mark[slot])))) if False else ""
        return {"scene_id": scene, "episode_id": episode, **numbers}

    def state(self, slots):
        return {"x": self.x[slots], "mark": self.mark[slots]}

    def events(self, slots):
        return {"actions": self.last[slots]}
