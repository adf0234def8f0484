"""Validation: how the policy does on homes that it does not learn from, while it learns."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from prnav.contracts import BatchEnv
from prnav.policy import Policy
from prnav.train.rollout import as_tensor, final_measures

SCORES = ("spl", "success", "reward")
"""Measures by which policies are ranked: the first one that the task has."""


@torch.no_grad()
def validate(
    policy: Policy, envs: BatchEnv, seed: int, longest: int = 10_000
) -> tuple[dict[str, float], NDArray[np.float64] | None]:
    """Mean measures of one episode of each environment, acting as in training: by sampling, with fixed noise.

    Environment i plays episode i, where environments know such an option of their reset.

    Args:
        policy: What is asked.
        envs: Its environments; as many episodes are played.
        seed: Of their episodes and the noise.
        longest: Steps after which an episode that has not ended is left out.

    Returns:
        Mean measures, and where the first agent walked, (steps + 1, 3) [m], or None where environments do not say.
    """
    device = policy.device
    generator = np.random.Generator(np.random.PCG64(seed))
    observations, _ = envs.reset(seed=seed, options={"episodes": np.arange(envs.num_envs)})
    count = envs.num_envs
    state = policy.initial_state(count)
    starts, playing = np.ones(count, dtype=bool), np.ones(count, dtype=bool)
    actions = policy.initial_actions(count)
    measures: list[dict[str, float]] = []
    path = [_first_position(envs)]
    for _ in range(longest):
        shown = {key: as_tensor(observations[key]).to(device) for key in policy.observation_specs}
        output = policy.step(shown, actions, torch.from_numpy(starts).to(device), state)
        noise = generator.random((count, policy.head.noise_width), dtype=np.float32).clip(1e-7, 1.0 - 1e-7)
        state, actions = output.state, output.distribution.sample(torch.from_numpy(noise).to(device))
        observations, _, terminated, truncated, info = envs.step(policy.head.for_environment(actions))
        starts = terminated | truncated
        measures += final_measures(info, np.flatnonzero(starts & playing))
        playing &= ~starts
        if playing[0]:
            path.append(_first_position(envs))
        if not playing.any():
            break
    means = {key: float(np.mean([row[key] for row in measures])) for key in (measures[0] if measures else ())}
    return means, None if path[0] is None else np.array(path)


def score(measures: dict[str, float]) -> float:
    """The number by which policies are ranked; more is better."""
    return next((measures[name] for name in SCORES if name in measures), float("-inf"))


def _first_position(envs: BatchEnv) -> NDArray[np.float64] | None:
    slots = getattr(envs, "slots", None)
    return None if slots is None else slots.positions[0].copy()
