"""Episodes as arrays over the scenes of a world: what an environment draws from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.env.config import EnvConfig
from prnav.episodes import Episode, EpisodeDataset, load_builtin_episodes, load_episodes
from prnav.scene import scene_ids
from prnav.sim import World, load_world
from prnav.sim.world import Progress


@dataclass(frozen=True, eq=False)
class EpisodeTable:
    """E episodes in the scenes of one world."""

    world: World
    ids: tuple[tuple[str, str], ...]  #: (scene_id, episode_id)
    scene_index: NDArray[np.int64]  #: (E,)
    starts: NDArray[np.float64]  #: (E, 3) [m]
    yaws: NDArray[np.float64]  #: (E,) [rad]
    goals: NDArray[np.float64]  #: (E, 3) [m]

    def __len__(self) -> int:
        return len(self.ids)


def episode_table(world: World, episodes: Sequence[Episode]) -> EpisodeTable:
    """Arrays of episodes whose scenes are all in ``world``; of several goals the first counts."""
    return EpisodeTable(
        world=world,
        ids=tuple((episode.scene_id, episode.episode_id) for episode in episodes),
        scene_index=np.array([world.index[episode.scene_id] for episode in episodes], np.int64),
        starts=np.array([episode.start_position for episode in episodes], np.float64).reshape(-1, 3),
        yaws=np.array([episode.start_yaw for episode in episodes], np.float64),
        goals=np.array([episode.goals[0].position for episode in episodes], np.float64).reshape(-1, 3),
    )


def load_table(config: EnvConfig, progress: Progress | None = None) -> EpisodeTable:
    """World and episodes that a config asks for.

    Raises:
        EpisodeError: an episode file is broken, or names no episodes.
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor to walk on.
    """
    dataset = configured_episodes(config, progress)
    world = load_world(
        dataset.scene_ids,
        data_root=None if config.data_root is None else Path(config.data_root),
        scene_files=[Path(file) for file in config.scene_files],
        up=config.up,
        settings=config.navmesh,
        progress=progress,
    )
    return episode_table(world, dataset.episodes)


def configured_episodes(config: EnvConfig, progress: Progress | None = None) -> EpisodeDataset:
    """Episodes that a config asks for: from files, or the built-in ones."""
    if config.episodes is not None:
        return load_episodes(Path(config.episodes), config.episode_split)
    dataset = load_builtin_episodes(
        config.scenes,
        per_scene=config.episodes_per_scene,
        seed=config.episode_seed,
        max_scenes=config.max_scenes,
        progress=progress,
    )
    if config.max_scenes is None:
        return dataset
    kept = set(scene_ids(config.scenes)[: config.max_scenes])
    return EpisodeDataset(tuple(e for e in dataset.episodes if e.scene_id in kept), dataset.header)
