"""prnav: indoor navigation with photoreceptors.

The names below are loaded when they are first used, so that ``import prnav`` pulls in neither torch, a compiler, nor
any graphics library. It does register the environments: after it, ``gymnasium.make("prnav/PointGoalNav-v0")`` works.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from prnav.aliases import Untyped
from prnav.errors import PrnavError
from prnav.version import __version__

_LAZY = {
    "SceneMesh": "prnav.scene",
    "load_scene": "prnav.scene",
    "open_scene_set": "prnav.scene",
    "scene_ids": "prnav.scene",
    "NavMesh": "prnav.navmesh",
    "NavMeshSettings": "prnav.navmesh",
    "load_navmesh": "prnav.navmesh",
    "Episode": "prnav.episodes",
    "load_episodes": "prnav.episodes",
    "save_episodes": "prnav.episodes",
    "generate_episodes": "prnav.episodes",
    "Renderer": "prnav.render",
    "ControlTask": "prnav.domains.control.control_task",
    "Design": "prnav.sensors",
    "load_design": "prnav.sensors",
}

__all__ = [
    "ControlTask",
    "Design",
    "Episode",
    "NavMesh",
    "NavMeshSettings",
    "PrnavError",
    "Renderer",
    "SceneMesh",
    "__version__",
    "generate_episodes",
    "load_design",
    "load_episodes",
    "load_navmesh",
    "load_scene",
    "open_scene_set",
    "save_episodes",
    "scene_ids",
]

if TYPE_CHECKING:
    from prnav.domains.control.control_task import ControlTask
    from prnav.episodes import Episode, generate_episodes, load_episodes, save_episodes
    from prnav.navmesh import NavMesh, NavMeshSettings, load_navmesh
    from prnav.render import Renderer
    from prnav.scene import SceneMesh, load_scene, open_scene_set, scene_ids
    from prnav.sensors import Design, load_design


def __getattr__(name: str) -> Untyped:
    if name in _LAZY:
        value = getattr(importlib.import_module(_LAZY[name]), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'prnav' has no attribute {name!r}")


# by name, since the rooms below env may import this module but not env
importlib.import_module("prnav.catalog").register()
