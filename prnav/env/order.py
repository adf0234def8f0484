"""In which order an environment plays episodes: a seeded shuffle, then another one, without end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class EpisodeOrder:
    """Endless orders of ``count`` episodes, one per slot; a slot's order depends on its own seed alone."""

    def __init__(self, count: int, seeds: NDArray[np.int64]):
        self.count = count
        self.seeds = np.array(seeds, np.int64)  #: (N,)
        self.drawn = np.zeros(len(self.seeds), np.int64)  #: episodes drawn so far, (N,)
        self._shuffles: dict[int, tuple[int, NDArray[np.int64]]] = {}

    def draw(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """The next episode of each slot (n,)."""
        result = np.empty(len(slots), np.int64)
        for row, slot in enumerate(slots):
            epoch, place = divmod(int(self.drawn[slot]), self.count)
            result[row] = self._shuffle(int(slot), epoch)[place]
            self.drawn[slot] += 1
        return result

    def _shuffle(self, slot: int, epoch: int) -> NDArray[np.int64]:
        stored = self._shuffles.get(slot)
        if stored is None or stored[0] != epoch:
            generator = np.random.Generator(np.random.PCG64([int(self.seeds[slot]), epoch]))
            stored = (epoch, generator.permutation(self.count))
            self._shuffles[slot] = stored
        return stored[1]
