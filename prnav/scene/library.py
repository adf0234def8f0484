"""Scenes by name: built-in houses by their id, mesh files by their path, and the files that episodes refer to."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

from prnav.cache import cache_key, cached_arrays
from prnav.errors import SceneError
from prnav.files import resolve_inside
from prnav.scene.load import LOADER_VERSION, SUFFIXES, content_key, load_mesh_file
from prnav.scene.mesh import SceneMesh

SPLITS = ("train", "val", "test")
BUILT_IN = re.compile(r"prhouses/(train|val|test)/(\d\d)")
_HABITAT_PREFIX = "data/scene_datasets/"


def scene_ids(split: str) -> list[str]:
    """Ids of the built-in houses of a split: 61 to train on, 8 to validate, 18 to test.

    Raises:
        SceneError: no such split.
    """
    from prnav.scene.houses import SPLIT_SIZES

    if split not in SPLITS:
        raise SceneError(f"split {split!r} is not built in; valid: {', '.join(SPLITS)}")
    return [f"prhouses/{split}/{index:02d}" for index in range(SPLIT_SIZES[split])]


def load_scene(source: str | Path, up: str = "y", max_texture_size: int = 1024) -> SceneMesh:
    """A built-in house (``"prhouses/test/03"``) or a mesh file (.glb, .gltf, .obj, .ply), kept in the cache.

    Args:
        source: id or path.
        up: up axis of a file, "y" or "z"; Habitat's stage files are z-up. Built-in houses do not need it.
        max_texture_size: longest side [texels] that textures of a file are reduced to.

    Raises:
        SceneError: no such house or file, or a file that is broken or holds what cannot be used.
    """
    if isinstance(source, str) and source.startswith("prhouses/"):
        return _load_house(source)
    path = Path(source)
    key = cache_key(LOADER_VERSION, content_key(path), up, max_texture_size)
    arrays = cached_arrays("scene", key, lambda: load_mesh_file(path, up, max_texture_size).to_arrays())
    return SceneMesh.from_arrays(path.name, arrays)


def resolve_scene(scene_id: str, data_root: Path | None = None, scene_files: Sequence[Path] = ()) -> str | Path:
    """What :func:`load_scene` takes for the scene that an episode names.

    Looked for among ``scene_files`` by name, then under ``data_root`` (with and without Habitat's prefix
    ``data/scene_datasets/``), which it cannot leave.

    Raises:
        SceneError: the scene is in neither place, or its path leaves the data root.
    """
    if scene_id.startswith("prhouses/"):
        return scene_id
    wanted = Path(scene_id)
    for file in scene_files:
        if file == wanted or file.name == wanted.name:
            return file
    if data_root is not None:
        short = scene_id.removeprefix(_HABITAT_PREFIX)
        for relative in dict.fromkeys((scene_id, short, f"scene_datasets/{short}")):
            path = resolve_inside(data_root, relative, SceneError)
            if path.is_file():
                return path
    looked = [f"the data root {data_root}"] if data_root is not None else []
    looked += [f"the scene files {', '.join(str(file) for file in scene_files)}"] if scene_files else []
    where = " or ".join(looked) if looked else "no folder was given"
    raise SceneError(
        f"scene {scene_id!r} is not here (looked in: {where}); pass --data-root DIR, the folder that holds "
        f"{scene_id}, or --scene FILE"
    )


def _load_house(scene_id: str) -> SceneMesh:
    from prnav.scene.houses import SPLIT_SIZES, VERSION, HouseConfig, generate_house, split_seed

    match = BUILT_IN.fullmatch(scene_id)
    if match is None or int(match[2]) >= SPLIT_SIZES[match[1]]:
        ranges = ", ".join(f"prhouses/{split}/00..{size - 1:02d}" for split, size in SPLIT_SIZES.items())
        raise SceneError(f"no built-in house {scene_id!r}; valid: {ranges}")
    seed, config = split_seed(match[1], int(match[2])), HouseConfig()
    key = cache_key(VERSION, seed, dataclasses.asdict(config))
    arrays = cached_arrays("house", key, lambda: generate_house(seed, config).to_arrays())
    return SceneMesh.from_arrays(scene_id, arrays)


__all__ = ["SPLITS", "SUFFIXES", "load_scene", "resolve_scene", "scene_ids"]
