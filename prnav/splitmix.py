"""SplitMix64 (Steele, Lea and Flood 2014): random numbers that are a function of a seed and a place.

Written once for Python's integers and once for arrays; both give the same bits on every machine and version.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

GOLDEN = 0x9E3779B97F4A7C15
"""The step of the sequence: 2^64 over the golden ratio, odd."""

MASK = (1 << 64) - 1


def mix(value: int) -> int:
    """The finaliser: 64 bits that look random, one to one with ``value``."""
    value = ((value ^ (value >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    value = ((value ^ (value >> 27)) * 0x94D049BB133111EB) & MASK
    return value ^ (value >> 31)


def mix_array(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """:func:`mix` of each number of an array (...)."""
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))


def splitmix64(seeds: NDArray[np.uint64], places: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """What the generators seeded ``seeds`` (...) draw at ``places`` (...), counted from 0."""
    return mix_array(seeds + (places + np.uint64(1)) * np.uint64(GOLDEN))


def unit_interval(bits: NDArray[np.uint64]) -> NDArray[np.float64]:
    """The upper 53 bits as numbers in [0, 1)."""
    return (bits >> np.uint64(11)).astype(np.float64) * 2.0**-53
