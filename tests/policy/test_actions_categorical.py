"""Distributions over a few actions."""

import numpy as np
import pytest
import torch

from prnav.contracts import DiscreteActions
from prnav.policy.actions import Categorical, CategoricalHead, action_head

PROBABILITIES = torch.tensor([0.1, 0.2, 0.7])


def test_sampling_follows_the_probabilities_and_the_callers_numbers():
    distribution = Categorical(torch.log(PROBABILITIES).expand(20000, 3))
    uniforms = torch.rand(20000, 3, generator=torch.Generator().manual_seed(0))
    actions = distribution.sample(uniforms)
    shares = torch.bincount(actions, minlength=3) / 20000
    torch.testing.assert_close(shares, PROBABILITIES, atol=0.01, rtol=0)
    assert torch.equal(actions, distribution.sample(uniforms))
    assert (distribution.mode() == 2).all()


def test_draws_by_one_number_follow_the_probabilities_and_never_take_what_has_none():
    logits = torch.log(torch.tensor([0.0, 0.2, 0.5, 0.3, 0.0])).expand(20_000, 5)
    actions = Categorical(logits).draw(np.random.default_rng(0).random((20_000, 1)))
    shares = np.bincount(actions, minlength=5) / 20_000
    np.testing.assert_allclose(shares, [0, 0.2, 0.5, 0.3, 0], atol=0.015)
    edges = Categorical(logits[:2]).draw(np.array([[0.0], [np.nextafter(1.0, 0.0)]]))
    assert edges.tolist() == [1, 3] and edges.dtype == torch.int64


def test_log_probability_entropy_and_imitation_by_hand():
    distribution = Categorical(torch.log(torch.tensor([[0.25, 0.75], [0.5, 0.5]])) + 3.0)
    actions = torch.tensor([1, 0])
    log_probs = torch.log(torch.tensor([0.75, 0.5]))
    torch.testing.assert_close(distribution.log_prob(actions), log_probs, atol=1e-6, rtol=0)
    expected = torch.tensor([-(0.25 * np.log(0.25) + 0.75 * np.log(0.75)), np.log(2)], dtype=torch.float32)
    torch.testing.assert_close(distribution.entropy(), expected, atol=1e-6, rtol=0)
    torch.testing.assert_close(distribution.imitation_loss(actions), -log_probs.mean(), atol=1e-6, rtol=0)
    assert distribution.agreement(torch.tensor([1, 1])) == 0.5  # equal logits: the first is the mode


def test_what_the_head_says_of_itself():
    head = action_head(DiscreteActions(4))
    assert isinstance(head, CategoricalHead)
    assert (head.size, head.noise_width, head.draw_width, head.shape, head.dtype) == (4, 4, 1, (), torch.int64)
    taken = head.for_environment(torch.tensor([3, 0]))
    assert taken.dtype == np.int64 and taken.tolist() == [3, 0]
    assert head.none_yet(2, 5).shape == (2, 5)
    sign = head.exploration(0.02)
    assert sign.metric == "entropy" and sign.least == pytest.approx(0.02 * np.log(4))


def test_the_first_step_of_an_episode_has_a_previous_action_of_its_own():
    previous = action_head(DiscreteActions(3)).previous()
    starts = torch.tensor([True, True, False, False])
    features = previous(torch.tensor([0, 2, 0, 2]), starts)
    assert torch.equal(features[0], features[1]) and torch.equal(features[0], previous.weight[3])
    assert torch.equal(features[2:], previous.weight[[0, 2]])
