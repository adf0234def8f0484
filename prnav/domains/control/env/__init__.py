"""Continuous control as environments: slots, vector environment, single environment."""

from prnav.domains.control.env.config import CONFIGS, ControlConfig, config_of, split_seeds
from prnav.domains.control.env.seeds import EpisodeSeeds, episode_seed
from prnav.domains.control.env.single_env import ControlEnv
from prnav.domains.control.env.slots import ControlSlots
from prnav.domains.control.env.vector_env import ControlVectorEnv

__all__ = [
    "CONFIGS",
    "ControlConfig",
    "ControlEnv",
    "ControlSlots",
    "ControlVectorEnv",
    "EpisodeSeeds",
    "config_of",
    "episode_seed",
    "split_seeds",
]
