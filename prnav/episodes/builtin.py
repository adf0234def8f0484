"""The built-in episodes of the built-in houses: val and test are shipped, train is drawn and kept in the cache."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from prnav.aliases import JSON, JSONObject, Progress
from prnav.cache import cache_key, cached_arrays
from prnav.episodes.episode import EpisodeDataset
from prnav.episodes.generate import GENERATOR_VERSION, GenerationConfig, generate_table
from prnav.episodes.table import EpisodeTable, concatenate_tables, load_episode_table
from prnav.errors import EpisodeError
from prnav.navmesh import BUILDER_VERSION, NavMesh, NavMeshSettings, load_navmesh
from prnav.resources import resource
from prnav.scene import SceneMesh, load_scene, scene_ids
from prnav.version import __version__

BUILTIN_NAME = "prhouses-v1"
BUILTIN_SEED = 20240
SHIPPED_PER_SCENE = 56  #: as in Matterport3D's test split, 18 x 56 = 1,008 episodes
SHIPPED_SPLITS = ("val", "test")


def load_builtin_episodes(
    split: str,
    per_scene: int = 1000,
    seed: int = 0,
    max_scenes: int | None = None,
    progress: Progress | None = None,
) -> EpisodeDataset:
    """Built-in episodes of a split as objects; :func:`load_builtin_table` has them as columns."""
    table, header = load_builtin_table(split, per_scene, seed, max_scenes, progress)
    return EpisodeDataset(tuple(table.to_episodes()), header)


def load_builtin_table(
    split: str,
    per_scene: int = 1000,
    seed: int = 0,
    max_scenes: int | None = None,
    progress: Progress | None = None,
) -> tuple[EpisodeTable, JSONObject]:
    """Built-in episodes of a split, and the header that says what they were made from.

    Args:
        split: "val" and "test" are shipped; "train" is drawn on first use.
        per_scene: how many training episodes per scene.
        seed: of the training episodes.
        max_scenes: take the first so many scenes only.
        progress: called while training episodes are drawn.

    Raises:
        EpisodeError: no such split, or the shipped file is missing or broken.
    """
    if split == "train":
        return load_train_table(scene_ids(split)[:max_scenes], per_scene, seed, progress), {}
    table, header = load_episode_table(builtin_path(split))
    if max_scenes is not None:
        table = table.take(np.flatnonzero(table.scene_index < max_scenes))
        table = dataclasses.replace(table, scene_ids=table.scene_ids[:max_scenes])
    return table, header


def builtin_path(split: str) -> Path:
    """Where a split's shipped episodes are.

    Raises:
        EpisodeError: no such split.
    """
    if split not in SHIPPED_SPLITS:
        raise EpisodeError(f"no built-in episodes {split!r}; valid: train, {', '.join(SHIPPED_SPLITS)}")
    return resource("episodes", BUILTIN_NAME, f"{split}.json.gz")


def load_train_table(ids: Sequence[str], per_scene: int, seed: int, progress: Progress | None = None) -> EpisodeTable:
    """Training episodes of several built-in homes, ``per_scene`` of each, drawn on first use."""
    tables = []
    for done, scene_id in enumerate(ids):
        if progress is not None:
            progress(done, len(ids), scene_id)
        tables.append(train_table(scene_id, per_scene, seed))
    return concatenate_tables(tables)


def train_table(
    scene_id: str, count: int, seed: int, scene: SceneMesh | None = None, navmesh: NavMesh | None = None
) -> EpisodeTable:
    """``count`` training episodes in a scene as columns, kept in the cache.

    Args:
        scene_id: a built-in house, or the name of ``scene``.
        count: how many.
        seed: another seed gives other episodes.
        scene: the scene, where it is loaded already.
        navmesh: its navmesh, where it is built already.
    """
    if scene is None:
        scene = load_scene(scene_id)
    settings = NavMeshSettings() if navmesh is None else navmesh.settings
    config = GenerationConfig()
    parts = (GENERATOR_VERSION, BUILDER_VERSION, scene_id, scene.hash, count, seed)
    key = cache_key(*parts, dataclasses.asdict(settings), dataclasses.asdict(config))

    def compute() -> JSONObject:
        floor = load_navmesh(scene, settings) if navmesh is None else navmesh
        return generate_table(floor, scene_id, count, seed, config).to_arrays()

    return EpisodeTable((scene_id,), **cached_arrays("episodes", key, compute))


def make_builtin_episodes(split: str, progress: Progress | None = None) -> EpisodeDataset:
    """What is shipped for a split, drawn anew from the scenes as they are."""
    ids = scene_ids(split)
    tables, hashes = [], {}
    settings = NavMeshSettings()
    for done, scene_id in enumerate(ids):
        if progress is not None:
            progress(done, len(ids), scene_id)
        scene = load_scene(scene_id)
        hashes[scene_id] = scene.hash
        tables.append(generate_table(load_navmesh(scene, settings), scene_id, SHIPPED_PER_SCENE, BUILTIN_SEED))
    episodes = concatenate_tables(tables).to_episodes()
    return EpisodeDataset(tuple(episodes), make_header(settings, "y", BUILTIN_SEED, hashes))


def make_header(settings: NavMeshSettings, up: str, seed: int, scene_hashes: Mapping[str, str]) -> JSONObject:
    """Top-level keys that say what a data set was made from."""
    return {
        "prnav": {
            "version": __version__,
            "generator": GENERATOR_VERSION,
            "up": up,
            "seed": seed,
            "navmesh": dataclasses.asdict(settings),
            "scenes": dict(scene_hashes),
        }
    }


def check_scenes(header: Mapping[str, JSON], scenes: Mapping[str, SceneMesh], source: str) -> None:
    """Hold scenes against the hashes in a data set's header; data sets without a header say nothing and pass.

    Raises:
        EpisodeError: a scene is not the one the episodes were drawn in.
    """
    hashes = _made_from(header, source).get("scenes", {})
    if not isinstance(hashes, Mapping):
        raise EpisodeError(
            f"{source}: header key 'prnav.scenes' is {hashes!r}; it must map scene ids to SHA-256 hashes"
        )
    for scene_id, scene in scenes.items():
        if scene_id in hashes and hashes[scene_id] != scene.hash:
            raise EpisodeError(
                f"{source}: its episodes in {scene_id} belong to a scene with hash {str(hashes[scene_id])[:12]}, but "
                f"this one has {scene.hash[:12]}; generate the episodes again (prnav-episodes), or use the prnav "
                f"version they were made with ({_made_from(header, source).get('version')})"
            )


def up_axis(header: Mapping[str, JSON], default: str, source: str) -> str:
    """Up axis that a data set's header says its mesh files have; ``default`` where it says none."""
    return str(_made_from(header, source).get("up", default))


def _made_from(header: Mapping[str, JSON], source: str) -> Mapping[str, JSON]:
    made = header.get("prnav", {})
    if not isinstance(made, Mapping):
        raise EpisodeError(f"{source}: header key 'prnav' is {made!r}; it must be an object")
    return made
