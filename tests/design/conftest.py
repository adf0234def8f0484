"""A search over two small homes with a tiny policy."""

import sys
from pathlib import Path

import pytest

from prnav.design.config import load_optimize_config

sys.path.insert(0, str(Path(__file__).parent))

TINY = (
    "starts=1",
    "search.trials=3",
    "specialist.steps=256",
    "specialist.episodes=4",
    "specialist.num_envs=4",
    "specialist.split=train",
    "train.num_envs=4",
    "train.total_steps=256",
    "train.imitation.steps=128",
    "train.imitation.mini_batches=1",
    "train.ppo.rollout_steps=16",
    "train.ppo.mini_batches=1",
    "train.policy.width=8",
    "train.policy.lstm_hidden=8",
    "train.env.max_scenes=1",
    "train.env.episodes_per_scene=6",
    "train.env.rays_per_receptor=1",
    "train.env.task.max_steps=20",
    "proxy.homes=4",
    "proxy.places=240",
    "proxy.pose_homes=1",
    "proxy.pose_places=80",
    "proxy.goals=2",
    "proxy.directions=6",
    "proxy.features=32",
    "proxy.rays_per_receptor=1",
)
"""Settings of design-quick that make every stage take moments."""


@pytest.fixture
def tiny():
    return lambda *more: load_optimize_config("design-quick", (*TINY, *more))
