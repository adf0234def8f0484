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
