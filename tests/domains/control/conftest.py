"""Tasks of continuous control and the recordings they are held to."""

from __future__ import annotations

import functools

import numpy as np
import pytest

TASKS = ("reacher-hard", "walker-stand", "walker-walk", "walker-run", "finger-spin", "finger-turn-easy")


@functools.cache
def control_task(name: str):
    import prnav

    return prnav.ControlTask(name)


@pytest.fixture(params=TASKS)
def task(request):
    """Each of the six tasks; skipped without MuJoCo."""
    pytest.importorskip("mujoco", reason='needs MuJoCo: pip install "prnav[control]"')
    return control_task(request.param)


@pytest.fixture
def rollouts(task, golden):
    """Recorded rollouts of the task."""
    with np.load(golden / "dmc" / task.name.replace("-", "_") / "rollouts.npz") as file:
        return {name: file[name] for name in file.files}


class SimpleMounts:
    """K sensors, one after the other on the moving bodies: theta shifts, turns about z and widens."""

    def __init__(self, model, num_sensors=4):
        self.num_sensors = num_sensors
        self.body_ids = 1 + np.arange(num_sensors) % (model.nbody - 1)

    def theta_to_pose(self, theta):
        places = np.array([0.0, 0.0, 0.05]) + 0.1 * theta[..., :3]
        angle = theta[..., 3] + np.linspace(0, 6, self.num_sensors)
        axes = np.zeros((*angle.shape, 3, 3))
        axes[..., 0, 0], axes[..., 2, 0] = np.cos(angle), -np.sin(angle)
        axes[..., 0, 2], axes[..., 2, 2] = np.sin(angle), np.cos(angle)
        axes[..., 1, 1] = 1.0
        return places, axes, np.clip(1.2 + 0.5 * theta[..., 6], 0.1, 3.0)


@pytest.fixture
def mounts(task):
    """Four sensors on the task's body."""
    return SimpleMounts(task.model)
