"""Seeds of the episodes that an environment plays: a sequence without end, which its own seed names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from prnav.errors import ConfigError


def episode_seed(seed: int, number: int) -> int:
    """Seed, 0 to 2^32 - 1, of the ``number``-th episode of an environment seeded ``seed``."""
    return int(np.random.SeedSequence((seed, number)).generate_state(1)[0])


class EpisodeSeeds:
    """Endless sequences of episode seeds, one per slot; a slot's sequence depends on its own seed alone."""

    def __init__(self, seeds: NDArray[np.int64]):
        if len(seeds) and int(np.min(seeds)) < 0:
            raise ConfigError(f"seed is {int(np.min(seeds))}; it must be 0 or above")
        self.seeds = np.array(seeds, np.int64)  #: (N,)
        self.drawn = np.zeros(len(self.seeds), np.int64)  #: episodes drawn so far, (N,)

    def draw(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """Seed of the next episode of each slot (n,)."""
        drawn = [episode_seed(int(self.seeds[slot]), int(self.drawn[slot])) for slot in slots]
        self.drawn[slots] += 1
        return np.array(drawn, np.int64)


def seeds_of(seed: int | Sequence[int | None] | None, num: int) -> NDArray[np.int64]:
    """Seeds (num,) of environments: ``seed`` counted up, those given one by one, or random ones for None.

    Raises:
        ConfigError: not one seed, and not as many as there are environments.
    """
    if seed is None:
        seed = int(np.random.SeedSequence().generate_state(1)[0])
    if isinstance(seed, int | np.integer):
        return int(seed) + np.arange(num)
    given = [value for value in seed if value is not None]
    if len(seed) != num or len(given) != num:
        raise ConfigError(f"seed is {seed!r}; it must be one integer, or {num} of them")
    return np.array(given, np.int64)
