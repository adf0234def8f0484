from types import SimpleNamespace

import numpy as np
import pytest

from prnav.contracts import Turn
from prnav.domains.navigation.agents import FORWARD, LEFT, RIGHT, STOP
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig
from prnav.domains.navigation.references import REFERENCE_AGENTS, reference_agent
from prnav.domains.navigation.targetnav import TargetNavEnvConfig
from prnav.domains.navigation.touch import BlindAgent, WallFollowerAgent
from prnav.errors import ConfigError
from prnav.play import TraceRecorder, play

STEP = 0.25


def walk(agent, moves, goal=None):
    """What one slot does when its steps forward move it by these shares of a full step, one after the other."""
    place, actions, moves = np.zeros(2), [], iter(moves)
    for t in range(40):
        observations = {"gps": place[None].astype(np.float32)}
        if goal is not None:
            observations["pointgoal"] = np.float32([[goal[t][0], goal[t][1]]])
        turn = Turn(observations, np.array([t == 0]), np.ones(1, bool), np.array([7], np.uint64), np.array([t]))
        action = int(agent.act(turn)[0])
        actions.append(action)
        if action == FORWARD:
            share = next(moves, None)
            if share is None:
                break
            place = place + [share * STEP, 0.0]
    return actions


def test_the_wall_is_kept_on_the_right():
    # two free steps, a wall, then free beside it: a turn back to the right after each free step
    assert walk(WallFollowerAgent(1), [1, 1, 0, 1, 0, 1]) == [
        *[FORWARD, FORWARD, FORWARD],
        *[LEFT, FORWARD],
        *[RIGHT, FORWARD],
        *[LEFT, FORWARD],
        *[RIGHT, FORWARD],
    ]


def test_sliding_along_a_wall_goes_on():
    assert walk(WallFollowerAgent(1), [0, 0.7, 0.7, 1]) == [FORWARD, LEFT, FORWARD, FORWARD, FORWARD, RIGHT, FORWARD]


def test_a_lost_wall_is_given_up_after_a_circle():
    actions = walk(WallFollowerAgent(1), [0] + [1] * 14)
    assert actions.count(RIGHT) == 13
    assert actions[-2:] == [FORWARD, FORWARD]


def test_the_blind_agent_heads_for_its_goal_and_round_what_is_in_the_way():
    far, left, near = (5.0, 0.0), (5.0, 1.0), (4.0, 0.0)
    assert walk(BlindAgent(1), [1], [left, far, far])[:2] == [LEFT, FORWARD]
    goal = [far, far, far, far, near, near, near, near, (0.1, 0.0)]
    # straight on, a wall, along it, and off it as soon as it is nearer to the goal than where it met the wall
    assert walk(BlindAgent(1), [1, 0, 1, 1, 1, 1, 1], [*goal, *goal])[:6] == [
        *[FORWARD, FORWARD, LEFT, FORWARD],
        *[FORWARD, FORWARD],
    ]
    assert walk(BlindAgent(1), [], [(0.1, 0.0)] * 40)[0] == STOP


def test_without_a_goal_the_blind_agent_turns_away_from_walls():
    actions = walk(BlindAgent(1), [1, 0, 1])
    assert actions[:2] == [FORWARD, FORWARD]
    turns = actions[2:-2]
    assert 2 <= len(turns) <= 5
    assert set(turns) in ({LEFT}, {RIGHT})
    assert actions == walk(BlindAgent(1), [1, 0, 1])


@pytest.mark.parametrize("name", ["wall-follower", "blind"])
def test_rows_do_not_depend_on_the_number_of_slots(plane, name):
    made = {"wall-follower": WallFollowerAgent, "blind": BlindAgent}[name]

    def played(count):
        slots, seen = plane(count), {}
        observe = slots.observe
        slots.observe = lambda who: {**observe(who), "gps": slots.positions[who][:, [0, 2]].astype(np.float32)}
        recorder = TraceRecorder(lambda played: seen.update({played.index: played.trace["actions"]}))
        play(made(count), slots, range(40), 0, [recorder])
        return seen

    one, many = played(1), played(7)
    for index in range(40):
        np.testing.assert_array_equal(one[index], many[index])


def test_agents_are_found_by_name():
    slots = SimpleNamespace(num_slots=2, first_action=0)
    for name in REFERENCE_AGENTS:
        assert reference_agent(name, slots, PointGoalEnvConfig()).name == name
    with pytest.raises(ConfigError, match="agent 'goal-follower' needs a goal, and targetnav shows none; valid there"):
        reference_agent("goal-follower", slots, TargetNavEnvConfig())
    with pytest.raises(ConfigError, match="agent 'oracle' is not known; valid: shortest-path"):
        reference_agent("oracle", slots, PointGoalEnvConfig())


def test_a_task_without_stop_counts_its_actions_from_forward():
    slots = SimpleNamespace(num_slots=1, first_action=1, expert_actions=lambda: np.array([1]))
    agent = reference_agent("shortest-path", slots, TargetNavEnvConfig())
    assert agent.act(None).tolist() == [1]
    assert reference_agent("forward", slots, TargetNavEnvConfig()).act(turn_without_goal()).tolist() == [0]


def turn_without_goal():
    nothing = np.zeros(1, bool)
    return Turn({}, nothing, ~nothing, np.zeros(1, np.uint64), np.zeros(1, np.int64))
