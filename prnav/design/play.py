"""Playing a fixed list of episodes with a policy at a design, measures out: what searches and comparisons score by.

Smaller than an evaluation with records (``prnav-eval``): nothing is kept but the measures. E episodes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from prnav.policy import Policy

Measures = dict[str, NDArray[np.float64]]


class PlayableEnvs(Protocol):
    """Vector environments that can begin chosen episodes with chosen designs."""

    num_envs: int

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """``options={"episodes": indices}`` begins these."""
        ...

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One step in each agent."""
        ...

    def set_designs(self, agents: ArrayLike, theta: ArrayLike) -> None:
        """Designs from the next episode on."""
        ...


def play(
    policy: Policy,
    envs: PlayableEnvs,
    episodes: ArrayLike,
    theta: ArrayLike,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Measures:
    """Measures of each of ``episodes`` (E,) played once by sampled actions, each (E,) float64.

    The random numbers of an episode belong to it and its place in the list, whatever else is played.

    Args:
        policy: what acts.
        envs: environments over a source that has these episodes.
        episodes: rows of the source, (E,).
        theta: the design that all play with, normalised (K, 7).
        seed: of the actions.
        progress: called with episodes done and in all.
    """
    rows = np.asarray(episodes, np.int64)
    parts: list[Measures] = []
    for first in range(0, len(rows), envs.num_envs):
        chunk = rows[first : first + envs.num_envs]
        parts.append(_play_at_once(policy, envs, chunk, np.asarray(theta, np.float64), (seed, first)))
        progress(min(first + envs.num_envs, len(rows)), len(rows))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


@torch.inference_mode()
def _play_at_once(
    policy: Policy,
    envs: PlayableEnvs,
    episodes: NDArray[np.int64],
    theta: NDArray[np.float64],
    key: tuple[int, int],
) -> Measures:
    count, playing = envs.num_envs, len(episodes)
    filled = np.resize(episodes, count)  # the last agents play some once more; nobody looks
    envs.set_designs(np.arange(count), np.broadcast_to(theta, (count, *theta.shape)))
    observations, _ = envs.reset(seed=0, options={"episodes": filled})
    device = policy.device
    state = policy.initial_state(count)
    previous = policy.initial_actions(count)
    starts = torch.ones(count, dtype=torch.bool, device=device)
    generators = [np.random.Generator(np.random.PCG64([key[0], key[1] + i])) for i in range(count)]
    waiting = np.arange(count) < playing
    result: Measures = {}
    while waiting.any():
        inputs = {
            name: torch.from_numpy(np.ascontiguousarray(observations[name])).to(device)
            for name in policy.observation_specs
        }
        output = policy.step(inputs, previous, starts, state)
        state = output.state
        noise = np.stack([generator.uniform(1e-7, 1.0 - 1e-7, policy.head.noise_width) for generator in generators])
        actions = output.distribution.sample(torch.from_numpy(noise.astype(np.float32)).to(device))
        observations, _, terminated, truncated, info = envs.step(policy.head.for_environment(actions))
        ended = np.asarray(terminated) | np.asarray(truncated)
        previous, starts = actions, torch.from_numpy(ended).to(device)
        for name, values in info.get("final_info", {}).items() if (ended & waiting).any() else ():
            if not name.startswith("_") and np.asarray(values).dtype.kind in "biuf":
                over = np.flatnonzero(ended & waiting)
                result.setdefault(name, np.zeros(playing))[over] = np.asarray(values, np.float64)[over]
        waiting &= ~ended
    return result
