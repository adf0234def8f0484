"""A navigation task over N slots, each playing one episode at a time: the core that every environment is a layer on.

There is no reset on its own here: :meth:`NavigationSlots.begin` puts a slot at an episode's start. All arrays have the
slots on the first axis; nothing loops over them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource
from prnav.domains.navigation.env.spaces import action_spec, observation_specs
from prnav.domains.navigation.measures import soft_spl, spl
from prnav.domains.navigation.oracle import shortest_path_actions
from prnav.errors import DesignError, EpisodeError
from prnav.navmesh import GoalFields
from prnav.render import Renderer
from prnav.sensors import compass, gps, load_design, pointgoal, theta_to_pose
from prnav.sim import FORWARD, HOLD, STOP, Simulator

Observations = dict[str, NDArray[Any]]
"""float32, but for pictures, which are bytes."""

_STATE = (
    "episode",
    "steps",
    "path_length",
    "collisions",
    "total_reward",
    "shortest",
    "distance",
    "closest",
    "success",
    "theta",
)
"""Arrays that, with the simulator's, say everything about the slots."""


class NavigationSlots:
    """N agents playing episodes of a source; what happens in one slot depends on its episode and actions alone."""

    def __init__(self, source: EpisodeSource, num_slots: int, config: NavigationConfig):
        if not len(source):
            raise EpisodeError("there are no episodes to play; generate some with prnav-episodes generate")
        self.source = source
        self.config = config
        self.rules, self.kind = config.rules, config.kind
        self.first_action = STOP if config.kind.has_stop else FORWARD
        """The simulator's number of the task's action 0."""
        self.num_slots = num_slots
        self.design = load_design(config.design)
        self.num_sensors = len(self.design.sensors)
        self.simulator = Simulator(source.world, num_slots, config.sim)
        self.fields = GoalFields(source.world.navmesh_set, num_slots)
        self.renderer = (
            Renderer(source.world.scenes, engine=config.engine, rays_per_receptor=config.rays_per_receptor)
            if config.vision
            else None
        )
        self.episode = np.full(num_slots, -1, np.int64)  #: index into the source, -1 before the first
        self.steps = np.zeros(num_slots, np.int64)
        self.path_length = np.zeros(num_slots)
        self.collisions = np.zeros(num_slots, np.int64)
        self.total_reward = np.zeros(num_slots)
        self.shortest = np.zeros(num_slots)  #: geodesic distance from start to goal [m]
        self.distance = np.zeros(num_slots)  #: geodesic distance to the goal [m]
        self.closest = np.zeros(num_slots)  #: smallest such distance so far [m]
        self.success = np.zeros(num_slots, np.bool_)
        self.theta = np.zeros((num_slots, self.num_sensors, 7))  #: normalised designs
        self.poses = theta_to_pose(self.theta, self.design)  #: the same as sensor poses on the body
        self.actions = np.full(num_slots, HOLD, np.int64)  #: of the last step, as the simulator numbers them
        self.rewards = np.zeros(num_slots)  #: of the last step
        self.terminated = np.zeros(num_slots, np.bool_)
        self.truncated = np.zeros(num_slots, np.bool_)

    @property
    def observation_specs(self) -> dict[str, ObservationSpec]:
        """What one agent is shown, by name."""
        return observation_specs(self.config, self.num_sensors)

    @property
    def action_spec(self) -> DiscreteActions:
        """What one agent can do."""
        return action_spec(self.config)

    @property
    def episode_ids(self) -> tuple[tuple[str, str], ...]:
        """(scene_id, episode_id) of every episode of the source."""
        return self.source.ids

    @property
    def positions(self) -> NDArray[np.float64]:
        """Where the agents stand [m], (N, 3)."""
        return self.simulator.positions

    @property
    def yaws(self) -> NDArray[np.float64]:
        """Where they look [rad], (N,)."""
        return self.simulator.yaws

    @property
    def collided(self) -> NDArray[np.bool_]:
        """Whether their last step hit something, (N,)."""
        return self.simulator.collided

    def begin(self, slots: ArrayLike, episodes: ArrayLike, theta: ArrayLike | None = None) -> None:
        """Put slots (n,) at the starts of episodes (n,), with normalised designs (n, K, 7) if given.

        Raises:
            EpisodeError: a goal cannot be reached from its start on this navmesh.
            DesignError: a design has the wrong shape or is not finite.
        """
        slots, episodes = np.asarray(slots, np.int64), np.asarray(episodes, np.int64)
        if not len(slots):
            return
        if theta is not None:
            self._set_theta(slots, theta)
        source = self.source
        self.episode[slots] = episodes
        self.simulator.reset(slots, source.scene_index[episodes], source.starts[episodes], source.yaws[episodes])
        self.fields.prepare(slots, source.scene_index[episodes], source.goals[episodes])
        distance, _ = self.fields.query(slots, source.starts[episodes])
        lost = np.flatnonzero(~np.isfinite(distance))
        if len(lost):
            scene, episode = source.id(episodes[lost[0]])
            raise EpisodeError(
                f"episode {episode} of scene {scene}: its goal cannot be reached from its start on this navmesh; "
                "check the scene's up axis and navmesh settings, or remove it (prnav-episodes check finds all such)"
            )
        for array in (self.steps, self.path_length, self.collisions, self.total_reward, self.success):
            array[slots] = 0
        for array in (self.shortest, self.distance, self.closest):
            array[slots] = distance
        self.terminated[slots] = self.truncated[slots] = False

    def advance(self, actions: ArrayLike, acting: ArrayLike | None = None) -> NDArray[np.bool_]:
        """Take one step in each slot, or in those where ``acting`` (N,); True where the episode ended, (N,).

        Actions are numbered as the task does.
        """
        moves = np.asarray(actions, np.int64) + self.first_action
        return self._move(moves if acting is None else np.where(acting, moves, HOLD))

    def _move(self, actions: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Take one step in each slot, none where the action is HOLD; actions are numbered as the simulator does."""
        self.actions = actions
        acting = actions != HOLD
        self.path_length += self.simulator.step(actions)
        self.collisions += acting & self.simulator.collided
        self.steps += acting
        before = self.distance
        moving = np.flatnonzero(acting)
        after = before.copy()
        after[moving] = self.fields.query(moving, self.simulator.positions[moving])[0]
        verdict = self.kind.judge(self.rules, actions == STOP, before, after)
        self.success = np.where(acting, verdict.success, self.success)
        self.rewards = np.where(acting, verdict.rewards, 0.0)
        self.total_reward += self.rewards
        self.distance = after
        self.closest = np.minimum(self.closest, after)
        self.terminated = acting & verdict.terminated
        self.truncated = acting & ~self.terminated & (self.steps >= self.rules.max_steps)
        return self.terminated | self.truncated

    def observe(self, slots: ArrayLike | None = None) -> Observations:
        """Observations of slots (n,), all of them by default: new arrays, each (n, ...)."""
        rows = np.arange(self.num_slots) if slots is None else np.asarray(slots, np.int64)
        episodes = self.episode[rows]
        positions, yaws = self.positions[rows], self.yaws[rows]
        starts, start_yaws = self.source.starts[episodes], self.source.yaws[episodes]
        observations: Observations = {
            "design": self.theta[rows].astype(np.float32),
            "gps": gps(positions, starts, start_yaws),
            "compass": compass(yaws, start_yaws)[:, None],
        }
        if self.kind.shows_goal:
            observations["pointgoal"] = pointgoal(positions, yaws, self.source.goals[episodes])
        if self.renderer is not None:
            if self.config.camera_size:
                observations["camera"] = as_bytes(self.picture(episodes, positions, yaws, self.poses[rows]))
            else:
                observations["photoreceptors"] = self.read(episodes, positions, yaws, self.poses[rows])
        return observations

    def read(
        self,
        episodes: NDArray[np.int64],
        positions: NDArray[np.float64],
        yaws: NDArray[np.float64],
        poses: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """What receptors read in episodes (n,) at positions (n, 3) [m] and yaws (n,), (n, K, B*B, 3), 0 to 1.

        Sensor poses (n, K, 7) are on the body; a visible target is there.
        """
        assert self.renderer is not None
        scenes, balls = self.source.scene_index[episodes], self._targets(episodes)
        readings = self.renderer.read(scenes, positions, yaws, poses, grid=self.config.grid, spheres=balls)
        return readings.reshape(len(episodes), poses.shape[1], -1, 3)

    def picture(
        self,
        episodes: NDArray[np.int64],
        positions: NDArray[np.float64],
        yaws: NDArray[np.float64],
        poses: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """What cameras see, as :meth:`read`: (n, K, H, W, 3), 0 to 1."""
        assert self.renderer is not None
        scenes, balls = self.source.scene_index[episodes], self._targets(episodes)
        return self.renderer.image(scenes, positions, yaws, poses, size=self.config.camera_size, spheres=balls)

    def _targets(self, episodes: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """Spheres (n, 4) that are there to be seen in episodes (n,)."""
        spheres = self.kind.spheres
        return None if spheres is None else spheres(self.source.goals[episodes], self.rules)

    def expert_actions(self) -> NDArray[np.int64]:
        """The shortest-path follower's action in every slot, (N,), as the task numbers them.

        One that the task lacks (stop at the target), or that of a slot without an episode, becomes action 0.
        """
        actions = np.full(self.num_slots, HOLD, np.int64)
        playing = np.flatnonzero(self.episode >= 0)
        reach = self.rules.success_distance
        actions[playing] = shortest_path_actions(self.simulator, self.fields, playing, reach)
        return np.maximum(actions, self.first_action) - self.first_action

    def state(self, slots: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """Where slots (n,) are: positions [m] (n, 3) and yaws [rad] (n,)."""
        return {"positions": self.positions[slots].copy(), "yaws": self.yaws[slots].copy()}

    def events(self, slots: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """The last actions of slots (n,), as the simulator numbers them, and whether they hit something."""
        return {"actions": self.actions[slots].astype(np.int8), "collisions": self.collided[slots].copy()}

    def measures(self, slots: ArrayLike | None = None) -> dict[str, NDArray[np.float64]]:
        """Measures of slots (n,) so far, each (n,) float64; final once the episode has ended."""
        rows = np.arange(self.num_slots) if slots is None else np.asarray(slots, np.int64)
        shortest, taken = self.shortest[rows], self.path_length[rows]
        values = {
            "success": self.success[rows],
            "spl": spl(self.success[rows], shortest, taken),
            "soft_spl": soft_spl(self.distance[rows], shortest, taken),
            "soft_spl_closest": soft_spl(self.closest[rows], shortest, taken),
            "distance_to_goal": self.distance[rows],
            "closest_distance": self.closest[rows],
            "collisions": self.collisions[rows],
            "path_length": taken,
            "steps": self.steps[rows],
            "reward": self.total_reward[rows],
            "geodesic_distance": shortest,
        }
        return {name: np.asarray(value, np.float64) for name, value in values.items()}

    def outcome(self, slot: int) -> dict[str, Any]:
        """Measures and facts of one slot's episode, as plain numbers and strings."""
        scene_id, episode_id = self.source.id(self.episode[slot])
        row: dict[str, Any] = {"scene_id": scene_id, "episode_id": episode_id}
        row.update({name: float(value[0]) for name, value in self.measures([slot]).items()})
        for name in ("success", "collisions", "steps"):
            row[name] = int(row[name])
        return row

    def set_designs(self, slots: ArrayLike, theta: ArrayLike) -> None:
        """Give slots (n,) normalised designs (n, K, 7) from now on.

        Raises:
            DesignError: the shape is wrong, or a number is not finite.
        """
        self._set_theta(np.asarray(slots, np.int64), theta)

    def _set_theta(self, slots: NDArray[np.int64], theta: ArrayLike) -> None:
        values = self.checked_theta(len(slots), theta)
        self.theta[slots] = values
        self.poses[slots] = theta_to_pose(values, self.design)

    def checked_theta(self, count: int, theta: ArrayLike) -> NDArray[np.float64]:
        """``count`` normalised designs (count, K, 7).

        Raises:
            DesignError: the shape is wrong, or a number is not finite.
        """
        values = np.asarray(theta, np.float64)
        want = (count, self.num_sensors, 7)
        if values.shape != want:
            raise DesignError(f"designs have shape {values.shape}; for this environment it must be {want}")
        if not np.isfinite(values).all():
            raise DesignError("a design holds numbers that are not finite; all 7 entries of each sensor must be finite")
        return values

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Copies of all arrays that :meth:`restore` needs to go on exactly here."""
        state = {name: getattr(self, name).copy() for name in _STATE}
        return {**state, **{f"sim_{name}": value for name, value in self.simulator.snapshot().items()}}

    def restore(self, state: dict[str, NDArray[Any]]) -> None:
        """Go on where :meth:`snapshot` was called; the source must be the same."""
        for name in _STATE:
            setattr(self, name, np.array(state[name], dtype=getattr(self, name).dtype))
        self.simulator.restore({name[4:]: value for name, value in state.items() if name.startswith("sim_")})
        self.poses = theta_to_pose(self.theta, self.design)
        playing = np.flatnonzero(self.episode >= 0)
        if len(playing):
            episodes = self.episode[playing]
            self.fields.prepare(playing, self.source.scene_index[episodes], self.source.goals[episodes])


def as_bytes(pictures: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Pictures in 0..1 as the nearest bytes."""
    return (pictures * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)
