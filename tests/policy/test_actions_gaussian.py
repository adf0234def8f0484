"""Distributions over vectors between bounds, against scipy."""

import numpy as np
import pytest
import torch
from scipy import stats

from prnav.contracts import BoxActions
from prnav.policy.actions import GaussianHead, action_head
from prnav.policy.actions.gaussian import standard_normal

BOX = BoxActions(low=(-1.0, 0.0, -3.0), high=(1.0, 10.0, 1.0))


@pytest.fixture
def distribution():
    """Five of them, in float64."""
    generator = torch.Generator().manual_seed(0)
    return action_head(BOX).distribution(torch.randn(5, 6, generator=generator, dtype=torch.float64))


def test_means_and_deviations_are_in_units_of_the_box(distribution):
    mean, log_std = distribution.parameters[:, :3], distribution.parameters[:, 3:]
    torch.testing.assert_close(distribution.mean[:, 1], 5.0 + 5.0 * mean[:, 1])
    torch.testing.assert_close(distribution.mean[:, 2], -1.0 + 2.0 * mean[:, 2])
    half = torch.tensor([1.0, 5.0, 2.0], dtype=torch.float64)
    torch.testing.assert_close(distribution.log_std.exp(), half * log_std.exp())
    assert torch.equal(distribution.mode(), distribution.mean)


def test_density_and_entropy_are_scipys(distribution):
    actions = np.random.default_rng(0).normal(size=(5, 3)) * 3
    mean, std = distribution.mean.numpy(), distribution.log_std.exp().numpy()
    expected = stats.norm(mean, std).logpdf(actions).sum(axis=1)
    np.testing.assert_allclose(distribution.log_prob(torch.from_numpy(actions)), expected, rtol=1e-12)
    np.testing.assert_allclose(distribution.entropy(), stats.norm(mean, std).entropy().sum(axis=1), rtol=1e-12)
    narrow = action_head(BOX).distribution(torch.full((1, 6), -4.0))
    assert narrow.entropy() < 0


@pytest.mark.parametrize("way", ["sample", "draw"])
def test_samples_are_distributed_as_they_should_be(way):
    distribution = action_head(BOX).distribution(torch.tensor([0.3, -0.2, 0.1, -0.5, 0.2, 0.0]).expand(20_000, 6))
    uniforms = np.random.default_rng(1).random((20_000, 3))
    if way == "sample":
        actions = distribution.sample(torch.from_numpy(uniforms.astype(np.float32)))
    else:
        actions = distribution.draw(uniforms)
    assert actions.dtype == torch.float32
    scaled = (actions - distribution.mean) / distribution.log_std.exp()
    for axis in range(3):
        assert stats.kstest(scaled[:, axis].numpy(), "norm").pvalue > 0.01
    assert np.abs(np.corrcoef(scaled.numpy().T) - np.eye(3)).max() < 0.03


def test_no_number_makes_an_infinite_action():
    edges = torch.tensor([0.0, 1e-30, 0.5, 1.0 - 1e-7, 1.0])
    normal = standard_normal(edges)
    assert normal.isfinite().all() and normal.abs().max() < 5.3 and normal[2] == 0.0
    assert (normal.diff() >= 0).all()


def test_actions_are_clipped_at_the_environments_door_alone(distribution):
    head = action_head(BOX)
    actions = torch.tensor([[5.0, -1.0, 0.5], [0.25, 11.0, -7.0]])
    taken = head.for_environment(actions)
    assert taken.dtype == np.float32
    np.testing.assert_array_equal(taken, [[1.0, 0.0, 0.5], [0.25, 10.0, -3.0]])
    outside, inside = (
        distribution.log_prob(row.double().expand(5, 3)) for row in (actions[0], torch.from_numpy(taken[0]))
    )
    assert (outside != inside).all()


def test_the_previous_action_is_the_one_taken_in_units_of_the_box():
    previous = action_head(BOX).previous()
    actions = torch.tensor([[0.5, 7.5, 9.0], [0.5, 7.5, 9.0]])
    features = previous(actions, torch.tensor([False, True]))
    assert features.tolist() == [[0.5, 0.5, 1.0], [0.0, 0.0, 0.0]]
    assert not previous.state_dict()


def test_imitation_pulls_the_mean_and_leaves_the_deviation_alone():
    parameters = torch.tensor([[0.5, 0.0, 0.0, -1.0, 0.3, 0.0]], requires_grad=True)
    distribution = action_head(BOX).distribution(parameters)
    loss = distribution.imitation_loss(torch.tensor([[0.0, 5.0, 1.0]]))
    assert loss.item() == pytest.approx(0.5 * (0.5**2 + 0.0 + 1.0))
    loss.backward()
    assert parameters.grad.tolist() == [[0.5, 0.0, -1.0, 0.0, 0.0, 0.0]]
    assert distribution.agreement(distribution.mean.detach() + torch.tensor([0.09, 0.45, -0.19])) == 1.0
    assert distribution.agreement(distribution.mean.detach() + torch.tensor([0.0, 0.6, 0.0])) == 0.0


def test_what_the_head_says_of_itself():
    head = action_head(BOX)
    assert isinstance(head, GaussianHead)
    assert (head.size, head.noise_width, head.draw_width, head.shape, head.dtype) == (3, 3, 3, (3,), torch.float32)
    assert head.none_yet(4, 2).shape == (4, 2, 3) and np.isnan(head.unlabelled)
    sign = head.exploration(0.02)
    assert (sign.metric, sign.least) == ("action_std", 0.02)
    actor = head.actor(7, hidden=0)
    distribution = head.distribution(actor(torch.randn(9, 7)))
    assert distribution.diagnostics()["action_std"] == 1.0
    torch.testing.assert_close(distribution.mean, torch.tensor([0.0, 5.0, -1.0]).expand(9, 3), atol=0.3, rtol=0)
    assert [name for name, _ in actor.named_parameters()] == ["log_std", "mean.weight", "mean.bias"]
