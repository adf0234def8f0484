import dataclasses

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from prnav.domains.navigation.pointgoal import PointGoalConfig, PointGoalNavEnv, PointGoalNavVectorEnv


def test_the_native_batch_speaks_as_gymnasiums_own(config, source, random_actions):
    """Observations, rewards, ends and info equal those of SyncVectorEnv over single environments."""
    short = dataclasses.replace(config, rules=PointGoalConfig(max_steps=7))
    ours = PointGoalNavVectorEnv(3, short, source)
    theirs = SyncVectorEnv([lambda: PointGoalNavEnv(short, source)] * 3, autoreset_mode=AutoresetMode.SAME_STEP)
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.observation_space == theirs.observation_space
    a, b = ours.reset(seed=2)[0], theirs.reset(seed=2)[0]
    ends = 0
    for t in range(30):
        for name in b:
            np.testing.assert_array_equal(a[name], b[name])
        actions = random_actions(3)
        if t % 5 == 4:
            actions[t % 3] = 0
        a, *results, info = ours.step(actions)
        b, *expected, their_info = theirs.step(actions)
        for one, two in zip(results, expected, strict=True):
            np.testing.assert_array_equal(one, two)
            assert one.dtype == two.dtype
        assert set(their_info) <= set(info)
        compare(info, their_info)
        ends += int((results[1] | results[2]).sum())
    assert ends > 10


def compare(ours, theirs):
    for name, value in theirs.items():
        if isinstance(value, dict):
            compare(ours[name], value)
        elif name == "final_obs":
            for one, two in zip(ours[name], value, strict=True):
                assert (one is None) == (two is None)
                for key in two or ():
                    np.testing.assert_array_equal(one[key], two[key])
        else:
            np.testing.assert_array_equal(ours[name], value)


def test_returned_arrays_are_the_callers(config, source):
    env = PointGoalNavVectorEnv(2, config, source)
    first, _ = env.reset(seed=0)
    kept = {name: value.copy() for name, value in first.items()}
    second = env.step([2, 2])[0]
    for name, value in first.items():
        np.testing.assert_array_equal(value, kept[name])
        value.fill(7.0)
    for name, value in env.observations().items():
        np.testing.assert_array_equal(value, second[name])
