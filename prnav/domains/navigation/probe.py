"""A cheap score for designs: how much of what an agent needs to know can be read off its photoreceptors.

The paper (appendix, "Can photoreceptors extract information about the world state?") regresses the state from the
readings of a design and finds that R^2 goes with the reward. Here, at places drawn once and shared by all designs:

- "free": how far one can walk in each of D directions around the agent (the way is clear, or a wall is near);
- "way": the bearing of the next turning point on the shortest path to a goal whose distance and bearing are given as
  they are to the agent: what the oracle knows and, where the straight way is blocked, the goal alone does not say;
- "target": bearing and distance of a green sphere in sight, as a task has it that shows one;
- "pose": position and heading in homes that the regression knows.

All but "pose" are tested in homes that the regression has not seen. The score of a design is the weighted mean of
their R^2. Same settings, same bits. N places, S homes, D directions, T regressed numbers, H features.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.checks import require_at_least
from prnav.contracts import Progress
from prnav.domains.navigation.env.settings import SensorSettings
from prnav.domains.navigation.light import Light, Viewpoints
from prnav.frames import wrap_angle, yaw_towards
from prnav.navmesh import GoalFields
from prnav.regression import fit_and_test
from prnav.sensors import Design, pointgoal, theta_to_pose
from prnav.sim import World, load_world
from prnav.splitmix import splitmix64

Float64 = NDArray[np.float64]

STUCK_WITHIN, STUCK_TURN = 0.6, math.pi / 3
"""How near to what stops it [m] an agent that is stuck stands at most, and how far from its goal it looks [rad]."""


@dataclass(frozen=True)
class ProxyConfig:
    """Places, what is regressed, and how."""

    homes: int = 24
    """Homes of the training split; every fourth is held out."""
    places: int = 6000
    """Places in all homes together."""
    pose_homes: int = 4
    """Homes for "pose", with ``pose_places`` places each, every fourth held out."""
    pose_places: int = 400
    goals: int = 8
    """Goals per home for "way"."""
    directions: int = 12
    """Directions D of "free", and of the sphere."""
    stuck: float = 0.0
    """Share of the places that lie where an agent that goes straight for its goal is stopped, and look that way: there
    the goal alone does not say what to do. The others are even over the homes and look anywhere."""
    front_deg: float = 180.0
    """How far from straight ahead they go [degrees]; 180 is all around, ahead first and then left."""
    reach: float = 3.0
    """How far "free" and the sphere of "target" go [m]."""
    sphere_radius: float = 0.5
    """[m]"""
    sphere_height: float = 1.5
    """Of the sphere's centre above the floor [m]."""
    rays_per_receptor: int = 4
    features: int = 512
    """Random features of the regression (ridge on rectified random projections, Rahimi and Recht 2008)."""
    free: float = 1.0
    """Weight of "free" in the score."""
    way: float = 1.0
    target: float = 0.0
    pose: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        require_at_least(self, 1, "places", "pose_places", "goals", "directions", "features", "rays_per_receptor")
        if not 0.0 <= self.stuck <= 1.0:
            raise ValueError(f"stuck is {self.stuck}; it must lie within 0 to 1")
        if not 0.0 < self.front_deg <= 180.0:
            raise ValueError(f"front_deg is {self.front_deg}; it must lie above 0 and at most be 180")
        if self.homes < 4:
            raise ValueError(f"homes is {self.homes}; it must be at least 4, since every fourth is held out")
        if not 1 <= self.pose_homes <= self.homes:
            raise ValueError(f"pose_homes is {self.pose_homes}; it must lie within 1 and homes ({self.homes})")
        weights = [self.free, self.way, self.target, self.pose]
        if min(weights) < 0.0 or not sum(weights) > 0.0:
            raise ValueError(f"weights of free, way, target and pose are {weights}; they must be 0 or more, not all 0")

    @property
    def cost_steps(self) -> int:
        """Readings that a design's score takes: what a search on it spends in simulation steps."""
        both = self.places * (int(self.free + self.way > 0) + int(self.target > 0))
        return both + (self.pose_homes * self.pose_places if self.pose else 0)

    @property
    def bearings(self) -> Float64:
        """Directions relative to the heading [rad], positive left, (D,)."""
        if self.front_deg == 180.0:
            return 2.0 * math.pi * np.arange(self.directions) / self.directions
        return np.radians(np.linspace(self.front_deg, -self.front_deg, self.directions))


