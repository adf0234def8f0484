"""Random numbers that belong to a step of an episode, whoever runs it and whenever.

A number is a hash of (seed, scene, episode, step): no generator is carried from step to step, so that neither the
batch an episode runs in, nor the order of the episodes, nor a resumed run can change what is drawn.
"""

from __future__ import annotations

import hashlib
import json

import numpy as np
from numpy.typing import ArrayLike, NDArray


def episode_key(seed: int, scene_id: str, episode_id: str) -> int:
    """64-bit key of an episode under a seed (the first eight bytes of a SHA-256)."""
    text = json.dumps([int(seed), scene_id, episode_id])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def uniforms(keys: ArrayLike, steps: ArrayLike) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1) for episode keys (N,) uint64 at steps (N,), by SplitMix64 (Steele et al. 2014)."""
    state = np.asarray(keys, dtype=np.uint64) + (np.asarray(steps, dtype=np.uint64) + np.uint64(1)) * np.uint64(
        0x9E3779B97F4A7C15
    )
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return ((state ^ (state >> np.uint64(31))) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def uniforms_of_width(keys: ArrayLike, steps: ArrayLike, width: int) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1), (N, W), W of them for each step; with W = 1 those of :func:`uniforms`."""
    numbers = np.asarray(steps, dtype=np.uint64)[:, None] * np.uint64(width) + np.arange(width, dtype=np.uint64)
    return uniforms(np.asarray(keys, dtype=np.uint64)[:, None], numbers)
