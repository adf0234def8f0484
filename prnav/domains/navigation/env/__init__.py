"""Environments over simulator, sensors and rules: episodes, slots, batched and single Gymnasium environments."""

from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
from prnav.domains.navigation.env.single_env import NavigationEnv
from prnav.domains.navigation.env.slots import NavigationSlots
from prnav.domains.navigation.env.vector_env import NavigationVectorEnv

__all__ = [
    "EpisodeSource",
    "NavigationConfig",
    "NavigationEnv",
    "NavigationSlots",
    "NavigationVectorEnv",
    "load_source",
]
