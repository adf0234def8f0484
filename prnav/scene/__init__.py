"""Mesh files and built-in homes as one kind of arrays: :class:`SceneMesh`."""

from prnav.scene.atlas import TextureAtlas
from prnav.scene.library import SPLITS, load_scene, resolve_scene, scene_ids, targetnav_scene_ids
from prnav.scene.mesh import SceneMesh

__all__ = ["SPLITS", "SceneMesh", "TextureAtlas", "load_scene", "resolve_scene", "scene_ids", "targetnav_scene_ids"]
