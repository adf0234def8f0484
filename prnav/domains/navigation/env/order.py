"""In which order an environment plays episodes: a seeded shuffle of all, then another one, without end.

A shuffle is a permutation computed place by place (a Feistel network on the place's bits, walked until it lands below
the count), so that millions of episodes times many agents need no memory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prnav.errors import ConfigError
from prnav.splitmix import GOLDEN, MASK, mix

_ROUNDS = 6


class EpisodeOrder:
    """Endless orders of ``count`` episodes, one per slot; a slot's order depends on its own seed alone."""

    def __init__(self, count: int, seeds: NDArray[np.int64]):
        if len(seeds) and int(np.min(seeds)) < 0:
            raise ConfigError(f"seed is {int(np.min(seeds))}; it must be 0 or above")
        self.count = count
        self.seeds = np.array(seeds, np.int64)  #: (N,)
        self.drawn = np.zeros(len(self.seeds), np.int64)  #: episodes drawn so far, (N,)

    def draw(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """The next episode of each slot (n,)."""
        result = np.empty(len(slots), np.int64)
        for row, slot in enumerate(slots.tolist()):
            epoch, place = divmod(int(self.drawn[slot]), self.count)
            result[row] = shuffled(place, self.count, int(self.seeds[slot]), epoch)
            self.drawn[slot] += 1
        return result


def shuffled(place: int, count: int, seed: int, epoch: int) -> int:
    """What stands at ``place`` of the permutation of ``range(count)`` that seed and epoch name."""
    half = max(1, ((count - 1).bit_length() + 1) // 2)
    low = (1 << half) - 1
    key = _mix(_mix(seed) ^ epoch)
    while True:
        left, right = place >> half, place & low
        for step in range(_ROUNDS):
            left, right = right, left ^ (_mix(key + (right << 8) + step) & low)
        place = left << half | right
        if place < count:
            return place


def _mix(value: int) -> int:
    """The first number of the generator seeded ``value``."""
    return mix((value + GOLDEN) & MASK)
