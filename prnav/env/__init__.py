"""Gymnasium environments over simulator, sensors and task. Their classes load when they are first used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_LAZY = {
    "EnvConfig": "prnav.env.config",
    "EpisodeSource": "prnav.env.episode_source",
    "NavigationEnv": "prnav.env.single_env",
    "NavigationSlots": "prnav.env.navigation_slots",
    "NavigationVectorEnv": "prnav.env.vector_env",
    "PointGoalNavEnv": "prnav.env.single_env",
    "PointGoalNavVectorEnv": "prnav.env.vector_env",
    "TargetNavEnv": "prnav.env.single_env",
    "TargetNavVectorEnv": "prnav.env.vector_env",
    "load_source": "prnav.env.episode_source",
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
    from prnav.env.config import EnvConfig
    from prnav.env.episode_source import EpisodeSource, load_source
    from prnav.env.navigation_slots import NavigationSlots
    from prnav.env.single_env import NavigationEnv, PointGoalNavEnv, TargetNavEnv
    from prnav.env.vector_env import NavigationVectorEnv, PointGoalNavVectorEnv, TargetNavVectorEnv


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'prnav.env' has no attribute {name!r}")
