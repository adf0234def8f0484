"""The shortest-path follower: what an agent that knows the navmesh would do, within its few actions."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.frames import forward, wrap_angle, yaw_towards
from prnav.navmesh import GoalFields
from prnav.sim.simulator import FORWARD, LEFT, RIGHT, STOP, Simulator

TURN_COST = 1e-3
"""What one turn counts against nearness to the goal [m]: decides between headings that are as good."""

LEAST_GAIN = 0.01
"""A best step that wins less than this [m] makes the oracle look two steps ahead."""

GOOD_SHARE = 0.965
"""Share of what the worst angle between headings can cost that a step must win to be taken without trying others."""


def shortest_path_actions(
    simulator: Simulator, fields: GoalFields, slots: ArrayLike, stop_distance: float
) -> NDArray[np.int64]:
    """Actions (n,) of an oracle for the agents in ``slots`` (n,), whose goals are prepared in ``fields``.

    It stops within ``stop_distance`` [m] of the goal. Else it takes the heading, of those that turns can reach, that
    is nearest to the way to the next turning point of the shortest path, if a step there wins about as much as it can;
    if not, it tries a step, as the simulator would carry it out, at every heading and takes the one that ends nearest
    to the goal (geodesic distance). Then it turns towards that heading or goes. While it turns, its place and so its
    choice stay the same, hence it cannot dither.
    """
    slots = np.asarray(slots, np.int64)
    if not len(slots):
        return np.zeros(0, np.int64)
    positions = simulator.positions[slots]
    distance, corner = fields.query(slots, positions)
    turns = _turns_towards(simulator, slots, corner - positions)
    after, _ = fields.query(slots, _step_after(simulator, slots, turns))
    config = simulator.config
    gain = distance - after
    unclear = ~(gain >= GOOD_SHARE * config.forward_step * np.cos(0.5 * config.turn_angle))  # NaN where unreachable
    rows = np.flatnonzero(unclear & (distance > stop_distance))
    if len(rows):
        turns[rows] = _best_turns(simulator, fields, slots[rows], distance[rows])
    action = np.where(turns == 0, FORWARD, np.where(turns > 0, LEFT, RIGHT))
    return np.where(distance <= stop_distance, STOP, action)


def _turns_towards(simulator: Simulator, slots: NDArray[np.int64], offsets: NDArray[np.float64]) -> NDArray[np.int64]:
    """Turns to the heading nearest to the direction of ``offsets`` (n, 3), (n,); left is positive."""
    bearing = wrap_angle(yaw_towards(np.nan_to_num(offsets)) - simulator.yaws[slots]) / simulator.config.turn_angle
    # halfway between two headings the nearer one wins, so that it still does after a turn towards it
    return (np.sign(bearing) * np.ceil(np.abs(bearing) - 0.5 - TURN_COST)).astype(np.int64)


def _best_turns(
    simulator: Simulator, fields: GoalFields, slots: NDArray[np.int64], distance: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Turns to the heading whose step ends nearest to the goal, (n,), from ``distance`` [m] of it."""
    reach = int(round(np.pi / simulator.config.turn_angle))
    turns = np.arange(-reach + 1, reach + 1)
    count = len(turns)
    each = np.repeat(slots, count)
    reached = _step_after(simulator, each, np.tile(turns, len(slots)))
    after = fields.query(each, reached)[0].reshape(-1, count)
    stuck = np.flatnonzero(after.min(axis=1) > distance - LEAST_GAIN)
    if len(stuck):  # at a wall that nothing slides along: the first of the two best steps
        first = reached.reshape(-1, count, 3)[stuck].reshape(-1, 3)
        twice, places = np.repeat(slots[stuck], count * count), np.repeat(first, count, axis=0)
        second = _step_after(simulator, twice, np.tile(turns, len(first)), places)
        after[stuck] = fields.query(twice, second)[0].reshape(-1, count, count).min(axis=2)
    return turns[np.argmin(after + TURN_COST * np.abs(turns), axis=1)]


def _step_after(
    simulator: Simulator,
    slots: NDArray[np.int64],
    turns: NDArray[np.int64],
    places: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Where agents (n,) are after so many turns (n,) and a step, from ``places`` or where they stand, (n, 3) [m]."""
    config = simulator.config
    starts = simulator.positions[slots] if places is None else places
    ends = starts + config.forward_step * forward(simulator.yaws_after(slots, turns))
    return simulator.world.navmesh_set.step(simulator.scene_index[slots], starts, ends, sliding=config.sliding)[0]
