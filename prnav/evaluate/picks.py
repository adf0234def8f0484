"""Which episodes are shown: the worst, the best, some at random, and those where two evaluations differ most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

Row = Mapping[str, Any]

RANDOM_SEED = 0
"""Of the episodes picked at random, so that nobody can choose them."""


def pick_episodes(rows: Sequence[Row], each: int = 3) -> dict[str, list[int]]:
    """Indices of the worst and best episodes by SPL, and of some drawn at random; none appears twice.

    Equals are ordered by SoftSPL, then by how far from the goal they ended, then by the length of the shortest path,
    so that the best are hard episodes done well and the worst are the farthest misses.
    """
    order = sorted(range(len(rows)), key=lambda index: _rank(rows[index]))
    each = min(each, max(1, len(order) // 3))
    worst = order[:each]
    best = [index for index in order[::-1][:each] if index not in worst]
    taken = {*worst, *best}
    drawn = np.random.Generator(np.random.PCG64(RANDOM_SEED)).permutation(len(rows)).tolist()
    return {"worst": worst, "best": best, "random": [index for index in drawn if index not in taken][:each]}


def pick_pairs(rows: Sequence[Row], others: Sequence[Row]) -> dict[str, int]:
    """Index of the episode that the first did best by against the second, of the opposite one, and of one at random.

    Both are of the same episodes in the same order; "best" is by SPL, then by SoftSPL.
    """
    gain = [tuple(a - b for a, b in zip(_score(x), _score(y), strict=True)) for x, y in zip(rows, others, strict=True)]
    order = sorted(range(len(rows)), key=gain.__getitem__)
    if len(order) == 1:
        return {"random": order[0]}
    drawn = np.random.Generator(np.random.PCG64(RANDOM_SEED)).permutation(len(rows)).tolist()
    others_left = [index for index in drawn if index not in (order[0], order[-1])]
    picks = {"first": order[-1], "second": order[0]}
    return {**picks, "random": others_left[0]} if others_left else picks


def _score(row: Row) -> tuple[float, float]:
    return float(row.get("spl", row.get("success", 0.0))), round(float(row.get("soft_spl", 0.0)), 3)


def _rank(row: Row) -> tuple[float, ...]:
    remaining = row.get("distance_to_goal")
    far = float(np.inf if remaining is None else remaining)
    return (*_score(row), -far, float(row.get("geodesic_distance") or 0.0))
