"""A small integer random generator whose numbers never depend on a library's version."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from prnav.splitmix import GOLDEN, MASK, mix

T = TypeVar("T")


class Rng:
    """SplitMix64 (Steele, Lea and Flood 2014). All draws are integers."""

    def __init__(self, seed: int) -> None:
        self._state = seed & MASK

    def bits(self) -> int:
        """The next 64 bits."""
        self._state = (self._state + GOLDEN) & MASK
        return mix(self._state)

    def below(self, count: int) -> int:
        """An integer in [0, count)."""
        return ((self.bits() >> 11) * count) >> 53

    def between(self, low: int, high: int, step: int = 1) -> int:
        """One of low, low + step, ... up to ``high`` at most (``low`` where ``high`` is below it)."""
        return low + step * self.below(max(0, high - low) // step + 1)

    def chance(self, percent: int) -> bool:
        """True in ``percent`` of 100 draws."""
        return self.below(100) < percent

    def choice(self, items: Sequence[T]) -> T:
        """One of the items."""
        return items[self.below(len(items))]

    def weighted(self, items: Sequence[tuple[T, int]]) -> T:
        """One of ``(item, weight)`` pairs, by weight."""
        draw = self.below(sum(weight for _, weight in items))
        for item, weight in items:
            draw -= weight
            if draw < 0:
                return item
        raise AssertionError("weights are positive")

    def shuffled(self, items: Sequence[T]) -> list[T]:
        """The items in a random order, as a new list."""
        result = list(items)
        for i in range(len(result) - 1, 0, -1):
            j = self.below(i + 1)
            result[i], result[j] = result[j], result[i]
        return result

    def fork(self, label: str) -> Rng:
        """A generator of its own for one purpose, so that a change in one place leaves the others' draws alone."""
        value = 0xCBF29CE484222325 ^ self._state
        for byte in label.encode():
            value = ((value ^ byte) * 0x100000001B3) & MASK
        return Rng(Rng(value).bits())
