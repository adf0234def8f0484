"""What is added to the package by one module and one line of registration each."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def reach(monkeypatch):
    """The task "reach", registered."""
    from prnav import catalog

    monkeypatch.setitem(catalog.TASKS, "reach", "reach_task:SPEC")


@pytest.fixture
def reach_config(tmp_path):
    """Config of a small run of it."""
    path = tmp_path / "reach.toml"
    path.write_text(
        """
name = "reach"
task = "reach"
total_steps = 1920
num_envs = 8
threads = 1
checkpoint_steps = 960
validate_steps = 960
validation_episodes = 4

[env]
length = 5

[policy]
encoder = "state"
memory = "stack"
frames = 2
width = 16

[ppo]
rollout_steps = 30
mini_batches = 2
""",
        encoding="utf-8",
    )
    return path
