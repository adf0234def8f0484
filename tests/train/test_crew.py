"""Environments in groups: the same steps whatever the threads."""

import numpy as np
import pytest
import torch
from toy_env import CueEnv

from prnav.errors import CheckpointError
from prnav.policy import PolicyConfig, build_policy
from prnav.train import group_sizes
from prnav.train.crew import Crew
from prnav.train.rollout import Rollout, as_tensor

CONFIG = PolicyConfig(encoder="compact", width=16, lstm_hidden=16)


def crew_of(threads: int, *sizes: int) -> Crew:
    groups = [CueEnv(size) for size in sizes]
    policy = build_policy(CONFIG, groups[0].observation_specs, groups[0].action_spec)
    return Crew(groups, policy, seed=0, threads=threads)


def collect(crew: Crew, times: int = 2) -> tuple[Rollout, list]:
    policy = crew.collectors[0].policy
    for _ in range(times):
        rollout, ended = crew.collect(Rollout(9, crew.environments, policy))
    return rollout, ended


def test_threads_do_not_change_a_bit():
    (alone, ended), (together, ended_too) = collect(crew_of(1, 3, 2)), collect(crew_of(2, 3, 2))
    assert ended == ended_too and ended
    for name, array in alone.arrays.items():
        assert torch.equal(array, together[name]), name
    assert torch.equal(alone.last_values, together.last_values) and torch.equal(
        alone.state["lstm"], together.state["lstm"]
    )


def test_a_group_fills_its_own_columns():
    """The first group's columns are those of that group alone, with the same noise."""
    both, single = crew_of(1, 3, 2), crew_of(1, 3)
    whole, _ = collect(both, 1)
    noise = both.generator  # the crew of one group draws another shape, so hand it the same numbers
    noise.bit_generator.state = crew_of(1, 3, 2).generator.bit_generator.state
    numbers = both._noise(whole)[:, :3]
    single._noise = lambda rollout: numbers
    part, _ = collect(single, 1)
    assert torch.equal(whole["actions"][:, :3], part["actions"])
    torch.testing.assert_close(whole["values"][:, :3], part["values"], atol=1e-6, rtol=0)


def test_another_grouping_is_refused_with_the_remedy():
    state = crew_of(1, 3, 2).state_dict()
    with pytest.raises(CheckpointError, match=r"in 2 group\(s\), this run's in 1; resume with groups=2"):
        crew_of(1, 5).load_state_dict(state, "x")


def test_sizes_of_groups():
    assert group_sizes(5, 2) == [3, 2] and group_sizes(1, 2) == [1] and group_sizes(64, 2) == [32, 32]


def test_observations_of_a_device_come_without_a_copy():
    """What speaks DLPack is taken where it lies."""

    class Foreign:
        def __init__(self, array):
            self.array = array

        def __dlpack__(self, **arguments):
            return self.array.__dlpack__(**arguments)

        def __dlpack_device__(self):
            return self.array.__dlpack_device__()

    array = np.arange(4, dtype=np.float32)
    tensor = as_tensor(Foreign(array))
    array[0] = 7.0
    assert tensor.tolist() == [7.0, 1.0, 2.0, 3.0]
