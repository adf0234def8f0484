"""Measures of navigation as pure functions of arrays (N,).

Sources: P. Anderson et al., "On Evaluation of Embodied Navigation Agents", 2018 (SPL); S. Datta et al., "Integrating
Egocentric Localization for More Realistic Point-Goal Navigation Agents", 2020 (SoftSPL). Distances are metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def path_efficiency(shortest: ArrayLike, taken: ArrayLike) -> Floats:
    """``shortest / max(shortest, taken)``, 1 where both are 0: how direct a path was, in 0..1."""
    shortest, taken = np.asarray(shortest, np.float64), np.asarray(taken, np.float64)
    longest = np.maximum(shortest, taken)
    return np.divide(shortest, longest, out=np.ones_like(longest), where=longest > 0)


def spl(success: ArrayLike, shortest: ArrayLike, taken: ArrayLike) -> Floats:
    """Success weighted by path length: ``S * l / max(l, p)`` (Anderson et al. 2018, section 4).

    Args:
        success: S, whether each episode succeeded.
        shortest: l, geodesic distance from start to goal.
        taken: p, length of the agent's path.
    """
    return np.asarray(success, np.float64) * path_efficiency(shortest, taken)


def soft_spl(distance: ArrayLike, shortest: ArrayLike, taken: ArrayLike) -> Floats:
    """SPL with progress in the place of success: ``max(0, 1 - d / l) * l / max(l, p)`` (Datta et al. 2020).

    Args:
        distance: d, geodesic distance to the goal at the end (SoftSPL as Habitat measures it), or the smallest one
            reached on the way (as the paper's design objective has it).
        shortest: l, geodesic distance from start to goal.
        taken: p, length of the agent's path.
    """
    distance, shortest = np.asarray(distance, np.float64), np.asarray(shortest, np.float64)
    near = distance < shortest  # elsewhere there is no progress, and the quotient may overflow
    left = np.divide(distance, shortest, out=np.ones(near.shape), where=near)
    left = np.where((distance == 0.0) & (shortest == 0.0), 0.0, left)
    return np.clip(1.0 - left, 0.0, 1.0) * path_efficiency(shortest, taken)
