"""Small runs on the toy task."""

import sys
from pathlib import Path

import pytest

from prnav.policy import PolicyConfig
from prnav.train import ImitationConfig, PPOConfig, RunFolder, TrainConfig, Trainer

sys.path.insert(0, str(Path(__file__).parent))


def toy_config(**changes) -> TrainConfig:
    """A run of 10 updates of 8 x 16 steps."""
    ppo = PPOConfig(rollout_steps=16, learning_rate=3e-3, epochs=2, mini_batches=2)
    policy = PolicyConfig(encoder="compact", width=16, lstm_hidden=16)
    values = {"total_steps": 10 * 128, "num_envs": 8, "threads": 2, "checkpoint_steps": 384, "ppo": ppo}
    return TrainConfig(**{**values, "policy": policy, "imitation": ImitationConfig(), **changes})


@pytest.fixture
def config():
    return toy_config()


@pytest.fixture
def make_trainer(tmp_path):
    """Function (config, folder name) -> trainer on the toy task."""
    from toy_env import CueEnv

    made = []

    def make(config: TrainConfig, name: str = "run", length: int = 3, cut: bool = False, **arguments) -> Trainer:
        envs = CueEnv(config.num_envs, length, cut)
        trainer = Trainer(config, envs, RunFolder(tmp_path / name), **arguments)
        made.append(trainer)
        return trainer

    yield make
    for trainer in made:
        trainer.close()
