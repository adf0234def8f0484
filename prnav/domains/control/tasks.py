"""The six tasks: how an episode starts, what the state is, and what is rewarded, for N simulations at once.

They are those of the DeepMind Control Suite (Tassa et al. 2018 and 2020); draws and formulas follow its definitions, so
that an episode seeded s starts where the suite's own does with ``RandomState(s)``.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.domains.control import models
from prnav.domains.control.engine import mujoco
from prnav.domains.control.facts import TaskFacts, task_facts
from prnav.domains.control.models.finger import CAPS, EASY_TARGET_RADIUS
from prnav.domains.control.models.reacher import FINGERTIP_RADIUS, TARGET_RADIUS
from prnav.domains.control.physics import Physics
from prnav.domains.control.rewards import move_reward, reach_reward, spin_reward, stand_reward, turn_reward
from prnav.errors import ControlError

Float64 = NDArray[np.float64]
MAX_DRAWS = 1000
"""Poses drawn for one start until none of the body's parts touch."""


class Starts(NamedTuple):
    """Where n episodes start; velocities are zero."""

    qpos: Float64
    """Joint positions [m or rad], (n, nq)."""
    target: Float64
    """The target's place in the world [m], (n, 3); zero for tasks without one."""


class Task(Protocol):
    """One task on its body."""

    facts: TaskFacts
    derived: tuple[str, ...]
    """Fields of MjData that states and rewards are read from."""
    expanded: tuple[str, ...]
    """Fields of MjModel that an episode changes."""
    starts_clear: bool
    """Whether an episode starts without contacts."""

    def build(self) -> mujoco.MjModel:
        """The body's model."""
        ...

    def draw(self, random: np.random.RandomState, model: mujoco.MjModel) -> tuple[Float64, Float64]:
        """Joint positions (nq,) and target (3,) of an episode's start."""
        ...

    def set_target(self, physics: Physics, rows: NDArray[np.int64], target: Float64) -> None:
        """Put the targets of simulations ``rows`` (n,) at places (n, 3)."""
        ...

    def target(self, physics: Physics) -> Float64:
        """Places of all targets (N, 3)."""
        ...

    def observe(self, physics: Physics) -> Float64:
        """The suite's observation of all simulations, (N, facts.observation_size)."""
        ...

    def reward(self, physics: Physics) -> Float64:
        """Rewards of all simulations' states, (N,)."""
        ...


def make_task(name: str) -> Task:
    """The task of that name.

    Raises:
        ControlError: there is none.
    """
    facts = task_facts(name)
    if name == "reacher-hard":
        return ReacherHard(facts)
    if facts.body == "walker":
        return Walker(facts, {"walker-stand": 0.0, "walker-walk": WALK_SPEED, "walker-run": RUN_SPEED}[name])
    return FingerSpin(facts) if name == "finger-spin" else FingerTurnEasy(facts)


def draw_joints(random: np.random.RandomState, model: mujoco.MjModel) -> Float64:
    """Random joint positions (nq,): limited joints within their range, free hinges anywhere, free slides at 0."""
    qpos = model.qpos0.copy()
    for joint in range(model.njnt):
        address = model.jnt_qposadr[joint]
        if model.jnt_limited[joint]:
            qpos[address] = random.uniform(*model.jnt_range[joint])
        elif model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
            qpos[address] = random.uniform(-np.pi, np.pi)
    return qpos


def start(task: Task, physics: Physics, rows: NDArray[np.int64], seeds: ArrayLike) -> None:
    """Start episodes with seeds (n,), 0 to 2^32 - 1, in simulations ``rows`` (n,); each depends on its seed alone.

    Raises:
        ControlError: no pose without contact was found.
    """
    randoms = [np.random.RandomState(int(seed)) for seed in np.asarray(seeds).ravel()]
    if not randoms:
        return
    drawn = [task.draw(random, physics.model) for random in randoms]
    task.set_target(physics, rows, np.stack([target for _, target in drawn]))
    physics.place(rows, np.stack([qpos for qpos, _ in drawn]), 0.0)
    waiting = np.arange(len(rows))
    for _ in range(MAX_DRAWS):
        waiting = waiting[physics.contacts[rows[waiting]].ravel() > 0] if task.starts_clear else waiting[:0]
        if not len(waiting):
            break
        again = np.stack([draw_joints(randoms[index], physics.model) for index in waiting])
        physics.place(rows[waiting], again, 0.0)
    else:
        raise ControlError(
            f"{task.facts.name}: {MAX_DRAWS} poses were drawn for a start, and parts touch in all of them"
        )
    physics.forward(rows)


