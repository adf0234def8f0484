"""Gymnasium environments over simulator, sensors and task. Their classes load when they are first used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_LAZY = {
    "EnvConfig": "prnav.env.config",
    "EpisodeTable": "prnav.env.episode_table",
    "PointGoalNavEnv": "prnav.env.single_env",
    "PointGoalNavVectorEnv": "prnav.env.vector_env",
    "PointGoalSlots": "prnav.env.pointgoal_slots",
    "configured_episodes": "prnav.env.episode_table",
    "load_table": "prnav.env.episode_table",
}

__all__ = [
    "EnvConfig",
    "EpisodeTable",
    "PointGoalNavEnv",
    "PointGoalNavVectorEnv",
    "PointGoalSlots",
    "configured_episodes",
    "load_table",
]

if TYPE_CHECKING:
    from prnav.env.config import EnvConfig
    from prnav.env.episode_table import EpisodeTable, configured_episodes, load_table
    from prnav.env.pointgoal_slots import PointGoalSlots
    from prnav.env.single_env import PointGoalNavEnv
    from prnav.env.vector_env import PointGoalNavVectorEnv


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'prnav.env' has no attribute {name!r}")
