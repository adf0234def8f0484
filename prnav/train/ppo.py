"""The mathematics of PPO as pure functions: advantages, losses, and what to watch.

Sources: Schulman et al. 2017 (PPO), Schulman et al. 2016 (GAE); the paper's hyper-parameters, section "Training
Process". Letters in shapes: T steps, N environments, M rows of a mini-batch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from prnav.checks import require_at_least, require_positive, require_share
from prnav.policy import ActionDistribution

Batch = Mapping[str, Tensor]
Losses = tuple[Tensor, dict[str, Tensor]]


@dataclass(frozen=True)
class PPOConfig:
    """Hyper-parameters. The first block is the paper's; on the second the paper is silent."""

    rollout_steps: int = 64
    epochs: int = 4
    mini_batches: int = 1
    """Parts that a rollout is split into, each one gradient step: whole environments, or single steps where the memory
    lets them be learnt alone."""
    mini_batch_steps: int = 0
    """Steps in a part, all environments' counted, in place of ``mini_batches``; 0 is off. The last one may be smaller:
    parts are as even as can be."""
    learning_rate: float = 2.5e-4
    clip: float = 0.2
    discount: float = 0.99
    gae_lambda: float = 0.95

    entropy_coefficient: float = 0.01
    value_coefficient: float = 0.5
    max_grad_norm: float = 0.5
    adam_epsilon: float = 1e-5
    normalize_advantages: bool = True
    value_clip: float = 0.0
    """How far a value may move from the rollout's before its loss stops pulling; 0 is off."""
    linear_decay: bool = False
    """Whether the learning rate falls linearly to 0 over the steps of the run that PPO does."""
    linear_clip_decay: bool = False
    """Whether ``clip`` falls likewise."""

    def __post_init__(self) -> None:
        require_at_least(self, 1, "rollout_steps", "epochs", "mini_batches")
        if self.mini_batch_steps < 0:
            raise ValueError(f"mini_batch_steps is {self.mini_batch_steps}; it must be at least 1, or 0 to be off")
        if self.mini_batch_steps and self.mini_batches > 1:
            raise ValueError(
                f"mini_batches is {self.mini_batches} and mini_batch_steps {self.mini_batch_steps}; give one of them"
            )
        require_share(self, "discount", "gae_lambda")
        require_positive(self, "learning_rate", "clip", "max_grad_norm", "adam_epsilon")
        require_at_least(self, 0, "entropy_coefficient", "value_coefficient", "value_clip")

    def parts(self, environments: int) -> int:
        """Mini-batches of a whole rollout of so many environments."""
        if not self.mini_batch_steps:
            return self.mini_batches
        return -(-self.rollout_steps * environments // self.mini_batch_steps)


def following_values(values: Tensor, last_values: Tensor, truncated: Tensor, final_values: Tensor) -> Tensor:
    """Value of the state that each step led to, (T, N).

    Args:
        values: Value of the state that each step began in, (T, N).
        last_values: Value of the state after the last step, (N,).
        truncated: Whether the step hit a time limit, (T, N) bool. The state it led to is then not the next row's,
            which belongs to a new episode.
        final_values: Where ``truncated``, the value of the state in which the episode was cut off, (T, N).
    """
    return torch.where(truncated, final_values, torch.cat([values[1:], last_values[None]]))


def advantages(
    rewards: Tensor,
    values: Tensor,
    next_values: Tensor,
    terminated: Tensor,
    truncated: Tensor,
    discount: float,
    gae_lambda: float,
) -> Tensor:
    """Generalised advantage estimates, (T, N).

    Args:
        rewards: Reward of each step, (T, N).
        values: Value of the state it began in, (T, N).
        next_values: Value of the state it led to, (T, N), from :func:`following_values`.
        terminated: The episode ended for good: nothing follows, the value after it is 0. (T, N) bool.
        truncated: The episode was cut off by a time limit: the value after it counts, the next row does not.
        discount: Gamma.
        gae_lambda: Lambda.
    """
    deltas = rewards + discount * next_values * (~terminated).to(rewards.dtype) - values
    carry = discount * gae_lambda * (~(terminated | truncated)).to(rewards.dtype)
    result = torch.empty_like(rewards)
    following = torch.zeros_like(rewards[0])
    for t in range(len(rewards) - 1, -1, -1):
        following = deltas[t] + carry[t] * following
        result[t] = following
    return result


def moments(values: Tensor) -> Tensor:
    """Count, sum and sum of squares of ``values``, (3,) float64 on the host; those of several workers add up."""
    exact = values.double()
    return torch.stack([exact.new_tensor(exact.numel()), exact.sum(), exact.square().sum()]).cpu()


def normalized(values: Tensor, of: Tensor | None = None) -> Tensor:
    """``values`` shifted and scaled so that all values have mean 0 and variance 1 (all 0 where they do not differ).

    Args:
        values: Anything shape.
        of: :func:`moments` of all values, these among them; these alone if not given.
    """
    count, total, squares = (moments(values) if of is None else of).tolist()
    mean = float(total / count)
    deviation = float(max(squares / count - mean * mean, 0.0) ** 0.5)
    return (values - mean) / (deviation + 1e-8)


def clipped_surrogate(log_probs: Tensor, old_log_probs: Tensor, advantage: Tensor, clip: float) -> Tensor:
    """The paper's L(omega) with its sign turned, so that less is better; scalar."""
    ratio = torch.exp(log_probs - old_log_probs)
    return -torch.minimum(ratio * advantage, ratio.clamp(1.0 - clip, 1.0 + clip) * advantage).mean()


def value_loss(values: Tensor, old_values: Tensor, returns: Tensor, clip: float = 0.0) -> Tensor:
    """Half the mean squared error of the critic; with ``clip``, the larger of it and that of the clipped values."""
    error = (values - returns).square()
    if clip:
        kept = old_values + (values - old_values).clamp(-clip, clip)
        error = torch.maximum(error, (kept - returns).square())
    return 0.5 * error.mean()


def ppo_loss(distribution: ActionDistribution, values: Tensor, batch: Batch, config: PPOConfig) -> Losses:
    """Loss of a batch and its parts.

    Args:
        distribution: Of the policy as it is now, M of them.
        values: Of the critic as it is now, (M,).
        batch: "actions" (M, ...) of the rollout, and "log_probs", "values", "advantages", "returns", each (M,).
        config: Coefficients.
    """
    log_probs = distribution.log_prob(batch["actions"])
    policy = clipped_surrogate(log_probs, batch["log_probs"], batch["advantages"], config.clip)
    value = value_loss(values, batch["values"], batch["returns"], config.value_clip)
    entropy = distribution.entropy().mean()
    loss = policy + config.value_coefficient * value - config.entropy_coefficient * entropy
    with torch.no_grad():
        log_ratio = log_probs - batch["log_probs"]
        parts = {
            "policy_loss": policy,
            "value_loss": value,
            "entropy": entropy,
            "kl": (torch.expm1(log_ratio) - log_ratio).mean(),
            "clip_fraction": ((log_ratio.exp() - 1.0).abs() > config.clip).float().mean(),
            **distribution.diagnostics(),
        }
    return loss, {name: part.detach() for name, part in parts.items()}


def explained_variance(values: Tensor, returns: Tensor) -> float:
    """Share of the returns' variance that the critic foretells: 1 is perfect, 0 is no better than their mean."""
    variance = returns.var(correction=0)
    return float(1.0 - (returns - values).var(correction=0) / variance) if variance > 0 else 0.0
