"""Gymnasium environments over simulator, sensors and task. Their classes load when they are first used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_LAZY = {
    "EnvConfig": "prnav.domains.navigation.env.config",
    "EpisodeSource": "prnav.domains.navigation.env.episode_source",
    "NavigationEnv": "prnav.domains.navigation.env.single_env",
    "NavigationSlots": "prnav.domains.navigation.env.slots",
    "NavigationVectorEnv": "prnav.domains.navigation.env.vector_env",
    "PointGoalNavEnv": "prnav.domains.navigation.env.single_env",
    "PointGoalNavVectorEnv": "prnav.domains.navigation.env.vector_env",
    "TargetNavEnv": "prnav.domains.navigation.env.single_env",
    "TargetNavVectorEnv": "prnav.domains.navigation.env.vector_env",
    "load_source": "prnav.domains.navigation.env.episode_source",
}

__all__ = [
    "EnvConfig",
    "EpisodeSource",
    "NavigationEnv",
    "NavigationSlots",
    "NavigationVectorEnv",
    "PointGoalNavEnv",
    "PointGoalNavVectorEnv",
    "TargetNavEnv",
    "TargetNavVectorEnv",
    "load_source",
]

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import EnvConfig
    from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
    from prnav.domains.navigation.env.single_env import NavigationEnv, PointGoalNavEnv, TargetNavEnv
    from prnav.domains.navigation.env.slots import NavigationSlots
    from prnav.domains.navigation.env.vector_env import NavigationVectorEnv, PointGoalNavVectorEnv, TargetNavVectorEnv


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'prnav.domains.navigation.env' has no attribute {name!r}")
