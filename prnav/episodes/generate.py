"""New episodes in a scene by Habitat's rules for PointNav.

The rules are those of habitat-lab's ``pointnav_generator``: a goal on an island of radius at least 1.5 m, up to ten
starts tried for each goal, a height difference of at most 0.5 m, a geodesic distance within limits, and near-straight
pairs (geodesic over Euclidean distance r < 1.1) kept only with probability 20 (r - 0.98)^2, which goes from 0.8 % at
r = 1 to 29 % at 1.1. The start's yaw is uniform.

Episodes are drawn in blocks of 64 lanes, each block from its own random stream and lane by lane the same numbers
whatever becomes of the other lanes. So episode i depends on the seed, the scene's id and i alone, not on how many
are asked for. Many blocks are at work at once, so that the compiled queries get long batches; and as a goal takes the
first start that fits, starts are tried one after another, those in plain sight of the goal without a search, because
their ratio is 1.

What comes before: :mod:`prnav.navmesh`. What comes after: :mod:`.table` (columns), :mod:`.bulk` (many scenes to files).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.episodes.episode import Episode
from prnav.episodes.table import EpisodeTable, concatenate_tables
from prnav.errors import EpisodeError
from prnav.frames import yaw_to_quaternion

if TYPE_CHECKING:
    from prnav.navmesh import NavMesh
    from prnav.navmesh.cover import IndoorFloors

Floats = NDArray[np.float64]

GENERATOR_VERSION = 1  #: raised when the same seed gives other episodes
BLOCK = 64  #: episodes that share a random stream
WIDTH = 2048  #: lanes that are at work at once, about
CHUNK = 128 * BLOCK  #: episodes that are drawn before the first of them are handed on
STRAIGHT = 1.001  #: a pair in plain sight has a smaller ratio than this


@dataclass(frozen=True)
class GenerationConfig:
    """Habitat's limits and defaults."""

    closest_dist_limit: float = 1.0  #: shortest geodesic distance [m]
    furthest_dist_limit: float = 30.0  #: longest geodesic distance [m]
    geodesic_to_euclid_min_ratio: float = 1.1  #: pairs below this ratio are thinned out
    number_retries_per_target: int = 10  #: starts tried for each goal
    island_radius_limit: float = 1.5  #: smallest radius of the island [m]
    max_height_difference: float = 0.5  #: between start and goal [m]
    max_targets: int = 500  #: goals tried for each episode before the scene is given up
    roofs: bool = False  #: whether roofs and open air get episodes where the scene has rooms (Habitat: yes)

    def __post_init__(self) -> None:
        """Refuse limits that no pair can meet."""
        if not 0.0 <= self.closest_dist_limit < self.furthest_dist_limit:
            raise ValueError(
                f"closest_dist_limit is {self.closest_dist_limit} and furthest_dist_limit {self.furthest_dist_limit}; "
                "they must be 0 <= closest < furthest"
            )
        if self.number_retries_per_target < 1 or self.max_targets < 1:
            raise ValueError("number_retries_per_target and max_targets must be at least 1")


def keep_probability(ratio: NDArray[np.float64], config: GenerationConfig) -> NDArray[np.float64]:
    """Probability with which a pair of this geodesic to Euclidean ratio is kept."""
    return np.where(ratio < config.geodesic_to_euclid_min_ratio, 20.0 * (ratio - 0.98) ** 2, 1.0)


def generate_episodes(
    navmesh: NavMesh,
    scene_id: str,
    count: int,
    seed: int,
    config: GenerationConfig = GenerationConfig(),  # noqa: B008 (frozen)
    progress: Callable[[int], object] | None = None,
) -> list[Episode]:
    """Episodes 0 .. count - 1 of a scene; see :func:`generate_table`."""
    return generate_table(navmesh, scene_id, count, seed, config, progress).to_episodes()