@dataclass(frozen=True, eq=False)
class Places:
    """Where agents stand and look, and what is true there."""

    scenes: NDArray[np.int64]
    """(N,)."""
    positions: Float64
    """(N, 3) [m]."""
    yaws: Float64
    """(N,) [rad]."""
    free: Float64
    """Distance one can walk in each direction, logarithm of 0.1 m and it, (N, D)."""
    goals: Float64
    """Distance and bearing of a goal, as agents are told: features (N, 4)."""
    way: Float64
    """Sine and cosine of the bearing of the next turning point towards it, (N, 2)."""
    spheres: Float64
    """Centre and radius [m] of the sphere, (N, 4)."""
    target: Float64
    """Sine, cosine of its bearing and its distance [m], (N, 3)."""


class Proxy:
    """Scores designs on one set of places."""

    def __init__(self, config: ProxyConfig, world: World, sensing: SensorSettings = SensorSettings()) -> None:  # noqa: B008 (frozen)
        """Proxy in the homes of ``world``; ``sensing`` says what renders and what readout does to light."""
        self.config, self.world = config, world
        self.light = Light(world.scenes, sensing, config.rays_per_receptor)

    @classmethod
    def load(
        cls,
        config: ProxyConfig,
        progress: Progress | None = None,
        sensing: SensorSettings = SensorSettings(),  # noqa: B008 (frozen)
    ) -> Proxy:
        """Proxy in built-in training homes.

        Raises:
            SceneError: there are fewer.
        """
        from prnav.scene import scene_ids

        return cls(config, load_world(scene_ids("train")[: config.homes], progress=progress), sensing)

    def score(self, design: Design, theta: ArrayLike | None = None) -> float:
        """Weighted mean of the parts' R^2 for ``design``, or for theta (K, 7) around it; at most 1."""
        return self.weighted(self.parts(design, theta))

    def weighted(self, parts: Mapping[str, float]) -> float:
        """Mean of parts by their weights."""
        config = self.config
        weights = {"free": config.free, "way": config.way, "target": config.target, "pose": config.pose}
        return sum(weights[name] * value for name, value in parts.items()) / sum(weights[name] for name in parts)

    def parts(self, design: Design, theta: ArrayLike | None = None) -> dict[str, float]:
        """R^2 of each part that has a weight, means over its numbers."""
        poses = design.sensors if theta is None else theta_to_pose(theta, design)
        config, places = self.config, self.places
        held_out = places.scenes % 4 == 3
        result = {}
        if config.free or config.way:
            readings = self._read(poses, design.grid, places)
            inputs = np.concatenate([readings, places.goals], axis=1)
            truth = np.concatenate([places.free, places.way], axis=1)
            scores = fit_and_test(inputs, truth, held_out, places.scenes, config.features, config.seed)
            if config.free:
                result["free"] = float(scores[: config.directions].mean())
            if config.way:
                result["way"] = float(scores[config.directions :].mean())
        if config.target:
            readings = self._read(poses, design.grid, places, places.spheres)
            scores = fit_and_test(readings, places.target, held_out, places.scenes, config.features, config.seed)
            result["target"] = float(scores.mean())
        if config.pose:
            result["pose"] = self._pose(poses, design.grid)
        return result

    def blind(self) -> dict[str, float]:
        """The same without readings: what the goal alone tells."""
        places = self.places
        truth = np.concatenate([places.free, places.way], axis=1)
        held_out = places.scenes % 4 == 3
        scores = fit_and_test(places.goals, truth, held_out, places.scenes, self.config.features, self.config.seed)
        return {
            "free": float(scores[: self.config.directions].mean()),
            "way": float(scores[self.config.directions :].mean()),
        }

    @cached_property
    def places(self) -> Places:
        """Places in all homes, drawn on first use."""
        return draw_places(self.world, self.config)

    @cached_property
    def _poses(self) -> tuple[NDArray[np.int64], Float64, Float64]:
        config = self.config
        count = config.pose_places
        rng = np.random.Generator(np.random.PCG64([config.seed, 1]))
        homes = range(config.pose_homes)
        points = [self.world.navmeshes[home].random_points(count, config.seed * 1000 + 500 + home) for home in homes]
        yaws = rng.uniform(-math.pi, math.pi, count * len(homes))
        return np.repeat(homes, count), np.concatenate(points), yaws

    def _pose(self, poses: Float64, grid: int) -> float:
        scenes, points, yaws = self._poses
        readings = self._light(scenes, points, yaws, poses, grid, None)
        truth = np.stack([points[:, 0], points[:, 2], np.sin(yaws), np.cos(yaws)], axis=1)
        scores = []
        for home in range(self.config.pose_homes):
            rows = scenes == home
            order = np.arange(rows.sum())
            scores.append(
                fit_and_test(readings[rows], truth[rows], order % 4 == 3, order, self.config.features, self.config.seed)
            )
        return float(np.mean(scores))

    def _read(self, poses: Float64, grid: int, places: Places, spheres: Float64 | None = None) -> Float64:
        return self._light(places.scenes, places.positions, places.yaws, poses, grid, spheres)

    def _light(
        self,
        scenes: NDArray[np.int64],
        positions: Float64,
        yaws: Float64,
        poses: Float64,
        grid: int,
        spheres: Float64 | None,
    ) -> Float64:
        count = len(yaws)
        designs = np.broadcast_to(poses, (count, *poses.shape))
        places = np.arange(count)  # noise differs from place to place and is the same for all designs
        at = Viewpoints(scenes, positions, yaws, designs, spheres, self._keys(places), np.zeros(count, np.int64))
        readings = self.light.readings(at, grid)
        return readings.reshape(count, -1).astype(np.float64)

    def _keys(self, places: NDArray[np.int64]) -> NDArray[np.uint64]:
        """Keys (N,) of the noise at places (N,)."""
        seeds = np.full(len(places), self.light.readout.seed, np.uint64)
        return splitmix64(seeds, places.astype(np.uint64))


