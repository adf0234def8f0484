"""Where a receptor's rays lie in its patch, and how much each of them counts."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.errors import RenderError

Float64 = NDArray[np.float64]

PATTERNS = ("grid", "lattice")
"""How the rays of a receptor lie in its patch; see :func:`patch_offsets`."""

ACCEPTANCES = ("uniform", "cosine", "gaussian")
"""How much a receptor's rays count across its patch; see :func:`acceptance_weights`."""


@dataclass(frozen=True)
class Sampling:
    """The rays of every receptor: side x side of them, in a pattern, weighted by an acceptance profile.

    Raises:
        RenderError: an unknown pattern or profile.
    """

    side: int = 1
    pattern: str = "grid"
    acceptance: str = "uniform"

    def __post_init__(self) -> None:
        for name, value, valid in (
            ("pattern", self.pattern, PATTERNS),
            ("acceptance", self.acceptance, ACCEPTANCES),
        ):
            if value not in valid:
                raise RenderError(f"{name} {value!r} is not known; valid: {', '.join(valid)}")

    @property
    def count(self) -> int:
        """Rays per receptor."""
        return self.side * self.side

    @property
    def offsets(self) -> Float64:
        """Places of the rays, (side * side, 2); see :func:`patch_offsets`."""
        return patch_offsets(self.side, self.pattern)

    @property
    def weights(self) -> Float64:
        """Weights of the rays, (side * side,), 1 in the mean; see :func:`acceptance_weights`."""
        return acceptance_weights(self.side, self.pattern, self.acceptance)


@functools.cache
def patch_offsets(side: int, pattern: str = "grid") -> Float64:
    """Where side x side rays meet their patch: right and down from its top left corner, 0 to 1, (side * side, 2).

    "grid" puts them at the centres of equal cells, row by row. "lattice" gives every ray its own row and its own
    column, as a rank-1 lattice with the longest shortest vector: an edge that runs along the rows or columns, as most
    edges in built worlds do, is then met by ``side * side`` steps of coverage instead of ``side``.
    """
    count = side * side
    k = np.arange(count)
    if pattern == "grid":
        offsets = np.stack([k % side + 0.5, k // side + 0.5], axis=-1) / side
    else:
        assert pattern == "lattice"
        offsets = np.stack([k + 0.5, k * _lattice_generator(count) % count + 0.5], axis=-1) / count
    offsets.flags.writeable = False
    return offsets


def _lattice_generator(count: int) -> int:
    """The a in 1 .. count - 1, prime to count, for which the points (k, a k mod count) lie farthest apart."""
    if count == 1:
        return 1
    candidates = np.array([a for a in range(1, count // 2 + 1) if math.gcd(a, count) == 1])
    # the shortest vector of a lattice of n points in an n x n square is at most 1.075 sqrt(n) long
    k = np.arange(1, int(1.075 * math.sqrt(count)) + 2)
    across = (candidates[:, None] * k + count // 2) % count - count // 2
    return int(candidates[np.argmax((across * across + k * k).min(axis=1))])


@functools.cache
def acceptance_weights(side: int, pattern: str, acceptance: str) -> Float64:
    """How much each ray counts, (side * side,), 1 in the mean.

    With x and y from -1 to 1 across the patch: "uniform" is 1; "cosine" is ``cos(pi x / 2) cos(pi y / 2)``, 0 at the
    patch's border; "gaussian" is ``exp(-ln 2 (x^2 + y^2))``, half as much in the middle of a side as in the centre (a
    full width at half maximum of one patch), cut off at the border.
    """
    x, y = (2.0 * patch_offsets(side, pattern) - 1.0).T
    if acceptance == "uniform":
        weights = np.ones(side * side)
    elif acceptance == "cosine":
        weights = np.cos(0.5 * np.pi * x) * np.cos(0.5 * np.pi * y)
    else:
        assert acceptance == "gaussian"
        weights = np.exp(-math.log(2.0) * (x * x + y * y))
    weights = weights / weights.mean()
    weights.flags.writeable = False
    return weights
