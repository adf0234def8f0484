import numpy as np
import pytest

from prnav.domains.navigation.oracle import _best_turns, shortest_path_actions
from prnav.episodes import generate_table
from prnav.navmesh import GoalFields
from prnav.sim import FORWARD, LEFT, RIGHT, STOP, SimConfig, Simulator, load_world


@pytest.fixture(scope="module")
def world():
    return load_world(["prhouses/val/00", "prhouses/val/01"])


def start(world, count, config=SimConfig()):  # noqa: B008 (frozen)
    tables = [generate_table(navmesh, "scene", count, seed=5) for navmesh in world.navmeshes]
    scenes = np.repeat(np.arange(len(tables)), count)
    simulator = Simulator(world, len(scenes), config)
    slots = np.arange(len(scenes))
    positions, yaws, goals = (
        np.concatenate([getattr(table, name) for table in tables])
        for name in ("start_position", "start_yaw", "goal_position")
    )
    simulator.reset(slots, scenes, positions, yaws)
    fields = GoalFields(world.navmesh_set, len(slots))
    fields.prepare(slots, scenes, goals)
    return simulator, fields, slots


@pytest.mark.parametrize("config", [SimConfig(), SimConfig(sliding=False), SimConfig(turn_angle_deg=20.0)])
def test_every_goal_is_reached_on_nearly_the_shortest_path(world, config):
    simulator, fields, slots = start(world, 60, config)
    shortest = fields.query(slots, simulator.positions)[0]
    taken, playing = np.zeros(len(slots)), np.ones(len(slots), bool)
    for _ in range(500):
        actions = np.where(playing, shortest_path_actions(simulator, fields, slots, 0.2), -1)
        playing &= actions != STOP
        taken += simulator.step(actions)
        if not playing.any():
            break
    assert not playing.any()
    assert (fields.query(slots, simulator.positions)[0] <= 0.2).all()
    assert np.mean(shortest / np.maximum(shortest, taken)) > 0.93


def test_it_never_dithers_and_each_step_comes_nearer(world):
    simulator, fields, slots = start(world, 60)
    last, distance = np.full(len(slots), FORWARD), fields.query(slots, simulator.positions)[0]
    for _ in range(80):
        actions = shortest_path_actions(simulator, fields, slots, 0.2)
        assert not ((last == LEFT) & (actions == RIGHT)).any()
        assert not ((last == RIGHT) & (actions == LEFT)).any()
        simulator.step(actions)
        now = fields.query(slots, simulator.positions)[0]
        assert (now[actions == FORWARD] < distance[actions == FORWARD]).all()
        last, distance = actions, now


def test_the_first_guess_is_about_as_good_as_trying_every_heading(world):
    simulator, fields, slots = start(world, 60)
    for _ in range(10):
        guess = shortest_path_actions(simulator, fields, slots, 0.0)
        best = _best_turns(simulator, fields, slots, fields.query(slots, simulator.positions)[0])
        searched = np.where(best == 0, FORWARD, np.where(best > 0, LEFT, RIGHT))
        assert np.mean(guess == searched) > 0.85
        simulator.step(searched)


def test_an_answer_does_not_depend_on_the_batch(world):
    simulator, fields, slots = start(world, 10)
    together = shortest_path_actions(simulator, fields, slots, 0.2)
    alone = [shortest_path_actions(simulator, fields, [slot], 0.2)[0] for slot in slots]
    np.testing.assert_array_equal(together, alone)
    assert len(shortest_path_actions(simulator, fields, [], 0.2)) == 0
