"""PPO's mathematics against slow loops and numbers worked out by hand."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from prnav.policy import Categorical
from prnav.train import PPOConfig, ppo


def advantages_by_definition(rewards, values, next_values, terminated, truncated, discount, gae_lambda):
    """The sum over the rest of the episode of (discount * lambda)^k times each step's error."""
    steps, environments = rewards.shape
    result = np.zeros((steps, environments))
    for n in range(environments):
        for t in range(steps):
            for k in range(t, steps):
                after = 0.0 if terminated[k, n] else next_values[k, n]
                error = rewards[k, n] + discount * after - values[k, n]
                result[t, n] += (discount * gae_lambda) ** (k - t) * error
                if terminated[k, n] or truncated[k, n]:
                    break
    return result


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 4), st.floats(0, 1), st.floats(0, 1))
def test_advantages_equal_their_definition(seed, steps, environments, discount, gae_lambda):
    rng = np.random.default_rng(seed)
    rewards, values, next_values = rng.normal(size=(3, steps, environments))
    terminated = rng.random((steps, environments)) < 0.2
    truncated = (rng.random((steps, environments)) < 0.2) & ~terminated
    expected = advantages_by_definition(rewards, values, next_values, terminated, truncated, discount, gae_lambda)
    tensors = [torch.from_numpy(array) for array in (rewards, values, next_values, terminated, truncated)]
    result = ppo.advantages(*tensors, discount, gae_lambda)
    np.testing.assert_allclose(result.numpy(), expected, atol=1e-10)


def test_advantages_by_hand():
    """Two steps, discount 1/2, lambda 1/2: errors 1 + 2/2 - 1 = 1 and 2 + 4/2 - 2 = 2, so 1 + 2/4 and 2."""
    column = lambda *values: torch.tensor(values, dtype=torch.float64)[:, None]  # noqa: E731
    no = torch.zeros(2, 1, dtype=torch.bool)
    result = ppo.advantages(column(1, 2), column(1, 2), column(2, 4), no, no, 0.5, 0.5)
    assert result[:, 0].tolist() == [1.5, 2.0]


def test_with_lambda_one_returns_are_discounted_rewards():
    rewards = torch.tensor([[1.0], [2.0], [3.0]])
    values = torch.tensor([[5.0], [6.0], [7.0]])
    end = torch.tensor([[False], [False], [True]])
    following = ppo.following_values(values, torch.tensor([100.0]), torch.zeros_like(end), torch.zeros_like(values))
    result = ppo.advantages(rewards, values, following, end, torch.zeros_like(end), 0.9, 1.0) + values
    torch.testing.assert_close(result[:, 0], torch.tensor([1 + 0.9 * 2 + 0.81 * 3, 2 + 0.9 * 3, 3.0]))


def test_a_time_limit_counts_the_value_of_where_it_cut_and_nothing_of_the_next_episode():
    values = torch.tensor([[1.0], [50.0]])
    truncated = torch.tensor([[True], [False]])
    final = torch.tensor([[4.0], [0.0]])
    following = ppo.following_values(values, torch.tensor([60.0]), truncated, final)
    assert following[:, 0].tolist() == [4.0, 60.0]
    no = torch.zeros_like(truncated)
    rewards = torch.ones(2, 1)
    result = ppo.advantages(rewards, values, following, no, truncated, 0.5, 1.0)
    assert result[0, 0] == 1 + 0.5 * 4 - 1
    ended = ppo.advantages(rewards, values, following, truncated, no, 0.5, 1.0)
    assert ended[0, 0] == 1 - 1


def test_endless_reward_of_one_is_worth_one_over_one_minus_discount():
    """A critic that knows it has no error at a time limit."""
    values = torch.full((6, 2), 1 / (1 - 0.9))
    truncated = torch.zeros(6, 2, dtype=torch.bool)
    truncated[2, 0] = truncated[4, 1] = True
    following = ppo.following_values(values, values[0], truncated, values)
    result = ppo.advantages(torch.ones(6, 2), values, following, torch.zeros_like(truncated), truncated, 0.9, 0.95)
    assert result.abs().max() < 1e-5


def test_clipped_surrogate_by_hand():
    """Ratios 1.5 and 0.5, clip 0.2: gains stop at 1.2 and 0.8, losses do not."""
    ratio = torch.tensor([1.5, 1.5, 0.5, 0.5])
    advantage = torch.tensor([1.0, -1.0, 1.0, -1.0])
    loss = ppo.clipped_surrogate(ratio.log(), torch.zeros(4), advantage, 0.2)
    assert loss.item() == pytest.approx(-(1.2 - 1.5 + 0.5 - 0.8) / 4)


def test_no_gradient_beyond_the_clip():
    log_probs = torch.tensor([0.5, -0.5], requires_grad=True)
    ppo.clipped_surrogate(log_probs, torch.zeros(2), torch.tensor([1.0, -1.0]), 0.2).backward()
    assert log_probs.grad.tolist() == [0.0, 0.0]


def test_value_loss_by_hand():
    values, old, returns = torch.tensor([2.0]), torch.tensor([1.0]), torch.tensor([3.0])
    assert ppo.value_loss(values, old, returns).item() == 0.5
    assert ppo.value_loss(values, old, returns, clip=0.2).item() == pytest.approx(0.5 * 1.8**2)


def test_ppo_loss_puts_its_parts_together():
    generator = torch.Generator().manual_seed(0)
    logits, values = torch.randn(3, 2, 4, generator=generator), torch.randn(3, 2, generator=generator)
    batch = {name: torch.randn(3, 2, generator=generator) for name in ("log_probs", "values", "advantages", "returns")}
    batch["actions"] = torch.randint(0, 4, (3, 2), generator=generator)
    config = PPOConfig(entropy_coefficient=0.1, value_coefficient=0.25)
    loss, parts = ppo.ppo_loss(Categorical(logits), values, batch, config)
    expected = parts["policy_loss"] + 0.25 * parts["value_loss"] - 0.1 * parts["entropy"]
    assert loss.item() == pytest.approx(expected.item())
    distribution = torch.distributions.Categorical(logits=logits)
    assert parts["entropy"].item() == pytest.approx(distribution.entropy().mean().item(), abs=1e-6)
    ratio = (distribution.log_prob(batch["actions"]) - batch["log_probs"]).exp()
    assert parts["clip_fraction"].item() == pytest.approx(((ratio - 1).abs() > 0.2).float().mean().item())


def test_normalized_and_explained_variance():
    values = torch.tensor([1.0, 2.0, 3.0, 6.0])
    assert ppo.normalized(values).mean().abs() < 1e-6
    assert ppo.normalized(values).square().mean().item() == pytest.approx(1.0)
    assert (ppo.normalized(torch.ones(4)) == 0).all()
    assert ppo.explained_variance(values, values) == 1.0
    assert ppo.explained_variance(torch.zeros(4), values) == 0.0


def test_defaults_are_the_papers():
    config = PPOConfig()
    assert (config.rollout_steps, config.epochs, config.mini_batches) == (64, 4, 1)
    assert (config.learning_rate, config.clip) == (2.5e-4, 0.2)
    assert (config.discount, config.gae_lambda) == (0.99, 0.95)


def test_config_says_what_is_wrong():
    with pytest.raises(ValueError, match=r"discount is 1.5; it must be in \[0, 1\]"):
        PPOConfig(discount=1.5)
    with pytest.raises(ValueError, match="learning_rate is 0.0; it must be positive"):
        PPOConfig(learning_rate=0.0)
