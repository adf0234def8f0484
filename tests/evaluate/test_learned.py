import numpy as np
import pytest
import torch

from prnav.contracts import DiscreteActions, ObservationSpec, Turn
from prnav.errors import CheckpointError
from prnav.evaluate.learned import load_run
from prnav.play.policy_agent import BLOCK, PolicyAgent
from prnav.policy import PolicyConfig, build_policy

SHAPES = {"photoreceptors": (2, 4, 3), "design": (2, 7), "gps": (2,), "compass": (1,), "pointgoal": (2,)}
KINDS = {"photoreceptors": "receptors", "design": "design"}


def made_up(generator, *leading):
    observations = {
        name: generator.normal(size=(*leading, *shape)).astype(np.float32) for name, shape in SHAPES.items()
    }
    observations["pointgoal"] = np.abs(observations["pointgoal"])  # a distance is not negative
    return observations


def make_policy(encoder):
    specs = {name: ObservationSpec(shape, KINDS.get(name, "vector")) for name, shape in SHAPES.items()}
    config = PolicyConfig(encoder=encoder, width=32, feedforward=48, lstm_hidden=32)
    return build_policy(config, specs, DiscreteActions(4), seed=1)


def walk(policy, order, num_slots, actions, steps=6):
    """Actions (steps, E) that episodes with made-up observations are answered with, played ``num_slots`` at a time."""
    generator = np.random.default_rng(0)
    inputs = made_up(generator, steps, 40)
    keys = generator.integers(0, 2**63, 40).astype(np.uint64)
    answers = np.full((steps, 40), -1)
    agent = PolicyAgent(policy, "policy", actions, num_slots)
    for begin in range(0, len(order), num_slots):
        episodes = np.resize(order[begin : begin + num_slots], num_slots)
        for step in range(steps):
            observations = {name: value[step, episodes] for name, value in inputs.items()}
            start = np.full(num_slots, step == 0)
            turn = Turn(observations, start, np.ones(num_slots, bool), keys[episodes], np.full(num_slots, step))
            answers[step, episodes] = agent.act(turn)
    return answers


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
def test_answers_do_not_depend_on_the_batch(encoder):
    policy = make_policy(encoder)
    order = np.arange(40)
    expected = walk(policy, order, 40, "sampled")
    assert len(np.unique(expected)) == 4
    for other, slots in ((order, 1), (order[::-1], 8), (np.roll(order, 7), 33)):
        np.testing.assert_array_equal(walk(policy, other, slots, "sampled"), expected)


@pytest.mark.parametrize("encoder", ["transformer", "compact", "blind"])
def test_probabilities_are_the_same_bits_in_every_row_of_a_block(encoder):
    agent = PolicyAgent(make_policy(encoder), "policy", "greedy", BLOCK)
    generator = np.random.default_rng(2)
    observations = made_up(generator, BLOCK)
    for value in observations.values():
        value[:] = value[0]
    ones = np.ones(BLOCK, bool)
    turn = Turn(observations, ones, ones, np.zeros(BLOCK, np.uint64), np.zeros(BLOCK, np.int64))
    probabilities = agent._distribution(turn).parameters.numpy()
    np.testing.assert_array_equal(probabilities, np.repeat(probabilities[:1], BLOCK, axis=0))


def test_greedy_takes_the_likeliest_action_of_the_policy_itself():
    policy = make_policy("compact")
    agent = PolicyAgent(policy, "policy", "greedy", 3)
    generator = np.random.default_rng(3)
    observations = made_up(generator, 3)
    ones = np.ones(3, bool)
    actions = agent.act(Turn(observations, ones, ones, np.zeros(3, np.uint64), np.zeros(3, np.int64)))
    tensors = {name: torch.from_numpy(value) for name, value in observations.items()}
    with torch.no_grad():
        step = policy.step(tensors, torch.zeros(3, dtype=torch.int64), torch.from_numpy(ones), policy.initial_state(3))
    assert actions.tolist() == step.distribution.mode().tolist()


def test_a_policy_that_is_not_finite_is_named():
    policy = make_policy("compact")
    torch.nn.init.constant_(policy.actor.bias, torch.nan)
    agent = PolicyAgent(policy, "policy", "greedy", 2)
    ones = np.ones(2, bool)
    turn = Turn(made_up(np.random.default_rng(0), 2), ones, ones, np.zeros(2, np.uint64), np.zeros(2, np.int64))
    with pytest.raises(CheckpointError, match="policy policy: its action probabilities are not finite at step 0"):
        agent.act(turn)


def test_a_run_that_is_none_is_named(tmp_path):
    with pytest.raises(CheckpointError, match="there is no such folder; give one that prnav-train made"):
        load_run(tmp_path / "nothing", print)
    with pytest.raises(CheckpointError, match=r"there is no config\.toml"):
        load_run(tmp_path, print)