def generate_table(
    navmesh: NavMesh,
    scene_id: str,
    count: int,
    seed: int,
    config: GenerationConfig = GenerationConfig(),  # noqa: B008 (frozen)
    progress: Callable[[int], object] | None = None,
    floors: IndoorFloors | None = None,
) -> EpisodeTable:
    """Episodes 0 .. count - 1 of a scene as columns.

    Args:
        navmesh: the scene's floor.
        scene_id: name of the scene; part of the random stream.
        count: how many.
        seed: any integer >= 0.
        config: the limits.
        progress: called with the number of episodes done.
        floors: where starts and goals may be (:func:`prnav.navmesh.cover.indoor_floors`); everywhere by default.

    Raises:
        EpisodeError: the scene has no such pairs, or so few that drawing them takes too long.
    """
    tables = []
    for table in generate_chunks(navmesh, scene_id, count, seed, config, floors):
        tables.append(table)
        if progress is not None:
            progress(int(table.episode_ids[-1]) + 1)
    return concatenate_tables(tables)


def generate_chunks(
    navmesh: NavMesh,
    scene_id: str,
    count: int,
    seed: int,
    config: GenerationConfig = GenerationConfig(),  # noqa: B008 (frozen)
    floors: IndoorFloors | None = None,
) -> Iterator[EpisodeTable]:
    """:func:`generate_table` piece by piece, so that memory does not grow with ``count``.

    Raises:
        EpisodeError: as :func:`generate_table`.
    """
    if count < 1 or seed < 0:
        raise EpisodeError(f"asked for {count} episodes with seed {seed}; valid: at least 1, and a seed >= 0")
    radii = np.array([island.radius for island in navmesh.islands], dtype=np.float64)
    if not len(radii) or radii.max() < config.island_radius_limit:
        largest = f"{radii.max():.2f} m" if len(radii) else "none"
        raise EpisodeError(
            f"scene {scene_id}: its largest island has radius {largest}, episodes need "
            f"{config.island_radius_limit} m; check the scene's up axis and scale"
        )
    large = radii >= config.island_radius_limit
    if floors is not None and not config.roofs:
        large &= floors.islands
    else:
        floors = None
    for first in range(0, count, CHUNK):
        size = min(CHUNK, count - first)
        starts, goals, yaws, distances = _generate_rows(navmesh, scene_id, large, floors, seed, first, size, config)
        yield EpisodeTable(
            scene_ids=(scene_id,),
            scene_index=np.zeros(size, np.int32),
            episode_ids=np.arange(first, first + size).astype(np.str_),
            start_position=starts,
            start_rotation=yaw_to_quaternion(yaws),
            goal_position=goals,
            geodesic_distance=distances,
        )