def draw_places(world: World, config: ProxyConfig) -> Places:
    """Places in the homes of ``world``, and what is true there.

    Those without a way to their goal are left out, and those meant to be stuck that nothing stops.
    """
    homes, per_home = len(world.scenes), -(-config.places // len(world.scenes))
    rng = np.random.Generator(np.random.PCG64(config.seed))
    scenes = np.repeat(np.arange(homes), per_home)
    points = [navmesh.random_points(per_home, config.seed * 1000 + i) for i, navmesh in enumerate(world.navmeshes)]
    goals = [
        navmesh.random_points(config.goals, config.seed * 1000 + 900 + i) for i, navmesh in enumerate(world.navmeshes)
    ]
    positions = np.concatenate(points)
    yaws = rng.uniform(-math.pi, math.pi, len(scenes))
    goal = rng.integers(0, config.goals, len(scenes))
    direction = rng.integers(0, config.directions, len(scenes))
    share = rng.uniform(0.3, 1.0, len(scenes))
    meant = np.concatenate(goals)[scenes * config.goals + goal]
    kept = np.full(len(scenes), True)
    if config.stuck:
        rows = np.flatnonzero(rng.random(len(scenes)) < config.stuck)
        turned = rng.uniform(-STUCK_TURN, STUCK_TURN, len(rows))
        positions[rows], kept[rows] = _stopped(
            world, scenes[rows], positions[rows], meant[rows], rng.uniform(0.0, STUCK_WITHIN, len(rows))
        )
        yaws[rows] = wrap_angle(yaw_towards(meant[rows] - positions[rows]) + turned)

    fields = GoalFields(world.navmesh_set, homes * config.goals)
    slots = np.arange(homes * config.goals)
    fields.prepare(slots, slots // config.goals, np.concatenate(goals))
    distance, corner = fields.query(scenes * config.goals + goal, positions)
    away = pointgoal(positions, yaws, meant).astype(np.float64)
    turn = pointgoal(positions, yaws, np.where(np.isfinite(corner), corner, 0.0))[:, 1].astype(np.float64)

    free = _free_distances(world, scenes, positions, yaws, config)
    bearing = config.bearings[direction]
    far = np.maximum(0.8, share * free[np.arange(len(free)), direction])
    heading = yaws + bearing
    ahead = np.stack([-np.sin(heading), np.full(len(heading), 0.0), -np.cos(heading)], axis=1)
    centre = positions + far[:, None] * ahead + [0.0, config.sphere_height, 0.0]
    spheres = np.concatenate([centre, np.full((len(centre), 1), config.sphere_radius)], axis=1)
    kept &= np.isfinite(distance) & (distance > 0.3)
    return Places(
        scenes=scenes[kept],
        positions=positions[kept],
        yaws=yaws[kept],
        free=np.log(0.1 + free[kept]),
        goals=np.stack([np.log1p(away[:, 0]), np.exp(-2.0 * away[:, 0]), np.sin(away[:, 1]), np.cos(away[:, 1])], 1)[
            kept
        ],
        way=np.stack([np.sin(turn), np.cos(turn)], axis=1)[kept],
        spheres=spheres[kept],
        target=np.stack([np.sin(bearing), np.cos(bearing), far], axis=1)[kept],
    )


def _stopped(
    world: World, scenes: NDArray[np.int64], starts: Float64, goals: Float64, short: Float64
) -> tuple[Float64, NDArray[np.bool_]]:
    """Where walks straight from ``starts`` (n, 3) to ``goals`` are stopped, less ``short`` (n,) [m]; and which are."""
    ends, _ = world.navmesh_set.step(scenes, starts, goals, sliding=False)
    walked = np.linalg.norm((ends - starts)[:, [0, 2]], axis=1)
    left = np.linalg.norm((goals - ends)[:, [0, 2]], axis=1)
    share = np.maximum(0.0, walked - short) / np.maximum(walked, 1e-9)
    return starts + share[:, None] * (ends - starts), left > 0.05


def _free_distances(
    world: World, scenes: NDArray[np.int64], positions: Float64, yaws: Float64, config: ProxyConfig
) -> Float64:
    """How far one can walk straight in each direction, at most ``reach``, (N, D) [m]."""
    count = config.directions
    heading = yaws[:, None] + config.bearings
    ahead = np.stack([-np.sin(heading), np.zeros_like(heading), -np.cos(heading)], axis=-1)
    starts = np.repeat(positions, count, axis=0)
    ends = starts + config.reach * ahead.reshape(-1, 3)
    stops, _ = world.navmesh_set.step(np.repeat(scenes, count), starts, ends, sliding=False)
    return np.linalg.norm((stops - starts)[:, [0, 2]], axis=1).reshape(-1, count)


@dataclass(frozen=True)
class NavigationProbe:
    """A :class:`prnav.contracts.ProbeSpec` in built-in homes."""

    config_type: type[ProxyConfig] = ProxyConfig

    def load(self, config: ProxyConfig, env: SensorSettings, progress: Progress | None = None) -> Proxy:
        """The proxy in built-in training homes, whatever the environment's scenes are; it sees as ``env`` says."""
        return Proxy.load(config, progress, env)
