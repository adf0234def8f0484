"""The shortest-path follower: what an agent that knows the navmesh would do, within its few actions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.frames import forward
from prnav.navmesh import GoalFields
from prnav.sim.simulator import FORWARD, LEFT, RIGHT, STOP, Simulator

TURN_COST = 1e-3
"""What one turn counts against nearness to the goal [m]: decides between headings that are as good."""


def shortest_path_actions(
    simulator: Simulator, fields: GoalFields, slots: ArrayLike, stop_distance: float
) -> NDArray[np.int64]:
    """Actions (n,) of an oracle for the agents in ``slots`` (n,), whose goals are prepared in ``fields``.

    It stops within ``stop_distance`` [m] of the goal. Else it tries a step, as the simulator would carry it out, at
    each heading that turns can reach, takes the one that ends nearest to the goal (geodesic distance), and turns
    towards it or goes. While it turns its place and so its choice stay the same, hence it cannot dither.
    """
    slots = np.asarray(slots, np.int64)
    if not len(slots):
        return np.zeros(0, np.int64)
    config = simulator.config
    positions, scenes = simulator.positions[slots], simulator.scene_index[slots]
    distance, _ = fields.query(slots, positions)
    reach = int(round(np.pi / config.turn_angle))
    turns = np.arange(-reach + 1, reach + 1)  # left is positive
    count = len(turns)
    yaws = simulator.yaws[slots][:, None] + turns * config.turn_angle
    starts = np.repeat(positions, count, axis=0)
    ends = starts + config.forward_step * forward(yaws).reshape(-1, 3)
    reached, _ = simulator.world.navmesh_set.step(np.repeat(scenes, count), starts, ends, sliding=config.sliding)
    after = fields.query(np.repeat(slots, count), reached)[0].reshape(len(slots), count)
    best = turns[np.argmin(after + TURN_COST * np.abs(turns), axis=1)]
    action = np.where(best == 0, FORWARD, np.where(best > 0, LEFT, RIGHT))
    return np.where(distance <= stop_distance, STOP, action)