class ReacherHard:
    """Reach for a small ball with the fingertip."""

    derived: tuple[str, ...] = ("geom_xpos",)
    expanded: tuple[str, ...] = ("geom_pos",)
    starts_clear = False
    REACH = TARGET_RADIUS + FINGERTIP_RADIUS
    """Distance of the centres at which fingertip and target touch [m]."""
    RING = (0.05, 0.20)
    """Targets' distances from the shoulder [m]."""

    def __init__(self, facts: TaskFacts) -> None:
        self.facts = facts

    def build(self) -> mujoco.MjModel:
        """The arm, with the paper's green ball inside the target."""
        model = models.reacher_hard()
        self._target, self._inner = model.geom("target").id, model.geom("target_inner").id
        self._finger = model.geom("finger").id
        self._height = float(model.geom_pos[self._target, 2])
        return model

    def draw(self, random: np.random.RandomState, model: mujoco.MjModel) -> tuple[Float64, Float64]:
        """Any pose; a target anywhere on the ring, uniform in angle and distance."""
        qpos = draw_joints(random, model)
        angle = random.uniform(0, 2 * np.pi)
        radius = random.uniform(*self.RING)
        return qpos, np.array([radius * np.sin(angle), radius * np.cos(angle), self._height])

    def set_target(self, physics: Physics, rows: NDArray[np.int64], target: Float64) -> None:
        """Move the ball and the green one inside it."""
        for geom in (self._target, self._inner):
            physics.expanded["geom_pos"][rows, geom] = target

    def target(self, physics: Physics) -> Float64:
        """Places of the balls."""
        return physics.expanded["geom_pos"][:, self._target]

    def observe(self, physics: Physics) -> Float64:
        """Joint positions, the vector from fingertip to target in the plane [m], joint velocities."""
        return np.concatenate([physics.qpos, self._to_target(physics), physics.qvel], axis=1)

    def reward(self, physics: Physics) -> Float64:
        """1 where the fingertip touches the target."""
        x, y = self._to_target(physics).T
        return reach_reward(np.sqrt(x * x + y * y), self.REACH)

    def _to_target(self, physics: Physics) -> Float64:
        places = physics.derived["geom_xpos"]
        return places[:, self._target, :2] - places[:, self._finger, :2]


WALK_SPEED = 1.0
"""Speed from which "walk" gives its full reward [m/s]."""
RUN_SPEED = 8.0
"""Speed from which "run" gives its full reward [m/s]."""


class Walker:
    """Stand, walk or run."""

    derived: tuple[str, ...] = ("xpos", "xmat", "sensordata")
    expanded: tuple[str, ...] = ()
    starts_clear = False

    def __init__(self, facts: TaskFacts, speed: float) -> None:
        self.facts = facts
        self.speed = speed  #: to be reached [m/s]; 0 is to stand

    def build(self) -> mujoco.MjModel:
        """The walker."""
        return models.walker()

    def draw(self, random: np.random.RandomState, model: mujoco.MjModel) -> tuple[Float64, Float64]:
        """Any pose and tilt, at the reference height."""
        return draw_joints(random, model), np.zeros(3)

    def set_target(self, physics: Physics, rows: NDArray[np.int64], target: Float64) -> None:
        """There is none."""

    def target(self, physics: Physics) -> Float64:
        """Zeros."""
        return np.zeros((physics.num, 3))

    def observe(self, physics: Physics) -> Float64:
        """Each body's x axis as its x and z in the world, the torso's height [m], joint velocities."""
        axes = physics.derived["xmat"].reshape(physics.num, -1, 9)[:, 1:, (0, 2)]
        height = physics.derived["xpos"][:, 1, 2:]
        return np.concatenate([axes.reshape(physics.num, -1), height, physics.qvel], axis=1)

    def reward(self, physics: Physics) -> Float64:
        """High and upright, and fast where that is asked."""
        height = physics.derived["xpos"][:, 1, 2]
        upright = physics.derived["xmat"].reshape(physics.num, -1, 9)[:, 1, 8]
        if self.speed == 0.0:
            return stand_reward(height, upright)
        return move_reward(height, upright, physics.derived["sensordata"][:, 0], self.speed)


