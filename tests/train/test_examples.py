"""The environments under other people's trainers, for a few hundred steps."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(name: str):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_cleanrl_style_loop_trains():
    losses = load("cleanrl_style_ppo").main(steps=384, num_envs=4, rollout=32, max_scenes=1)
    assert len(losses) == 3 and np.isfinite(losses).all()


def test_stable_baselines_recurrent_ppo_trains():
    pytest.importorskip("sb3_contrib", reason="pip install sb3-contrib runs this")
    model = load("sb3_recurrent_ppo").main(steps=256, num_envs=2, rollout=32)
    assert model.num_timesteps == 256
