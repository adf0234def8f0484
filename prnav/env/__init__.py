"""Gymnasium environments over simulator, sensors and task. Their classes load when they are first used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_LAZY = {
    "EnvConfig": "prnav.env.config",
    "EpisodeSource": "prnav.env.episode_source",
    "PointGoalNavEnv": "prnav.env.single_env",
    "PointGoalNavVectorEnv": "prnav.env.vector_env",
    "PointGoalSlots": "prnav.env.pointgoal_slots",
    "load_source": "prnav.env.episode_source",
}

__all__ = [
    "EnvConfig",
    "EpisodeSource",
    "PointGoalNavEnv",
    "PointGoalNavVectorEnv",
    "PointGoalSlots",
    "load_source",
]

if TYPE_CHECKING:
    from prnav.env.config import EnvConfig
    from prnav.env.episode_source import EpisodeSource, load_source
    from prnav.env.pointgoal_slots import PointGoalSlots
    from prnav.env.single_env import PointGoalNavEnv
    from prnav.env.vector_env import PointGoalNavVectorEnv


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'prnav.env' has no attribute {name!r}")
