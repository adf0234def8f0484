"""Scenes and the episodes in them: what an environment draws from."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSONObject, Progress, Untyped
from prnav.config import from_mapping
from prnav.domains.navigation.env.config import NavigationConfig
from prnav.episodes import (
    EpisodeTable,
    check_scenes,
    load_builtin_table,
    load_episode_table,
    load_train_table,
    up_axis,
)
from prnav.episodes.datasets import find_episodes
from prnav.navmesh import NavMeshSettings
from prnav.scene import scene_ids, ten_training_homes
from prnav.scene.texture_budget import TextureLimits
from prnav.sim import World, load_world


@dataclass(frozen=True, eq=False)
class EpisodeSource:
    """E episodes as columns, and the world of their scenes (in the columns' numbering)."""

    world: World
    table: EpisodeTable

    def __deepcopy__(self, memo: dict[int, Untyped]) -> EpisodeSource:
        """Nothing in it ever changes: copies share it."""
        return self

    def __len__(self) -> int:
        return len(self.table)

    def id(self, row: int | np.integer) -> tuple[str, str]:
        """(scene_id, episode_id) of one episode."""
        return self.table.scene_id(int(row)), str(self.table.episode_ids[row])

    def names(self, rows: NDArray[np.int64]) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
        """Scene ids and episode ids of episodes (n,), two arrays (n,) of strings."""
        return self._scene_names[self.table.scene_index[rows]], self.table.episode_ids[rows].astype(object)

    @cached_property
    def _scene_names(self) -> NDArray[np.object_]:
        return np.array(self.table.scene_ids, dtype=object)

    @cached_property
    def ids(self) -> tuple[tuple[str, str], ...]:
        """(scene_id, episode_id) of all episodes."""
        return tuple(self.id(row) for row in range(len(self)))

    @cached_property
    def navmesh_origins(self) -> dict[str, str]:
        """Where the navmesh of each scene is from: "built", or "file NAME"."""
        return dict(zip(self.world.scene_ids, self.world.navmesh_origins, strict=False))

    @property
    def scene_index(self) -> NDArray[np.int32]:
        """Scene of each episode, (E,)."""
        return self.table.scene_index

    @property
    def starts(self) -> NDArray[np.float64]:
        """Where they start, (E, 3) [m]."""
        return self.table.start_position

    @cached_property
    def yaws(self) -> NDArray[np.float64]:
        """Where agents look at the start, (E,) [rad]."""
        return self.table.start_yaw

    @property
    def goals(self) -> NDArray[np.float64]:
        """Where to go, (E, 3) [m]."""
        return self.table.goal_position


def load_source(
    config: NavigationConfig, progress: Progress | None = None, *, limit: int | None = None
) -> EpisodeSource:
    """Scenes and episodes that a config asks for.

    Args:
        config: which ones.
        progress: called while scenes load.
        limit: at most so many episodes, dealt evenly over the scenes; scenes that have none are not loaded.

    What the episode files' header says of up axis and navmesh counts, since the episodes were drawn with that; scenes
    are held against its hashes.

    Raises:
        EpisodeError: an episode file is missing or broken, or belongs to other scenes.
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor to walk on.
    """
    limits = TextureLimits(config.max_texture_size, config.texture_budget)
    if (path := episode_path(config)) is not None:
        source = path
        table, header = load_episode_table(path, config.episode_split)
    else:
        source = f"built-in episodes ({config.scenes})"
        table, header = _builtin_table(config, progress)
    if limit is not None:
        table = deal(table, limit)
    world = load_world(
        table.scene_ids,
        data_root=None if config.data_root is None else Path(config.data_root),
        scene_files=[Path(file) for file in config.scene_files],
        up=up_axis(header, config.up, source) if config.up_from_episodes else config.up,
        settings=_settings(header, config.navmesh, source),
        progress=progress,
        data=config.data,
        navmesh_files=config.navmesh_files,
        limits=limits,
    )
    if limits == TextureLimits():  # hashes in headers are of scenes with their textures as they are by default
        check_scenes(header, dict(zip(world.scene_ids, world.scenes, strict=True)), source)
    return EpisodeSource(world, table)


def _builtin_table(config: NavigationConfig, progress: Progress | None) -> tuple[EpisodeTable, JSONObject]:
    """The built-in episodes of a split, those of ten homes where the task trains in them."""
    count, seed, most = config.episodes_per_scene, config.episode_seed, config.max_scenes
    if not config.ten_homes or config.scenes != "train":
        return load_builtin_table(config.scenes, count, seed, most, progress)
    return load_train_table(built_in_scenes(config), count, seed, progress), {}


def built_in_scenes(config: NavigationConfig) -> list[str]:
    """Built-in homes that a config plays in; none where it has episodes or a data set of its own.

    Raises:
        SceneError: no such split.
    """
    if config.episodes is not None or config.data is not None:
        return []
    ten = config.ten_homes and config.scenes == "train"
    return (ten_training_homes() if ten else scene_ids(config.scenes))[: config.max_scenes]


def episode_path(config: NavigationConfig) -> str | None:
    """File or folder of a config's episodes; None where they are the built-in ones.

    Raises:
        EpisodeError: its data set has no such episodes.
    """
    if config.episodes is not None or config.data is None or config.data_root is None:
        return config.episodes
    return str(find_episodes(config.data, config.data_root, config.episode_split or config.scenes))


def deal(table: EpisodeTable, limit: int) -> EpisodeTable:
    """At most ``limit`` episodes in their old order: the first of each scene, then the second of each, and so on."""
    if limit >= len(table):
        return table
    by_scene = np.argsort(table.scene_index, kind="stable")
    first = np.searchsorted(table.scene_index[by_scene], table.scene_index[by_scene])
    turn = np.empty(len(table), np.int64)
    turn[by_scene] = np.arange(len(table)) - first
    rows = np.sort(np.lexsort((np.arange(len(table)), turn))[:limit])
    used, scene_index = np.unique(table.scene_index[rows], return_inverse=True)
    scenes = tuple(table.scene_ids[scene] for scene in used)
    return dataclasses.replace(table.take(rows), scene_ids=scenes, scene_index=scene_index.astype(np.int32))


def _settings(header: JSONObject, default: NavMeshSettings, source: str) -> NavMeshSettings:
    stored = header.get("prnav", {}).get("navmesh") if isinstance(header.get("prnav"), dict) else None
    return from_mapping(NavMeshSettings, stored, source, "prnav.navmesh.") if isinstance(stored, dict) else default
