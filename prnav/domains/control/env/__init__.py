"""Continuous control as environments: slots, vector environment, single environment."""

from prnav.domains.control.env.config import ControlConfig
from prnav.domains.control.env.seeds import EpisodeSeeds, episode_seed
from prnav.domains.control.env.single_env import ControlEnv
from prnav.domains.control.env.slots import ControlSlots
from prnav.domains.control.env.vector_env import ControlVectorEnv

__all__ = ["ControlConfig", "ControlEnv", "ControlSlots", "ControlVectorEnv", "EpisodeSeeds", "episode_seed"]
