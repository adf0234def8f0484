"""Small runs on the toy task."""

import sys
from pathlib import Path

import pytest

from prnav.train import RunFolder, TrainConfig, Trainer

sys.path.insert(0, str(Path(__file__).parent))

from toy_run import toy_config  # noqa: E402 (found beside this file)


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
        trainer.begin()
        return trainer

    yield make
    for trainer in made:
        trainer.close()
