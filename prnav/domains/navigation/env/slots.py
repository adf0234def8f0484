"""A navigation task over N slots, each playing one episode at a time: the core that every environment is a layer on.

There is no reset on its own here: :meth:`NavigationSlots.begin` puts a slot at an episode's start. All arrays have the
slots on the first axis; nothing loops over them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array, JSONObject
from prnav.arguments import floats, indices
from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.domains.navigation.env.config import NavigationConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource
from prnav.domains.navigation.env.spaces import action_spec
from prnav.domains.navigation.light import Light, Viewpoints
from prnav.domains.navigation.measures import soft_spl, spl
from prnav.domains.navigation.oracle import shortest_path_actions
from prnav.domains.navigation.sensors import SEEING, Situation, make_sensors
from prnav.errors import DesignError, EnvError, EpisodeError
from prnav.navmesh import GoalFields
from prnav.play import episode_key
from prnav.sensors import load_design, theta_to_pose
from prnav.sim import FORWARD, HOLD, STOP, Simulator

Observations = JSONObject
"""Arrays by name as the specs say: float32, or bytes for pictures; readings may be tensors on the renderer's device."""

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


MAX_THETA = 1e6
"""Largest entry of a normalised design; what is beyond is no design but a fault."""


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
        self.sensors = make_sensors(config.sensor_names, config, self.design)
        seeing = any(sensor.spec.kind in SEEING for sensor in self.sensors.values())
        if seeing:
            config.readout.per_sensor(self.num_sensors)
        self.light = Light(source.world.scenes, config) if seeing else None
        self.is_noisy = seeing and config.readout.is_noisy
        self.episode = np.full(num_slots, -1, np.int64)  #: index into the source, -1 before the first
        self.keys = np.zeros(num_slots, np.uint64)  #: of the episode's noise, where there is any
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
        return {name: sensor.spec for name, sensor in self.sensors.items()}

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
            EnvError: there is no such slot or episode.
        """
        slots = indices(slots, "slots", self.num_slots, EnvError)
        episodes = indices(episodes, "episodes", len(self.source), EnvError, len(slots))
        if not len(slots):
            return
        if theta is not None:
            self._set_theta(slots, theta)
        source = self.source
        self.episode[slots] = episodes
        if self.is_noisy:
            self.keys[slots] = self._noise_keys(episodes)
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

    def observe(self, slots: ArrayLike | None = None, on_device: bool = False) -> Observations:
        """Observations of slots (n,), all of them by default: new arrays, each (n, ...).

        Args:
            slots: which.
            on_device: whether readings may stay on the renderer's device, as tensors.
        """
        rows = np.arange(self.num_slots) if slots is None else np.asarray(slots, np.int64)
        source, episodes = self.source, self.episode[rows]
        now = Situation(
            scenes=source.scene_index[episodes],
            positions=self.positions[rows],
            yaws=self.yaws[rows],
            starts=source.starts[episodes],
            start_yaws=source.yaws[episodes],
            goals=source.goals[episodes],
            theta=self.theta[rows],
            poses=self.poses[rows],
            spheres=self._targets(episodes),
            keys=self.keys[rows] if self.is_noisy else None,
            steps=self.steps[rows],
            light=self.light,
            on_device=on_device,
        )
        return {name: sensor.read(now) for name, sensor in self.sensors.items()}

    def readings_along(
        self, episode: int, positions: NDArray[np.float64], yaws: NDArray[np.float64], steps: NDArray[np.int64]
    ) -> NDArray[np.float32]:
        """What receptors read in the course of an episode, (T, K, B*B, 3), 0 to 1, by the first slot's design.

        Args:
            episode: index into the source.
            positions: of the agent [m], (T, 3).
            yaws: its headings [rad], (T,).
            steps: steps that it had taken, (T,).
        """
        assert self.light is not None
        episodes = np.full(len(steps), episode)
        poses = np.repeat(self.poses[:1], len(steps), axis=0)
        scenes = self.source.scene_index[episodes]
        keys = np.repeat(self._noise_keys(episodes[:1]), len(steps))
        at = Viewpoints(scenes, positions, yaws, poses, self._targets(episodes), keys, steps)
        readings: NDArray[np.float32] = self.light.readings(at, self.config.grid)
        return readings

    def _noise_keys(self, episodes: NDArray[np.int64]) -> NDArray[np.uint64]:
        """Keys (n,) that the noise of sensors is drawn by in episodes (n,)."""
        seed = self.config.readout.seed
        return np.array([episode_key(seed, *self.source.id(episode)) for episode in episodes], np.uint64)

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

    def state(self, slots: NDArray[np.int64]) -> dict[str, Array]:
        """Where slots (n,) are: positions [m] (n, 3) and yaws [rad] (n,)."""
        return {"positions": self.positions[slots].copy(), "yaws": self.yaws[slots].copy()}

    def events(self, slots: NDArray[np.int64]) -> dict[str, Array]:
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

    def outcome(self, slot: int) -> JSONObject:
        """Measures and facts of one slot's episode, as plain numbers and strings."""
        scene_id, episode_id = self.source.id(self.episode[slot])
        row: JSONObject = {"scene_id": scene_id, "episode_id": episode_id}
        row.update({name: float(value[0]) for name, value in self.measures([slot]).items()})
        for name in ("success", "collisions", "steps"):
            row[name] = int(row[name])
        return row

    def set_designs(self, slots: ArrayLike, theta: ArrayLike) -> None:
        """Give slots (n,) normalised designs (n, K, 7) from now on.

        Raises:
            DesignError: the shape is wrong, or a number is not finite.
        """
        self._set_theta(indices(slots, "slots", self.num_slots, DesignError), theta)

    def _set_theta(self, slots: NDArray[np.int64], theta: ArrayLike) -> None:
        values = self.checked_theta(len(slots), theta)
        self.theta[slots] = values
        self.poses[slots] = theta_to_pose(values, self.design)

    def checked_theta(self, count: int, theta: ArrayLike) -> NDArray[np.float64]:
        """``count`` normalised designs (count, K, 7).

        Raises:
            DesignError: the shape is wrong, or a number is not finite or beyond :data:`MAX_THETA`.
        """
        values = floats(theta, "designs", DesignError)
        want = (count, self.num_sensors, 7)
        if values.shape != want:
            raise DesignError(f"designs have shape {values.shape}; for this environment it must be {want}")
        if not np.isfinite(values).all():
            raise DesignError("a design holds numbers that are not finite; all 7 entries of each sensor must be finite")
        if values.size and np.abs(values).max() > MAX_THETA:
            raise DesignError(
                f"a design holds {values.flat[np.abs(values).argmax()]:g}; normalised designs are about -1 to 1, and "
                f"at most {MAX_THETA:g} from 0"
            )
        return values

    def snapshot(self) -> dict[str, Array]:
        """Copies of all arrays that :meth:`restore` needs to resume exactly here."""
        state = {name: getattr(self, name).copy() for name in _STATE}
        return {**state, **{f"sim_{name}": value for name, value in self.simulator.snapshot().items()}}

    def restore(self, state: dict[str, Array]) -> None:
        """Resume where :meth:`snapshot` was called; the source must be the same.

        Raises:
            EnvError: an episode or a scene is not there, or a pose is not finite.
        """
        indices(np.asarray(state["episode"]) + 1, "episodes of the state (plus 1)", len(self.source) + 1, EnvError)
        indices(state["sim_scene_index"], "scenes of the state", len(self.source.world.scene_ids), EnvError)
        for name in ("sim_positions", "sim_yaws", "sim_start_yaws", "theta"):
            if not np.isfinite(state[name]).all():
                raise EnvError(f"{name} of the state are not finite")
        for name in _STATE:
            setattr(self, name, np.array(state[name], dtype=getattr(self, name).dtype))
        self.simulator.restore({name[4:]: value for name, value in state.items() if name.startswith("sim_")})
        self.poses = theta_to_pose(self.theta, self.design)
        playing = np.flatnonzero(self.episode >= 0)
        if len(playing):
            episodes = self.episode[playing]
            if self.is_noisy:
                self.keys[playing] = self._noise_keys(episodes)
            self.fields.prepare(playing, self.source.scene_index[episodes], self.source.goals[episodes])