def _generate_rows(
    navmesh: NavMesh,
    scene_id: str,
    large: NDArray[np.bool_],
    floors: IndoorFloors | None,
    seed: int,
    first: int,
    size: int,
    config: GenerationConfig,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Starts (size, 3), goals (size, 3), yaws (size,) and geodesic distances (size,) of episodes from ``first`` on.

    ``first`` is the first episode of a block. A lane is a row that has no episode yet.
    """
    tries = config.number_retries_per_target
    starts, goals = np.empty((size, 3)), np.empty((size, 3))
    yaws, distances = np.empty(size), np.empty(size)
    streams: dict[int, np.random.Generator] = {}
    lanes, targets = np.zeros(0, np.int64), np.zeros(size, np.int32)
    entered = 0
    while entered < size or len(lanes):
        while entered < size and len(lanes) < WIDTH:
            streams[entered // BLOCK] = _stream(scene_id, seed, (first + entered) // BLOCK)
            lanes = np.concatenate([lanes, np.arange(entered, min(entered + BLOCK, size))])
            entered += BLOCK
        numbers, luck = _draw(streams, lanes, tries)
        targets[lanes] += 1
        pick, start, goal, distance = _first_fit(navmesh, large, floors, numbers, luck[:, 1:], config)
        hit = pick >= 0
        rows = lanes[hit]
        starts[rows], goals[rows], distances[rows] = start[hit], goal[hit], distance[hit]
        yaws[rows] = 2.0 * np.pi * luck[hit, 0]
        lanes = lanes[~hit]
        if len(lanes) and targets[lanes[0]] >= config.max_targets:
            raise EpisodeError(
                f"scene {scene_id}: no start and goal for episode {first + lanes[0]} among {config.max_targets} goals "
                f"with {tries} starts each (geodesic {config.closest_dist_limit} to {config.furthest_dist_limit} m); "
                "the scene is too small or too open, ask for other limits or a larger scene"
            )
    return starts, goals, yaws, distances


def _stream(scene_id: str, seed: int, block: int) -> np.random.Generator:
    entropy = hashlib.sha256(f"{GENERATOR_VERSION}/{seed}/{block}/{scene_id}".encode()).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(entropy, "little")))


def _draw(streams: dict[int, np.random.Generator], lanes: NDArray[np.int64], tries: int) -> tuple[Floats, Floats]:
    """The next numbers of lanes: for a goal and its starts (n, 1 + tries, 3), and for luck (n, 1 + tries)."""
    numbers, luck = np.empty((len(lanes), 1 + tries, 3)), np.empty((len(lanes), 1 + tries))
    block, within = np.divmod(lanes, BLOCK)
    begin = np.flatnonzero(np.diff(block, prepend=-1))  # lanes are in order
    for low, high in zip(begin, [*begin[1:], len(lanes)], strict=True):
        stream = streams[int(block[low])]
        numbers[low:high] = stream.random((BLOCK, 1 + tries, 3))[within[low:high]]
        luck[low:high] = stream.random((BLOCK, 1 + tries))[within[low:high]]
    return numbers, luck


def _first_fit(
    navmesh: NavMesh,
    large: NDArray[np.bool_],
    floors: IndoorFloors | None,
    numbers: Floats,
    luck: Floats,
    config: GenerationConfig,
) -> tuple[NDArray[np.int64], Floats, Floats, Floats]:
    """For goals and starts drawn by ``numbers`` (n, 1 + tries, 3), the first start that fits its goal.

    Returns:
        Its number (n,), -1 for none; starts (n, 3), goals (n, 3) and geodesic distances (n,) where there is one.
    """
    count, tries = luck.shape
    goal = navmesh.locate(navmesh.place(numbers[:, 0]))
    pick, starts, distances = np.full(count, -1, np.int64), np.empty((count, 3)), np.empty(count)
    unlikely = luck > keep_probability(np.full(1, STRAIGHT), config)  # too bad for a pair in plain sight
    rows = np.flatnonzero((goal.islands >= 0) & large[goal.islands])
    if floors is not None:
        rows = rows[floors.fit(goal.points[rows], goal.islands[rows])]
    for k in range(tries):
        start = navmesh.locate(navmesh.place(numbers[rows, 1 + k]))
        offset = start.points - goal.points[rows]
        wanted = start.islands == goal.islands[rows]
        wanted &= np.abs(offset[:, 1]) <= config.max_height_difference
        wanted &= np.hypot(offset[:, 0], offset[:, 2]) <= config.furthest_dist_limit  # the path is no shorter
        doubtful = np.flatnonzero(wanted & unlikely[rows, k])
        wanted[doubtful] = ~navmesh.in_sight(start.take(doubtful), goal.take(rows[doubtful]))
        chosen = np.flatnonzero(wanted)
        distance = navmesh.located_distances(start.take(chosen), goal.take(rows[chosen]))
        good = (distance >= config.closest_dist_limit) & (distance <= config.furthest_dist_limit)
        euclid = np.maximum(np.linalg.norm(offset[chosen], axis=1), 1e-9)
        ratio = np.divide(distance, euclid, out=np.zeros_like(euclid), where=good)
        good &= luck[rows[chosen], k] <= keep_probability(ratio, config)
        if floors is not None:
            placed = np.flatnonzero(good)
            good[placed] = floors.fit(start.points[chosen[placed]], start.islands[chosen[placed]])
        fit = rows[chosen[good]]
        pick[fit], starts[fit], distances[fit] = k, start.points[chosen[good]], distance[good]
        rows = rows[pick[rows] < 0]
        if not len(rows):
            break
    return pick, starts, goal.points, distances
