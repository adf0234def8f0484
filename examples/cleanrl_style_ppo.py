"""PPO in one file over ``gymnasium.make_vec``, in the manner of CleanRL: no part of prnav but its environments.

The agent has no memory; it shows how the vector environment is used, not how to train well (that is ``prnav-train``).
"""

import argparse

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical

import prnav  # noqa: F401 (registers the environments)


class Agent(nn.Module):
    """Actor and critic over the flattened observation."""

    def __init__(self, inputs: int, actions: int):
        super().__init__()
        self.body = nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh())
        self.actor, self.critic = nn.Linear(128, actions), nn.Linear(128, 1)

    def forward(self, seen):
        """Distribution of actions, and values (N,)."""
        hidden = self.body(seen)
        return Categorical(logits=self.actor(hidden)), self.critic(hidden)[:, 0]


def flat(observations) -> torch.Tensor:
    """Observations (N, ...) as rows (N, F)."""
    rows = [observations[key].reshape(len(observations[key]), -1) for key in sorted(observations)]
    return torch.from_numpy(np.concatenate(rows, axis=1).astype(np.float32))


def main(steps: int = 8192, num_envs: int = 8, rollout: int = 32, seed: int = 0, **settings) -> list[float]:
    """Train for so many steps; the mean loss of each update. ``settings`` are those of ``PointGoalEnvConfig``."""
    torch.manual_seed(seed)
    settings = {"scenes": "val", "max_scenes": 2, "rays_per_receptor": 1, **settings}
    envs = gymnasium.make_vec(
        "prnav/PointGoalNav-v0", num_envs=num_envs, vectorization_mode="vector_entry_point", **settings
    )
    observations, _ = envs.reset(seed=seed)
    agent = Agent(flat(observations).shape[1], int(envs.single_action_space.n))
    optimizer = torch.optim.Adam(agent.parameters(), lr=3e-4, eps=1e-5)
    losses = []
    for _ in range(steps // (rollout * num_envs)):
        seen, actions, log_probs, values, rewards, ends = [], [], [], [], [], []
        for _ in range(rollout):
            with torch.no_grad():
                seen.append(flat(observations))
                policy, value = agent(seen[-1])
                actions.append(policy.sample())
                log_probs.append(policy.log_prob(actions[-1]))
            observations, reward, terminated, truncated, info = envs.step(actions[-1].numpy())
            if truncated.any():  # a time limit: what would have followed still counts
                cut = np.flatnonzero(truncated)
                final = {key: np.stack([info["final_obs"][row][key] for row in cut]) for key in observations}
                with torch.no_grad():
                    reward[cut] += 0.99 * agent(flat(final))[1].numpy()
            values.append(value)
            rewards.append(torch.from_numpy(reward.astype(np.float32)))
            ends.append(torch.from_numpy((terminated | truncated).astype(np.float32)))
        with torch.no_grad():
            following = agent(flat(observations))[1]
        advantage, advantages = torch.zeros(num_envs), []
        for t in reversed(range(rollout)):
            error = rewards[t] + 0.99 * following * (1 - ends[t]) - values[t]
            advantage = error + 0.99 * 0.95 * (1 - ends[t]) * advantage
            advantages.insert(0, advantage)
            following = values[t]
        batch = [torch.cat(rows) for rows in (seen, actions, log_probs, values, advantages)]
        returns = batch[4] + batch[3]
        scaled = (batch[4] - batch[4].mean()) / (batch[4].std() + 1e-8)
        for _ in range(4):
            policy, value = agent(batch[0])
            ratio = (policy.log_prob(batch[1]) - batch[2]).exp()
            surrogate = torch.minimum(ratio * scaled, ratio.clamp(0.8, 1.2) * scaled).mean()
            loss = 0.5 * (value - returns).square().mean() - surrogate - 0.01 * policy.entropy().mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()
        losses.append(loss.item())
    envs.close()
    return losses


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=8192)
    for number, value in enumerate(main(parser.parse_args().steps)):
        print(f"update {number + 1}: loss {value:.3f}")  # noqa: T201
