"""``prnav.ControlTask``: one task's physics, states, rewards and light, as functions of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.domains.control.facts import LARGEST, task_facts
from prnav.domains.control.frames import rotation, to_world
from prnav.errors import ControlError

if TYPE_CHECKING:
    import mujoco

    from prnav.domains.control.caster import Caster
    from prnav.domains.control.physics import Physics
    from prnav.domains.control.tasks import Starts

Float64 = NDArray[np.float64]


class PhysicsRollout(NamedTuple):
    """What B simulations did in T simulation steps; from where one diverged, its rows are nan."""

    qpos: Float64
    """Joint positions after each step [m or rad], (B, T, nq)."""
    qvel: Float64
    """Joint velocities after each step [m/s or rad/s], (B, T, nv)."""
    reward: Float64
    """Reward of each step, (B, T)."""
    obs: Float64
    """The suite's observation after each step, (B, T, n)."""


class ControlTask:
    """One of the six tasks.

    Arrays have states or simulations on the first axis: joint positions (B, nq) [m or rad], velocities (B, nv), and
    targets (B, 3), the place of the target in the world [m]. Tasks without a target leave it out of account; None
    leaves it where the model has it.
    """

    def __init__(self, name: str, threads: int = 1):
        """Task ``name``, for example "walker-walk".

        Args:
            name: of the task.
            threads: that step simulations and cast rays; results are the same whatever their number.

        Raises:
            ControlError: the task is unknown, or MuJoCo is missing or too old.
        """
        self.facts = task_facts(name)
        from prnav.domains.control.tasks import make_task

        self.threads = threads
        self._task = make_task(name)
        self.model: mujoco.MjModel = self._task.build()
        self._physics: Physics | None = None
        self._caster: tuple[int, Caster] | None = None

    @property
    def name(self) -> str:
        """As it is typed."""
        return self.facts.name

    def starts(self, seeds: ArrayLike) -> Starts:
        """Where the episodes with seeds (n,), 0 to 2^32 - 1, start."""
        from prnav.domains.control.tasks import Starts, start

        seeds = np.atleast_1d(np.asarray(seeds))
        physics = self._simulations(len(seeds))
        start(self._task, physics, np.arange(len(seeds)), seeds)
        return Starts(physics.qpos.copy(), self._task.target(physics).copy())

    def rollout(self, qpos: ArrayLike, qvel: ArrayLike, target: ArrayLike | None, actions: ArrayLike) -> PhysicsRollout:
        """Simulate from states under actions (B, T, nu) in -1..1, each for one simulation step.

        Raises:
            ControlError: an array has the wrong shape, or a number that is not finite.
        """
        actions = np.asarray(actions, np.float64)
        if actions.ndim != 3 or actions.shape[2] != self.model.nu:
            raise ControlError(f"{self.name}: actions have shape {actions.shape}; it must be (B, T, {self.model.nu})")
        if not np.isfinite(actions).all():
            raise ControlError(f"{self.name}: actions hold numbers that are not finite; all must lie in -1..1")
        physics = self._placed(qpos, qvel, target)
        count, steps = len(actions), actions.shape[1]
        if count != physics.num:
            raise ControlError(f"{self.name}: {count} rows of actions for {physics.num} states; give as many of each")
        shapes = (self.model.nq,), (self.model.nv,), (), (self.facts.observation_size,)
        result = PhysicsRollout(*(np.full((count, steps, *shape), np.nan) for shape in shapes))
        alive = np.ones(count, np.bool_)
        for step in range(steps):
            alive &= ~physics.step(actions[:, step])
            values = physics.qpos, physics.qvel, self._task.reward(physics), self._task.observe(physics)
            for record, value in zip(result, values, strict=True):
                record[alive, step] = value[alive]
        return result

    def observe(self, qpos: ArrayLike, qvel: ArrayLike, target: ArrayLike | None = None) -> Float64:
        """The suite's observation (the state) of states as they are, without control, (B, n).

        Raises:
            ControlError: an array has the wrong shape, or a number that is not finite.
        """
        return self._task.observe(self._placed(qpos, qvel, target)).copy()

    def reward(self, qpos: ArrayLike, qvel: ArrayLike, target: ArrayLike | None = None) -> Float64:
        """Rewards (B,) of states as they are.

        Raises:
            ControlError: an array has the wrong shape, or a number that is not finite.
        """
        return self._task.reward(self._placed(qpos, qvel, target)).copy()

    def read(
        self,
        qpos: ArrayLike,
        target: ArrayLike | None,
        bodies: Sequence[str],
        positions: ArrayLike,
        quaternions: ArrayLike,
        fovs: ArrayLike,
        grid: int = 4,
        rays_per_receptor: int = 256,
    ) -> NDArray[np.float32]:
        """What one sensor sees in each of N states, (N, grid, grid, 3), 0 to 1, row 0 at the top.

        Args:
            qpos: joint positions (N, nq).
            target: places of the targets (N, 3).
            bodies: names of the bodies that the sensors sit on, (N,).
            positions: of the sensors in their bodies' frames [m], (N, 3).
            quaternions: of the sensors in their bodies' frames (w, x, y, z), (N, 4); they look along their -z, +y up.
            fovs: full fields of view [rad], (N,).
            grid: receptors per row.
            rays_per_receptor: rays averaged in a receptor, a square number.

        Raises:
            ControlError: an unknown body, or an array of the wrong shape.
            RenderError: a field of view, the grid or the number of rays is not valid.
        """
        from prnav.domains.control.caster import Caster, WorldPoses

        physics = self._placed(qpos, None, target)
        num = physics.num
        body = self._body_ids(bodies, num)
        places = self._checked("positions", positions, (num, 3))
        turned = self._checked("quaternions", quaternions, (num, 4))
        rows = np.arange(num)
        body_axes = physics.derived["xmat"].reshape(num, -1, 3, 3)[rows, body]
        world_places, world_axes = to_world(places, rotation(turned), physics.derived["xpos"][rows, body], body_axes)
        if self._caster is None or self._caster[0] != rays_per_receptor:
            self._caster = rays_per_receptor, Caster(self.model, rays_per_receptor=rays_per_receptor)
        poses = WorldPoses(*(physics.derived[name] for name in WorldPoses._fields))
        angles = self._checked("fovs", fovs, (num,))[:, None]
        seen = self._caster[1].read(
            poses, world_places[:, None], world_axes[:, None], angles, grid=grid, threads=self.threads
        )
        return seen[:, 0]

    def _placed(self, qpos: ArrayLike, qvel: ArrayLike | None, target: ArrayLike | None) -> Physics:
        """Simulations in these states, with everything about them computed."""
        values = np.asarray(qpos, np.float64)
        num = len(values) if values.ndim else 0
        values = self._checked("qpos", values, (num, self.model.nq))
        speeds = np.zeros((num, self.model.nv)) if qvel is None else self._checked("qvel", qvel, (num, self.model.nv))
        physics = self._simulations(num)
        rows = np.arange(num)
        if target is not None:
            self._task.set_target(physics, rows, self._checked("target", target, (num, 3)))
        physics.place(rows, values, speeds)
        physics.forward(rows)
        return physics

    def _simulations(self, num: int) -> Physics:
        """Fresh room for ``num`` simulations."""
        from prnav.domains.control.caster import WorldPoses
        from prnav.domains.control.physics import Physics

        if num < 1:
            raise ControlError(f"{self.name}: there are no states; give at least one")
        derived = tuple(dict.fromkeys((*self._task.derived, "xpos", "xmat", *WorldPoses._fields)))
        return Physics(self.model, num, self.facts.physics_steps, derived, self._task.expanded, min(self.threads, num))

    def _checked(self, name: str, value: ArrayLike, shape: tuple[int, ...]) -> Float64:
        array = np.asarray(value, np.float64)
        if array.shape != shape:
            raise ControlError(f"{self.name}: {name} has shape {array.shape}; it must be {shape}")
        if not np.isfinite(array).all():
            raise ControlError(f"{self.name}: {name} holds numbers that are not finite")
        largest = float(np.abs(array).max(initial=0.0))
        if largest > LARGEST:
            raise ControlError(f"{self.name}: {name} holds {largest:g}; physics needs numbers within {LARGEST:g} of 0")
        return array

    def _body_ids(self, bodies: Sequence[str], num: int) -> NDArray[np.int64]:
        names = [self.model.body(index).name for index in range(self.model.nbody)]
        if len(bodies) != num:
            raise ControlError(f"{self.name}: {len(bodies)} names of bodies for {num} states; give as many of each")
        wrong = [body for body in bodies if body not in names]
        if wrong:
            raise ControlError(f"{self.name} has no body {str(wrong[0])!r}; valid: {', '.join(names)}")
        return np.array([names.index(body) for body in bodies], np.int64)
