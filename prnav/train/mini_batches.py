"""Whether a rollout can be cut into as many mini-batches as a config asks for."""

from __future__ import annotations

from prnav.policy import PolicyConfig
from prnav.train.imitation import ImitationConfig
from prnav.train.ppo import PPOConfig


def check_mini_batches(ppo: PPOConfig, imitation: ImitationConfig, policy: PolicyConfig, num_envs: int) -> None:
    """Hold the mini-batches of both phases to what the memory can learn alone.

    An LSTM learns whole environments, other memories single steps.

    Raises:
        ValueError: there would be more mini-batches than such parts.
    """
    whole, steps = policy.memory == "lstm", ppo.rollout_steps
    if whole and ppo.mini_batch_steps and ppo.mini_batch_steps < steps:
        raise ValueError(
            f"ppo.mini_batch_steps is {ppo.mini_batch_steps} and ppo.rollout_steps {steps}; mini-batches of an LSTM "
            f"are made of whole environments, so it must be at least {steps}; or use policy.memory = 'stack' or 'none'"
        )
    for name, parts in (("ppo", ppo.parts(num_envs)), ("imitation", imitation.mini_batches)):
        if whole and parts > num_envs:
            raise ValueError(
                f"{name}.mini_batches is {parts}; it must be at most num_envs ({num_envs}), "
                f"since mini-batches are made of whole environments"
            )
        if parts > num_envs * steps:
            raise ValueError(
                f"{name}.mini_batches is {parts}; it must be at most {num_envs * steps}, the steps of a rollout"
            )
