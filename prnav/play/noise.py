"""Random numbers that belong to a step of an episode, whoever runs it and whenever.

A number is a hash of (seed, scene, episode, step): no generator is carried from step to step, so that neither the
batch an episode runs in, nor the order of the episodes, nor a resumed run can change what is drawn.
"""

from __future__ import annotations

import hashlib
import json

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.splitmix import splitmix64, unit_interval


def episode_key(seed: int, scene_id: str, episode_id: str) -> int:
    """64-bit key of an episode under a seed (the first eight bytes of a SHA-256)."""
    text = json.dumps([int(seed), scene_id, episode_id])
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def uniforms(keys: ArrayLike, steps: ArrayLike) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1) for episode keys (N,) uint64 at steps (N,)."""
    return unit_interval(splitmix64(np.asarray(keys, np.uint64), np.asarray(steps, np.uint64)))


def uniforms_of_width(keys: ArrayLike, steps: ArrayLike, width: int) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1), (N, W), W of them for each step; with W = 1 those of :func:`uniforms`."""
    numbers = np.asarray(steps, dtype=np.uint64)[:, None] * np.uint64(width) + np.arange(width, dtype=np.uint64)
    return uniforms(np.asarray(keys, dtype=np.uint64)[:, None], numbers)
