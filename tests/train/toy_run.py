"""Small runs on the toy task."""

from prnav.policy import PolicyConfig
from prnav.train import ImitationConfig, PPOConfig, TrainConfig


def toy_config(**changes) -> TrainConfig:
    """A run of 10 updates of 8 x 16 steps."""
    ppo = PPOConfig(rollout_steps=16, learning_rate=3e-3, epochs=2, mini_batches=2)
    policy = PolicyConfig(encoder="compact", width=16, lstm_hidden=16)
    values = {"total_steps": 10 * 128, "num_envs": 8, "threads": 2, "checkpoint_steps": 384, "ppo": ppo}
    return TrainConfig(**{**values, "policy": policy, "imitation": ImitationConfig(), **changes})
