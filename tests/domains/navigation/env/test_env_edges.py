"""Environments at their edges: what is refused, with whose error, and that they are pickled and copied."""

import copy
import pickle

import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded

from prnav.domains.navigation.pointgoal import PointGoalNavEnv, PointGoalNavVectorEnv
from prnav.errors import ConfigError, DesignError, EnvError


@pytest.fixture(scope="module")
def envs(config, source):
    made = PointGoalNavVectorEnv(3, config, source)
    made.reset(seed=0)
    return made


@pytest.mark.parametrize(
    ("actions", "match"),
    [
        ([0.9, 1.0, 2.0], "actions are of type float64; they must be whole numbers from 0 to 3"),
        ([True, True, False], "actions are of type bool"),
        ([1, 2], "actions are 2; there must be 3, one per row"),
        ([1, 2, 9], "actions hold 9; valid: 0 to 3"),
        ([1, 2, -1], "actions hold -1; valid: 0 to 3"),
        ([[1], [2]], "actions are 2; there must be 3"),
        ("go", "actions are of type"),
    ],
)
def test_actions_that_are_none(envs, actions, match):
    with pytest.raises(EnvError, match=match):
        envs.step(actions)


@pytest.mark.parametrize(
    ("ask", "error", "match"),
    [
        (lambda e: e.set_designs([99], np.zeros((1, 1, 7))), DesignError, "agents hold 99; valid: 0 to 2"),
        (lambda e: e.set_designs([0.5], np.zeros((1, 1, 7))), DesignError, "agents are of type float64"),
        (lambda e: e.set_designs([0], np.full((1, 2, 7), 1e300)), DesignError, "holds 1e.300; normalised designs"),
        (lambda e: e.set_designs([0], np.full((1, 2, 7), np.nan)), DesignError, "not finite"),
        (lambda e: e.set_designs([0], "abc"), DesignError, "designs are not an array of numbers"),
        (lambda e: e.reset(options={"episodes": [0, 1, 10**6]}), EnvError, "hold 1000000; valid: 0 to"),
        (lambda e: e.reset(options={"episodes": [0, 1]}), EnvError, "are 2; there must be 3"),
        (lambda e: e.reset(options={"episode": 3}), EnvError, "reset knows no option 'episode'; valid: 'episodes'"),
        (lambda e: e.reset(seed=-1), EnvError, "seed is -1; it must be a whole number from 0"),
        (lambda e: e.reset(seed=1.5), EnvError, "seed is 1.5"),
        (lambda e: e.reset(seed=[1, 2]), EnvError, "seed holds 2 numbers"),
    ],
)
def test_what_cannot_be_asked(envs, ask, error, match):
    with pytest.raises(error, match=match):
        ask(envs)


@pytest.mark.parametrize("count", [0, -1, 2.5, 10**12])
def test_numbers_of_environments(config, source, count):
    with pytest.raises(ConfigError, match="num_envs is"):
        PointGoalNavVectorEnv(count, config, source)


def test_steps_before_the_first_reset_and_after_close(config, source):
    envs, env = PointGoalNavVectorEnv(2, config, source), PointGoalNavEnv(config, source)
    for step in (lambda: envs.step([1, 1]), lambda: env.step(1)):
        with pytest.raises(ResetNeeded, match="call reset"):
            step()
    for one in (envs, env):
        one.reset(seed=0)
        one.close()
    for step in (lambda: envs.step([1, 1]), lambda: env.step(1), envs.reset, env.reset):
        with pytest.raises(ClosedEnvironmentError, match="closed"):
            step()


def test_a_single_environment_does_not_go_on_after_its_end(config, source):
    env = PointGoalNavEnv(config, source)
    env.reset(seed=0)
    with pytest.raises(EnvError, match=r"action is 0\.9; it must be an integer from 0 to 3"):
        env.step(0.9)
    assert env.step(0)[2]
    with pytest.raises(ResetNeeded):
        env.step(1)
    env.reset()
    env.step(1)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"])
def test_copies_go_on_as_the_original_does(config, source, copied):
    envs = PointGoalNavVectorEnv(3, config, source)
    envs.reset(seed=4)
    envs.step([1, 2, 3])
    again = copied(envs)
    for actions in ([1, 1, 1], [2, 1, 0], [1, 3, 1]):
        ours, theirs = envs.step(actions), again.step(actions)
        for name, value in ours[0].items():
            np.testing.assert_array_equal(value, theirs[0][name])
        np.testing.assert_array_equal(ours[1], theirs[1])
