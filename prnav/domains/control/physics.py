"""N simulations of one body, stepped together by MuJoCo's batch interface.

All arrays have the simulations on the first axis. A simulation's states depend on its own start and actions alone:
the bits are the same for any number of threads, any batch and any order.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array
from prnav.domains.control.engine import Quiet, mujoco
from prnav.domains.control.facts import LARGEST

STATE = ("time", "qpos", "qvel", "qacc_warmstart", "ctrl")
"""Arrays that say everything about the simulations; warm starts are where the constraint solver begins."""
OWN_DATA_UP_TO = 64
"""Batches up to this size keep one MjData per simulation. That spares computing a step's first stages twice, worth up
to 1.4 times the speed, as long as the cache holds them all. The bits are the same either way."""
_BAD = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)
"""MuJoCo's warnings that a position, velocity or acceleration was bad and the simulation was set back."""


class Physics:
    """N simulations of ``model``; attributes are live arrays, refreshed by each call."""

    def __init__(
        self,
        model: mujoco.MjModel,
        num: int,
        physics_steps: int,
        derived: Sequence[str] = (),
        expanded: Sequence[str] = (),
        threads: int = 1,
    ):
        """Simulations in the model's reference pose.

        Args:
            model: the body.
            num: N.
            physics_steps: physics steps per simulation step.
            derived: fields of MjData that are wanted after each call, in :attr:`derived`.
            expanded: fields of MjModel that differ between simulations, in :attr:`expanded`.
            threads: threads that step simulations, with the caller's.
        """
        self.model = model
        self.num = num
        self.physics_steps = physics_steps
        self.batch = mujoco.batch.Batch(model, num, threads, persistent=num <= OWN_DATA_UP_TO)
        self.state = {name: self.batch.bind(name) for name in STATE}
        self.time = self.state["time"]  #: (N,) [s]
        self.qpos = self.state["qpos"]  #: (N, nq) [m or rad]
        self.qvel = self.state["qvel"]  #: (N, nv) [m/s or rad/s]
        self.ctrl = self.state["ctrl"]  #: (N, nu)
        self.contacts = self.batch.bind("ncon")  #: (N,)
        self.derived = {name: self.batch.bind(name) for name in derived}
        self.expanded = {name: self.batch.expand(name) for name in expanded}
        self.batch.reset()

    def place(self, rows: NDArray[np.int64], qpos: ArrayLike, qvel: ArrayLike) -> None:
        """Put simulations ``rows`` (n,) at states (n, nq), (n, nv), with nothing of what they did before.

        Positions are computed (and with them contacts), forces are not: :meth:`forward` follows.
        """
        self.batch.reset(rows, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self.qpos[rows] = qpos
        self.qvel[rows] = qvel
        with Quiet():
            self.batch.forward(rows, stage=mujoco.mjtStage.mjSTAGE_POS)

    def forward(self, rows: NDArray[np.int64]) -> None:
        """Compute everything about the states of simulations ``rows``, without control."""
        self.ctrl[rows] = 0.0
        with Quiet():
            self.batch.forward(rows)

    def step(self, actions: NDArray[np.float64], rows: NDArray[np.int64] | None = None) -> NDArray[np.bool_]:
        """Advance simulations ``rows`` (n,), or all, by one simulation step under actions (n, nu).

        Positions and velocities, and what derives from them, are current afterwards; forces (and touch sensors) are
        those of the last physics step, before its integration. That is the order of the suite's control step.

        Returns:
            Which of these simulations have diverged since they were placed, (n,). They are back in the state before
            the step.
        """
        at = slice(None) if rows is None else rows
        before = [value[at].copy() for value in self.state.values()]
        self.ctrl[at] = actions
        diverged = np.zeros(len(before[0]), np.bool_)
        try:
            with Quiet():
                self.batch.step(rows, self.physics_steps, mujoco.mjtStage.mjSTAGE_VEL)
        except mujoco.batch.SimulationError as error:
            diverged |= np.isin(np.arange(self.num)[at], error.ids)
        warned = self.batch.warning[at, _BAD, 1]
        if warned.any():
            diverged |= warned.any(axis=1)
        for value in (self.qpos[at], self.qvel[at]):
            if not np.abs(value).max() < LARGEST:  # nor for nan
                diverged |= ~(np.abs(value) < LARGEST).all(axis=1)
        if diverged.any():
            lost = np.arange(self.num)[at][diverged]
            for value, old in zip(self.state.values(), before, strict=True):
                value[lost] = old[diverged]
            with Quiet():
                self.batch.forward(lost, stage=mujoco.mjtStage.mjSTAGE_VEL)
        return diverged

    def get_state(self) -> dict[str, Array]:
        """Copies of the arrays that :meth:`set_state` needs to resume exactly here."""
        return {name: value.copy() for name, value in (*self.state.items(), *self.expanded.items())}

    def set_state(self, state: dict[str, Array]) -> None:
        """Resume where :meth:`get_state` was called."""
        self.batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        for name, value in (*self.state.items(), *self.expanded.items()):
            value[:] = state[name]
        self.batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)
