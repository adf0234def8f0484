"""New episodes in a scene by Habitat's rules for PointNav.

The rules are those of habitat-lab's ``pointnav_generator``: a goal on an island of radius at least 1.5 m, up to ten
starts tried for each goal, a height difference of at most 0.5 m, a geodesic distance within limits, and near-straight
pairs (geodesic over Euclidean distance r < 1.1) kept only with probability 20 (r - 0.98)^2, which goes from 0.8 % at
r = 1 to 29 % at 1.1. The start's yaw is uniform.

Episodes are drawn in blocks of 64 lanes, each block from its own random stream and lane by lane the same numbers
whatever becomes of the other lanes. So episode i depends on the seed, the scene's id and i alone, not on how many
are asked for.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.episodes.episode import Episode
from prnav.episodes.table import EpisodeTable
from prnav.errors import EpisodeError
from prnav.frames import yaw_to_quaternion

if TYPE_CHECKING:
    from prnav.navmesh import NavMesh

GENERATOR_VERSION = 1  #: raised when the same seed gives other episodes
BLOCK = 64  #: episodes that share a random stream


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
) -> EpisodeTable:
    """Episodes 0 .. count - 1 of a scene as columns.

    Args:
        navmesh: the scene's floor.
        scene_id: name of the scene; part of the random stream.
        count: how many.
        seed: any integer >= 0.
        config: the limits.
        progress: called with the number of episodes done.

    Raises:
        EpisodeError: the scene has no such pairs, or so few that drawing them takes too long.
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
    blocks = []
    for block in range(-(-count // BLOCK)):
        lanes = min(BLOCK, count - block * BLOCK)
        blocks.append(_generate_block(navmesh, scene_id, radii, seed, block, lanes, config))
        if progress is not None:
            progress(block * BLOCK + lanes)
    starts, goals, yaws, distances = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    return EpisodeTable(
        scene_ids=(scene_id,),
        scene_index=np.zeros(count, np.int32),
        episode_ids=np.arange(count).astype(np.str_),
        start_position=starts,
        start_rotation=yaw_to_quaternion(yaws),
        goal_position=goals,
        geodesic_distance=distances,
    )


def _generate_block(
    navmesh: NavMesh,
    scene_id: str,
    radii: NDArray[np.float64],
    seed: int,
    block: int,
    lanes: int,
    config: GenerationConfig,
) -> tuple[NDArray[np.float64], ...]:
    """Starts (lanes, 3), goals (lanes, 3), yaws (lanes,) and geodesic distances (lanes,) of a block's first lanes."""
    entropy = hashlib.sha256(f"{GENERATOR_VERSION}/{seed}/{block}/{scene_id}".encode()).digest()
    generator = np.random.Generator(np.random.PCG64(int.from_bytes(entropy, "little")))
    tries = config.number_retries_per_target
    starts, goals = np.empty((lanes, 3)), np.empty((lanes, 3))
    yaws, distances = np.empty(lanes), np.empty(lanes)
    open_lanes = np.arange(lanes)
    for _ in range(config.max_targets):
        points = navmesh.random_points(BLOCK * (1 + tries), generator).reshape(BLOCK, 1 + tries, 3)[open_lanes]
        luck = generator.random((BLOCK, 1 + tries))[open_lanes]
        target, sources = points[:, 0], points[:, 1:]
        separation = _separations(navmesh, target, sources, radii, config)
        euclid = np.maximum(np.linalg.norm(sources - target[:, None], axis=2), 1e-9)
        good = np.isfinite(separation)
        ratio = np.divide(separation, euclid, out=np.zeros_like(euclid), where=good)
        good &= luck[:, 1:] <= keep_probability(ratio, config)
        first = good.argmax(axis=1)
        hit = np.flatnonzero(good.any(axis=1))
        lane, pick = open_lanes[hit], first[hit]
        starts[lane], goals[lane] = sources[hit, pick], target[hit]
        distances[lane], yaws[lane] = separation[hit, pick], 2.0 * np.pi * luck[hit, 0]
        open_lanes = np.delete(open_lanes, hit)
        if not len(open_lanes):
            return starts, goals, yaws, distances
    raise EpisodeError(
        f"scene {scene_id}: no start and goal for episode {block * BLOCK + open_lanes[0]} among {config.max_targets} "
        f"goals with {tries} starts each (geodesic {config.closest_dist_limit} to {config.furthest_dist_limit} m); "
        "the scene is too small or too open, ask for other limits or a larger scene"
    )


def _separations(
    navmesh: NavMesh,
    target: NDArray[np.float64],
    sources: NDArray[np.float64],
    radii: NDArray[np.float64],
    config: GenerationConfig,
) -> NDArray[np.float64]:
    """Geodesic distance of each target to its sources, (lanes, tries) [m]; inf where a rule excludes the pair."""
    lanes, tries, _ = sources.shape
    islands = navmesh.island_of(np.concatenate([target, sources.reshape(-1, 3)]))
    goal_island, source_island = islands[:lanes, None], islands[lanes:].reshape(lanes, tries)
    offset = sources - target[:, None]
    wanted = (goal_island == source_island) & (goal_island >= 0)
    wanted &= radii[goal_island] >= config.island_radius_limit
    wanted &= np.abs(offset[..., 1]) <= config.max_height_difference
    wanted &= np.hypot(offset[..., 0], offset[..., 2]) <= config.furthest_dist_limit  # the path is no shorter
    result = np.full((lanes, tries), np.inf)
    lane, source = np.nonzero(wanted)
    if len(lane):
        distance = navmesh.distances(sources[lane, source], target[lane])
        inside = (distance >= config.closest_dist_limit) & (distance <= config.furthest_dist_limit)
        result[lane, source] = np.where(inside, distance, np.inf)
    return result
