"""A toy environment: agents on an open plane with a wall, fast enough to play hundreds of episodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from prnav.contracts import DiscreteActions, ObservationSpec
from prnav.frames import forward, wrap_angle, yaw_towards

WALL_X = 3.0
"""No agent passes this plane."""


class PlaneSlots:
    """Episodes from seeds on a plane: turn 30 degrees, forward 0.25 m, stop; 60 steps at most."""

    def __init__(self, num_slots: int, episodes: int = 40, max_steps: int = 60) -> None:
        generator = np.random.default_rng(0)
        self.num_slots = num_slots
        self.action_spec = DiscreteActions(4)
        self.observation_specs = {"pointgoal": ObservationSpec((2,), "vector")}
        self.actions = np.zeros(num_slots, np.int64)
        self.max_steps = max_steps
        self.starts = generator.uniform(-2.0, 2.0, size=(episodes, 3)) * [1.0, 0.0, 1.0]
        self.goals = generator.uniform(-3.0, 3.0, size=(episodes, 3)) * [1.0, 0.0, 1.0]
        self.episode_ids: Sequence[tuple[str, str]] = [(f"plane/{i % 2}", str(i)) for i in range(episodes)]
        self.positions = np.zeros((num_slots, 3))
        self.yaws = np.zeros(num_slots)
        self.collided = np.zeros(num_slots, dtype=bool)
        self.episode = np.full(num_slots, -1)
        self.steps = np.zeros(num_slots, dtype=int)
        self.hits = np.zeros(num_slots, dtype=int)
        self.stopped = np.zeros(num_slots, dtype=bool)
        self.begun: list[int] = []

    def begin(self, slots, episodes):
        self.begun += episodes.tolist()
        self.episode[slots] = episodes
        self.positions[slots] = self.starts[episodes]
        self.yaws[slots] = 0.0
        self.steps[slots] = self.hits[slots] = 0
        self.stopped[slots] = False

    def observe(self, slots):
        offsets = self.goals[self.episode[slots]] - self.positions[slots]
        bearing = wrap_angle(yaw_towards(offsets) - self.yaws[slots])
        return {"pointgoal": np.stack([np.linalg.norm(offsets, axis=1), bearing], axis=1).astype(np.float32)}

    def state(self, slots):
        return {"positions": self.positions[slots], "yaws": self.yaws[slots]}

    def events(self, slots):
        return {"actions": self.actions[slots].astype(np.int8), "collisions": self.collided[slots]}

    def advance(self, actions, acting):
        self.actions = actions = np.where(acting, actions, -1)
        moved = self.positions + np.where((actions == 1)[:, None], 0.25 * forward(self.yaws), 0.0)
        self.collided = (actions == 1) & (moved[:, 0] > WALL_X)
        moved[:, 0] = np.minimum(moved[:, 0], WALL_X)
        self.positions = moved
        self.yaws = wrap_angle(self.yaws + np.pi / 6 * ((actions == 2).astype(float) - (actions == 3)))
        self.steps += actions >= 0
        self.hits += self.collided
        self.stopped = actions == 0
        return self.stopped | (self.steps >= self.max_steps)

    def outcome(self, slot):
        scene_id, episode_id = self.episode_ids[self.episode[slot]]
        distance = float(np.linalg.norm(self.goals[self.episode[slot]] - self.positions[slot]))
        return {
            "scene_id": scene_id,
            "episode_id": episode_id,
            "success": float(self.stopped[slot] and distance < 0.2),
            "distance_to_goal": distance,
            "collisions": int(self.hits[slot]),
            "steps": int(self.steps[slot]),
        }


@pytest.fixture
def plane():
    return PlaneSlots
