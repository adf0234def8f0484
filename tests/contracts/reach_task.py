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

    def __init__(self, config, world, count):
        self.config, self.world, self.num_envs, self.num_slots = config, world, count, count
        self.x, self.mark, self.return_ = np.zeros(count), np.zeros(count), np.zeros(count)
        self.time = np.zeros(count, np.int64)
        self.last = np.zeros((count, 1), np.float32)
        self.episode = np.full(count, -1)

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
        return {
            "success": near.astype(np.float64),
            "steps": self.time.astype(np.float64),
            "reward": self.return_.copy(),
        }


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
        self.episode[slots] = episodes
        self.time[slots], self.return_[slots] = 0, 0.0

    def advance(self, actions, acting):
        return self.move(actions, acting)[1]

    def outcome(self, slot):
        scene, episode = self.episode_ids[self.episode[slot]]
        numbers = {name: float(values[slot]) for name, values in self.measures().items()}
        return {"scene_id": scene, "episode_id": episode, **numbers}

    def state(self, slots):
        return {"x": self.x[slots], "mark": self.mark[slots]}

    def events(self, slots):
        return {"actions": self.last[slots]}


class StraightAgent:
    """Goes straight to the mark."""

    name, actions = "straight", "rule"

    def act(self, turn):
        x, mark = turn.observations["state"].T
        return np.clip(mark - x, -0.5, 0.5)[:, None].astype(np.float32)


class ReachEvaluation:
    """How the task is evaluated."""

    agents = ("straight",)

    def config(self, trained, request):
        if request.data is not None:
            raise ConfigError("reach has no data sets; leave out --data")
        return replace(trained or ReachConfig(), split=request.split or "test")

    def name(self, config):
        return config.split

    def hint(self, config):
        return ""

    def suffix(self, config):
        return ""

    def agent(self, name, config, slots):
        return StraightAgent()

    def header(self, config, world, slots):
        rules = {"length": config.length, "tolerance": config.tolerance}
        return {"task": SPEC.name, "split": config.split, "benchmark": None, "rules": rules}

    def places(self, world, episode):
        return {"begin": float(world[episode, 0]), "mark": float(world[episode, 1])}

    def current_benchmark(self, benchmark):
        return benchmark

    def keep(self, evaluation, traces, world, slots):
        """Traces are all that its pictures need."""

    def recompute(self, row, trace, header):
        misses = np.abs(trace["x"] - trace["mark"])
        near = float(misses[-1] < header["rules"]["tolerance"])
        return {"success": near, "steps": float(len(trace)), "reward": float(-misses[1:].sum())}


class ReachPictures:
    """Where the point was, over time."""

    def episodes(self, evaluation, traces):
        figure = Figure()
        axes = figure.add_subplot()
        for trace in traces[:4]:
            axes.plot(trace["x"] - trace["mark"])
        return figure

    def pairs(self, evaluations, traces, names):
        return None

    def figures(self, evaluation, traces):
        return [(self.episodes(evaluation, traces), "Distance to the mark over time.")]

    def breakdown(self, evaluations, names):
        return None

    def film(self, evaluation, traces):
        return []

    def trace(self, world, episode, trace):
        return np.zeros((4, 4, 3), np.uint8)


class ReachProbe:
    """Prefers designs whose sensors look ahead."""

    def parts(self, design, theta=None):
        yaw = design.sensors[:, 3] if theta is None else np.asarray(theta)[:, 3]
        return {"mark": float(-np.abs(yaw - 0.3).mean())}

    def score(self, design, theta=None):
        return self.weighted(self.parts(design, theta))

    def weighted(self, parts):
        return parts["mark"]


class ReachProbeSpec:
    """The task's state probe."""

    config_type = ReachProbeConfig

    def load(self, config, env, progress=None):
        return ReachProbe()


class ReachTask:
    """The task."""

    name, preset, config_type = "reach", "reach.toml", ReachConfig
    measures, score = ("success", "steps", "reward"), "reward"
    evaluation, pictures, probe = ReachEvaluation(), ReachPictures(), ReachProbeSpec()

    def prepare(self, config, progress=None, limit=None):
        """There is nothing to make."""

    def load(self, config, progress=None, limit=None):
        seed = sum(map(ord, config.split))
        return np.random.default_rng(seed).uniform(-1.0, 1.0, (config.episodes, 2))[:limit]

    def make_envs(self, config, world, num_envs):
        return ReachEnvs(config, world, num_envs)

    def make_slots(self, config, world, num_slots):
        return ReachSlots(config, world, min(num_slots, len(world)))

    def facts(self, config, world):
        return {"episodes": len(world)}

    def notes(self, config, world):
        return []

    def validation(self, config):
        return replace(config, split="val")

    def held_out(self, config, split):
        return replace(config, split=split)

    def blind(self, config):
        return config

    def with_design(self, config, design, grid):
        return config


SPEC = ReachTask()
