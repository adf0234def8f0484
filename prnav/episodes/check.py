"""What is wrong with episodes: in themselves, and in the scenes they are to be played in."""

from __future__ import annotations

from collections import Counter

import numpy as np

from prnav.episodes.table import EpisodeTable
from prnav.navmesh import NavMesh

SNAP_TOLERANCE = 0.5  #: how far [m] a start or goal may be from the floor that it snaps to


def duplicate_ids(table: EpisodeTable) -> list[str]:
    """Ids that stand more than once in one scene, as lines of text."""
    counts = Counter(zip(table.scene_index.tolist(), table.episode_ids.tolist(), strict=True))
    return [
        f"{table.scene_ids[scene]}: episode id {episode_id!r} stands {count} times"
        for (scene, episode_id), count in counts.items()
        if count > 1
    ]


def misplaced(table: EpisodeTable, scene_id: str, navmesh: NavMesh) -> list[str]:
    """Episodes of a scene that cannot be played on its floor, as lines of text.

    A start or a goal that is farther than :data:`SNAP_TOLERANCE` from any floor, or a goal that cannot be reached.
    """
    rows = np.flatnonzero(table.scene_index == table.scene_ids.index(scene_id))
    starts, goals = table.start_position[rows], table.goal_position[rows]
    lines = []
    away = {}
    for name, points in (("start", starts), ("goal", goals)):
        away[name] = np.nan_to_num(np.linalg.norm(navmesh.snap(points) - points, axis=1), nan=np.inf)
    distances = navmesh.distances(starts, goals)
    for place, row in enumerate(rows):
        where = f"{scene_id}: episode {str(table.episode_ids[row])!r}"
        off = [name for name in ("start", "goal") if away[name][place] > SNAP_TOLERANCE]
        if off:
            lines.append(f"{where}: {' and '.join(off)} farther than {SNAP_TOLERANCE} m from the floor")
        elif not np.isfinite(distances[place]):
            lines.append(f"{where}: its goal cannot be reached from its start")
    return lines