class _Finger:
    """What both tasks of the finger share; sensors are read at their addresses."""

    derived: tuple[str, ...] = ("sensordata",)
    starts_clear = True

    def __init__(self, facts: TaskFacts) -> None:
        self.facts = facts

    def _address(self, model: mujoco.MjModel) -> mujoco.MjModel:
        self._at = {model.sensor(index).name: int(model.sensor_adr[index]) for index in range(model.nsensor)}
        return model

    def _in_plane(self, physics: Physics, name: str) -> Float64:
        """Place of a sensor's object from the spinner's hub, x and z [m], (N, 2)."""
        data, at, hub = physics.derived["sensordata"], self._at[name], self._at["spinner"]
        return data[:, (at, at + 2)] - data[:, (hub, hub + 2)]

    def _state(self, physics: Physics) -> list[Float64]:
        data, at = physics.derived["sensordata"], self._at
        return [
            data[:, (at["proximal"], at["distal"])],
            self._in_plane(physics, "tip"),
            data[:, (at["proximal_velocity"], at["distal_velocity"], at["hinge_velocity"])],
            np.log1p(data[:, (at["touchtop"], at["touchbottom"])]),
        ]


class FingerSpin(_Finger):
    """Spin the spinner."""

    expanded: tuple[str, ...] = ()

    def build(self) -> mujoco.MjModel:
        """The finger, with a spinner that turns easily."""
        return self._address(models.finger_spin())

    def draw(self, random: np.random.RandomState, model: mujoco.MjModel) -> tuple[Float64, Float64]:
        """A pose."""
        return draw_joints(random, model), model.site("target").pos.copy()

    def set_target(self, physics: Physics, rows: NDArray[np.int64], target: Float64) -> None:
        """There is one, but it stays where it is and is not drawn."""

    def target(self, physics: Physics) -> Float64:
        """Where the target that is not drawn stays."""
        return np.tile(physics.model.site("target").pos, (physics.num, 1))

    def observe(self, physics: Physics) -> Float64:
        """Joint positions, the spinner's tip from its hub (x, z) [m], joint velocities, log(1 + touch)."""
        return np.concatenate(self._state(physics), axis=1)

    def reward(self, physics: Physics) -> Float64:
        """1 where the spinner turns fast enough."""
        return spin_reward(physics.derived["sensordata"][:, self._at["hinge_velocity"]])


class FingerTurnEasy(_Finger):
    """Turn the spinner's tip into a target."""

    expanded: tuple[str, ...] = ("site_pos",)

    def build(self) -> mujoco.MjModel:
        """The finger, with the large target."""
        model = self._address(models.finger_turn_easy())
        self._target = model.site("target").id
        self._hub = model.body("spinner").pos.copy()
        return model

    def draw(self, random: np.random.RandomState, model: mujoco.MjModel) -> tuple[Float64, Float64]:
        """A target anywhere on the circle of the spinner's tip, then a pose."""
        angle = random.uniform(-np.pi, np.pi)
        radius = CAPS[0] + CAPS[1]
        target = self._hub + radius * np.array([np.sin(angle), 0.0, np.cos(angle)])
        return draw_joints(random, model), target

    def set_target(self, physics: Physics, rows: NDArray[np.int64], target: Float64) -> None:
        """Move the target."""
        physics.expanded["site_pos"][rows, self._target] = target

    def target(self, physics: Physics) -> Float64:
        """Places of the targets."""
        return physics.expanded["site_pos"][:, self._target]

    def observe(self, physics: Physics) -> Float64:
        """As in "spin", then the target from the hub (x, z) [m] and the tip's distance from its surface [m]."""
        target = self._in_plane(physics, "target")
        return np.concatenate([*self._state(physics), target, self._distance(physics)[:, None]], axis=1)

    def reward(self, physics: Physics) -> Float64:
        """1 where the tip is within the target."""
        return turn_reward(self._distance(physics))

    def _distance(self, physics: Physics) -> Float64:
        x, z = (self._in_plane(physics, "target") - self._in_plane(physics, "tip")).T
        return np.sqrt(x * x + z * z) - EASY_TARGET_RADIUS
