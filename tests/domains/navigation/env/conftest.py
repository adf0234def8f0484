import numpy as np
import pytest

from prnav.domains.navigation.env import EnvConfig, load_source


@pytest.fixture(scope="session")
def config():
    return EnvConfig(scenes="train", max_scenes=2, episodes_per_scene=60, rays_per_receptor=1)


@pytest.fixture(scope="session")
def source(config):
    return load_source(config)


@pytest.fixture
def random_actions():
    generator = np.random.Generator(np.random.PCG64(1))
    return lambda n: generator.choice([1, 1, 1, 2, 3], size=n)
