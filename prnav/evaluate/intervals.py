"""Bootstrap intervals of means over episodes: seeded, vectorised, pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

RESAMPLES = 10_000
"""Resamples of a reported interval: the ends then move by about 1 % of the interval's width between seeds."""

_CHUNK = 4_000_000  # draws held at once, so that memory stays near 100 MB for any number of episodes


@dataclass(frozen=True)
class Interval:
    """A mean and the ends of its interval; NaN where there was nothing to average."""

    mean: float
    low: float
    high: float


def bootstrap_means(values: ArrayLike, resamples: int = RESAMPLES, seed: int = 0) -> NDArray[np.float64]:
    """Means of resampled episodes.

    Args:
        values: (E,) or (E, M), one row per episode. The columns of one call share their resamples, so that
            differences and ratios of columns keep the correlation of the episodes.
        resamples: number of resamples R.
        seed: seed of the resampling; the same seed and shape draw the same episodes.

    Returns:
        (R,) or (R, M) means, each over E episodes drawn with replacement.
    """
    values = np.asarray(values, dtype=np.float64)
    count = len(values)
    if count == 0:
        return np.full((resamples, *values.shape[1:]), np.nan)
    generator = np.random.Generator(np.random.PCG64(seed))
    means = np.empty((resamples, *values.shape[1:]))
    rows = max(1, _CHUNK // count)
    for start in range(0, resamples, rows):
        size = min(rows, resamples - start)
        drawn = generator.integers(0, count, size=(size, count)) + count * np.arange(size)[:, None]
        times = np.bincount(drawn.ravel(), minlength=size * count).reshape(size, count)
        means[start : start + size] = times.astype(np.float64) @ values / count
    return means


def bootstrap_interval(
    values: ArrayLike, confidence: float = 0.95, resamples: int = RESAMPLES, seed: int = 0
) -> Interval:
    """Percentile-bootstrap interval of the mean of (E,) values (Efron and Tibshirani 1993, chapter 13)."""
    values = np.asarray(values, dtype=np.float64)
    return bootstrap_intervals(values[:, None], confidence, resamples, seed)[0]


def bootstrap_intervals(
    values: ArrayLike, confidence: float = 0.95, resamples: int = RESAMPLES, seed: int = 0
) -> list[Interval]:
    """Interval of the mean of each column of (E, M) values, the columns resampled together."""
    values = np.asarray(values, dtype=np.float64)
    if len(values) == 0:
        return [Interval(np.nan, np.nan, np.nan)] * values.shape[1]
    means = bootstrap_means(values, resamples, seed)
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(means, [tail, 1.0 - tail], axis=0)
    return [Interval(float(m), float(a), float(b)) for m, a, b in zip(values.mean(axis=0), low, high, strict=True)]


def paired_difference(
    values: ArrayLike, others: ArrayLike, confidence: float = 0.95, resamples: int = RESAMPLES, seed: int = 0
) -> Interval:
    """Interval of the mean difference ``values - others`` of the same episodes, both (E,)."""
    values, others = np.asarray(values, dtype=np.float64), np.asarray(others, dtype=np.float64)
    return bootstrap_interval(values - others, confidence, resamples, seed)


def interval_over_runs(
    values: ArrayLike, confidence: float = 0.95, resamples: int = RESAMPLES, seed: int = 0
) -> Interval:
    """Interval of the mean over runs and episodes: what another seed would give, on other episodes of the kind.

    Runs and episodes are drawn with replacement independently of each other, since all runs play the same episodes
    (the bootstrap of a crossed design, Owen 2007). With few runs it is wide, and rightly so.

    Args:
        values: (R, E), R runs that differ by their seed.
        confidence: of the interval.
        resamples: number of resamples.
        seed: seed of the resampling.
    """
    return interval_over_run_groups(values, None, confidence, resamples, seed)


def interval_over_run_groups(
    values: ArrayLike,
    others: ArrayLike | None,
    confidence: float = 0.95,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Interval of the mean difference of two groups of runs that played the same episodes.

    The runs of each group are drawn on their own, since a seed of one has nothing to do with that of the other; the
    episodes are drawn for both together.

    Args:
        values: (R, E), R runs that differ by their seed.
        others: (Q, E), what is subtracted; None for nothing.
        confidence: of the interval.
        resamples: number of resamples.
        seed: seed of the resampling.
    """
    groups = [np.asarray(group, dtype=np.float64) for group in (values, others) if group is not None]
    generator = np.random.Generator(np.random.PCG64(seed))
    by_run = bootstrap_means(np.concatenate(groups).T, resamples, seed + 1)  # (resamples, R + Q), episodes shared
    means, mean, first = np.zeros(resamples), 0.0, 0
    for sign, group in zip((1.0, -1.0), groups, strict=False):
        runs = len(group)
        share = generator.multinomial(runs, np.full(runs, 1.0 / runs), size=resamples) / runs
        means += sign * np.sum(share * by_run[:, first : first + runs], axis=1)
        mean += sign * float(group.mean())
        first += runs
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(means, [tail, 1.0 - tail])
    return Interval(mean, float(low), float(high))
