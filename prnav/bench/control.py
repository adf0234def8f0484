"""Speed of continuous control: simulation steps per second of its physics and environments, one core."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from prnav.bench.table import Row, rates_by_turns, row
from prnav.domains.control.env import ControlVectorEnv, config_of
from prnav.domains.control.facts import TASKS

AGENTS = 64
MEASURED = ("reacher-hard", "walker-walk", "finger-spin")
"""One task of each body."""
RAYS = 16
"""Rays per photoreceptor; each agent's design has its own number of 1 x 1 sensors."""


def measure_control(seconds: float = 2.0) -> list[Row]:
    """Rows of ``name metric value unit device version``.

    The figures of a task take turns, so that other work on the machine slows all of them alike. A simulation step is a
    control step of the suite, as everywhere.

    Args:
        seconds: how long each row is measured [s].
    """
    rows = []
    for task in MEASURED:
        envs = ControlVectorEnv(AGENTS, config_of(task)(rays_per_receptor=RAYS))
        blind = ControlVectorEnv(AGENTS, config_of(task)(senses="state"))
        name = TASKS[task].body
        speeds = rates_by_turns([_physics(envs), _steps(envs), _steps(blind)], seconds)
        receptors = f"{envs.slots.num_sensors}_receptors"
        for metric, speed in zip(("physics_alone", f"env_step_{receptors}", "env_step_state"), speeds, strict=True):
            rows.append(row("control", f"{name}_{metric}", speed, "simulation steps/s"))
    return rows


def _physics(envs: ControlVectorEnv) -> Callable[[], int]:
    """Simulation steps of the bodies alone, with what derives from them."""
    simulations = ControlVectorEnv(AGENTS, envs.config)
    simulations.reset(seed=0)
    physics = simulations.slots.physics
    actions = np.random.Generator(np.random.PCG64(0)).uniform(-1, 1, (10, *physics.ctrl.shape))

    def work() -> int:
        for action in actions:
            physics.step(action)
        return AGENTS * len(actions)

    return work


def _steps(envs: ControlVectorEnv) -> Callable[[], int]:
    envs.reset(seed=0)
    actions = np.random.Generator(np.random.PCG64(0)).uniform(-1, 1, (10, AGENTS, envs.action_spec.size))

    def work() -> int:
        for action in actions.astype(np.float32):
            envs.step(action)
        return AGENTS * len(actions) * envs.config.repeat

    return work
