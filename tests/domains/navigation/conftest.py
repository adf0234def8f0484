import numpy as np
import pytest

from prnav.domains.navigation.env import load_source
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig


@pytest.fixture(scope="session")
def config():
    return PointGoalEnvConfig(scenes="train", max_scenes=2, episodes_per_scene=60, rays_per_receptor=1)


@pytest.fixture(scope="session")
def source(config):
    return load_source(config)


@pytest.fixture
def random_actions():
    generator = np.random.Generator(np.random.PCG64(1))
    return lambda n: generator.choice([1, 1, 1, 2, 3], size=n)
