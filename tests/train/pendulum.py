"""Trains PPO with the Gaussian head and the stack memory on Pendulum: ``python pendulum.py FOLDER SEED``."""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import torch
from reach_env import GymnasiumEnv

from prnav.policy import PolicyConfig
from prnav.train import PPOConfig, RunFolder, TrainConfig, Trainer

CONFIG = TrainConfig(
    total_steps=300_000,
    num_envs=8,
    groups=1,
    threads=1,
    checkpoint_steps=10**6,
    policy=PolicyConfig(encoder="state", width=64, memory="stack", frames=3, head_hidden=64),
    ppo=PPOConfig(
        rollout_steps=256,
        epochs=10,
        mini_batch_steps=256,
        learning_rate=1e-3,
        discount=0.95,
        gae_lambda=0.95,
        entropy_coefficient=0.0,
        linear_decay=True,
    ),
)


@torch.no_grad()
def evaluate(policy, episodes: int = 10, seed: int = 12345) -> float:
    """Mean return of so many episodes by the policy's mode."""
    envs = GymnasiumEnv("Pendulum-v1", episodes)
    observations, _ = envs.reset(seed=seed)
    state, actions = policy.initial_state(episodes), policy.initial_actions(episodes)
    starts = torch.ones(episodes, dtype=torch.bool)
    while True:
        seen = {"state": torch.from_numpy(observations["state"])}
        step = policy.step(seen, actions, starts, state)
        state, actions, starts = step.state, step.distribution.mode(), torch.zeros_like(starts)
        observations, _, terminated, truncated, info = envs.step(policy.head.for_environment(actions))
        if (terminated | truncated).all():
            return float(np.mean(info["final_info"]["return"]))


def train(folder: Path, seed: int, report=lambda row: None) -> float:
    """Mean return of ten evaluation episodes after the run."""
    from dataclasses import replace

    config = replace(CONFIG, seed=seed)
    trainer = Trainer(config, GymnasiumEnv("Pendulum-v1", config.num_envs), RunFolder(folder), report)
    trainer.train()
    trainer.close()
    return evaluate(trainer.policy.eval())


if __name__ == "__main__":

    def show(row):
        if row["update"] % 15 == 0:
            sys.stdout.write(
                f"{row['step']} {row['measures']} {row['losses']} {row['times']['steps_per_second']:.0f}\n"
            )
            sys.stdout.flush()

    sys.stdout.write(f"{train(Path(sys.argv[1]), int(sys.argv[2]), show)}\n")
