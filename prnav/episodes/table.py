"""Episodes as columns: what simulators read. Millions of rows cost bytes, not objects."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array, JSONObject, Untyped
from prnav.episodes.episode import Episode, EpisodeDataset, Goal
from prnav.episodes.files import episode_files, read_episode_file
from prnav.errors import EpisodeError
from prnav.frames import quaternion_to_yaw


@dataclass(frozen=True, eq=False)
class EpisodeTable:
    """M episodes of point-goal navigation, one goal each."""

    scene_ids: tuple[str, ...]  #: the scenes that scene_index counts
    scene_index: NDArray[np.int32]  #: (M,)
    episode_ids: NDArray[np.str_]  #: (M,)
    start_position: NDArray[np.float64]  #: (M, 3) [m]
    start_rotation: NDArray[np.float64]  #: (M, 4) unit quaternions x, y, z, w
    goal_position: NDArray[np.float64]  #: (M, 3) [m]
    geodesic_distance: NDArray[np.float64]  #: (M,) [m] as the file says; NaN where it does not

    def __len__(self) -> int:
        return len(self.scene_index)

    @property
    def start_yaw(self) -> NDArray[np.float64]:
        """Yaw of the starts, (M,) [rad]."""
        return quaternion_to_yaw(self.start_rotation)

    def scene_id(self, row: int) -> str:
        """Scene of one row."""
        return self.scene_ids[self.scene_index[row]]

    def take(self, rows: NDArray[np.integer[Untyped]]) -> EpisodeTable:
        """The table of some rows; scenes keep their numbers."""
        columns = {name: values[rows] for name, values in self.to_arrays().items()}
        return EpisodeTable(self.scene_ids, **columns)

    def to_arrays(self) -> dict[str, Array]:
        """The columns by name."""
        return {name: value for name, value in vars(self).items() if name != "scene_ids"}

    def to_episodes(self) -> list[Episode]:
        """The rows as objects."""
        return [self._episode(row) for row in range(len(self))]

    def _episode(self, row: int) -> Episode:
        distance = float(self.geodesic_distance[row])
        return Episode(
            episode_id=str(self.episode_ids[row]),
            scene_id=self.scene_id(row),
            start_position=tuple(self.start_position[row].tolist()),
            start_rotation=tuple(self.start_rotation[row].tolist()),
            goals=(Goal(tuple(self.goal_position[row].tolist())),),
            info={} if np.isnan(distance) else {"geodesic_distance": distance, "difficulty": difficulty(distance)},
        )

    def to_json(self) -> Iterator[str]:
        """The rows as JSON objects, the same text as of :meth:`to_episodes`, without the objects."""
        scenes = [json.dumps(scene_id) for scene_id in self.scene_ids]
        columns = (
            self.episode_ids.tolist(),
            self.scene_index.tolist(),
            self.start_position.tolist(),
            self.start_rotation.tolist(),
            self.goal_position.tolist(),
            self.geodesic_distance.tolist(),
        )
        for episode_id, scene, start, rotation, goal, distance in zip(*columns, strict=True):
            info = (
                ""
                if math.isnan(distance)
                else f'"geodesic_distance": {distance!r}, "difficulty": "{difficulty(distance)}"'
            )
            yield (
                f'{{"episode_id": {json.dumps(episode_id)}, "scene_id": {scenes[scene]}, "start_position": {start}, '
                f'"start_rotation": {rotation}, "info": {{{info}}}, "goals": [{{"position": {goal}, "radius": null}}]}}'
            )

    @classmethod
    def from_episodes(cls, episodes: Sequence[Episode], scene_ids: Sequence[str] | None = None) -> EpisodeTable:
        """Columns of episodes; ``scene_ids`` fixes the scenes' numbers.

        Raises:
            EpisodeError: an episode has several goals, or lies in none of ``scene_ids``.
        """
        if scene_ids is None:
            scene_ids = tuple(dict.fromkeys(episode.scene_id for episode in episodes))
        number = {scene_id: index for index, scene_id in enumerate(scene_ids)}
        for episode in episodes:
            if len(episode.goals) != 1:
                raise EpisodeError(
                    f"episode {episode.episode_id} in {episode.scene_id} has {len(episode.goals)} goals; "
                    "point-goal navigation takes exactly one"
                )
            if episode.scene_id not in number:
                raise EpisodeError(
                    f"episode {episode.episode_id} is in scene {episode.scene_id!r}, not among the scenes chosen"
                )
        return cls(
            scene_ids=tuple(scene_ids),
            scene_index=np.array([number[e.scene_id] for e in episodes], dtype=np.int32),
            episode_ids=np.array([e.episode_id for e in episodes], dtype=np.str_),
            start_position=np.array([e.start_position for e in episodes], dtype=np.float64).reshape(-1, 3),
            start_rotation=np.array([e.start_rotation for e in episodes], dtype=np.float64).reshape(-1, 4),
            goal_position=np.array([e.goals[0].position for e in episodes], dtype=np.float64).reshape(-1, 3),
            geodesic_distance=np.array([e.geodesic_distance for e in episodes], dtype=np.float64),
        )

    @classmethod
    def from_dataset(cls, dataset: EpisodeDataset, scene_ids: Sequence[str] | None = None) -> EpisodeTable:
        """Columns of a data set."""
        return cls.from_episodes(dataset.episodes, scene_ids)


def concatenate_tables(tables: Sequence[EpisodeTable]) -> EpisodeTable:
    """One table of several, rows in order; scenes are numbered by first appearance."""
    scene_ids = tuple(dict.fromkeys(scene_id for table in tables for scene_id in table.scene_ids))
    number = {scene_id: index for index, scene_id in enumerate(scene_ids)}
    columns: JSONObject = {
        name: np.concatenate([table.to_arrays()[name] for table in tables])
        for name in tables[0].to_arrays()
        if name != "scene_index"
    }
    scene_index = [np.array([number[s] for s in t.scene_ids], dtype=np.int32)[t.scene_index] for t in tables]
    return EpisodeTable(scene_ids=scene_ids, scene_index=np.concatenate(scene_index), **columns)


def load_episode_table(path: str | Path, split: str | None = None) -> tuple[EpisodeTable, JSONObject]:
    """Columns and header of a data set on disk, read file by file so that the objects never stand in memory at once.

    Raises:
        EpisodeError: as :func:`~prnav.episodes.files.load_episodes`.
    """
    header: JSONObject = {}
    tables = []
    for file in episode_files(path, split):
        file_header, episodes = read_episode_file(file)
        header = {**file_header, **header}
        if episodes:
            tables.append(EpisodeTable.from_episodes(episodes))
    if not tables:
        raise EpisodeError(f"{path}: holds no episodes; generate some with prnav-episodes generate")
    return concatenate_tables(tables), header


DIFFICULTIES: Mapping[str, float] = {"easy": 6.0, "medium": 8.0}
"""Upper ends [m] of the distances that Habitat's Gibson PointNav files call easy and medium; hard is beyond."""


def difficulty(distance: float) -> str:
    """Habitat's word for a geodesic distance [m]."""
    return next((name for name, end in DIFFICULTIES.items() if distance < end), "hard")
