"""Environments in threads, over one source of scenes and episodes, play as they do one after the other."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from prnav.domains.navigation.pointgoal import PointGoalNavEnv, PointGoalNavVectorEnv

THREADS = 4


def play(envs, seed, steps=60):
    """All that an environment says in so many steps."""
    generator = np.random.default_rng(seed)
    observations, _ = envs.reset(seed=seed)
    said = [*observations.values()]
    for _ in range(steps):
        observations, rewards, terminated, truncated, info = envs.step(generator.integers(1, 4, envs.num_envs))
        said += [*observations.values(), rewards, terminated, truncated, info["distance_to_goal"]]
        said.append(envs.expert_actions())
    return said


def test_environments_that_share_a_source_do_not_disturb_each_other(config, source):
    want = [play(PointGoalNavVectorEnv(3, config, source), seed) for seed in range(THREADS)]
    gate = threading.Barrier(THREADS)

    def run(seed):
        envs = PointGoalNavVectorEnv(3, config, source)
        gate.wait()
        return play(envs, seed)

    with ThreadPoolExecutor(THREADS) as pool:
        for got, expected in zip(pool.map(run, range(THREADS)), want, strict=True):
            assert all(np.array_equal(g, e) for g, e in zip(got, expected, strict=True))


def test_no_two_environments_share_memory_that_they_write_to(config, source):
    """Groups of a training step at the same time; what each writes to is its own."""
    one, two = (PointGoalNavEnv(config, source).slots for _ in range(2))
    for env in (one, two):
        env.begin(np.array([0]), np.array([0]))
    writable = [{id(array) for array in arrays(slots) if array.flags.writeable} for slots in (one, two)]
    assert writable[0] and not writable[0] & writable[1]


def arrays(slots):
    """Arrays of slots, their simulator and their goals' fields, but not of the world that they share."""
    fields = slots.fields
    pools = [fields._start, fields._windows, fields._roots]
    owners = [slots, slots.simulator, fields, *pools]
    found = [value for owner in owners for value in vars(owner).values() if isinstance(value, np.ndarray)]
    return found + [array for pool in pools for array in pool.arrays] + [a for s in fields._pool._idle for a in s]
