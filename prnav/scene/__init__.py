"""Mesh files and built-in homes as one kind of arrays: :class:`SceneMesh`."""

from prnav.scene.atlas import TextureAtlas
from prnav.scene.datasets import DATA_SETS, SceneSet, open_scene_set
from prnav.scene.library import SPLITS, load_scene, resolve_scene, scene_ids, ten_training_homes
from prnav.scene.mesh import SceneMesh
from prnav.scene.scene_file import SceneFile

__all__ = [
    "DATA_SETS",
    "SPLITS",
    "SceneFile",
    "SceneMesh",
    "SceneSet",
    "TextureAtlas",
    "load_scene",
    "open_scene_set",
    "resolve_scene",
    "scene_ids",
    "ten_training_homes",
]
