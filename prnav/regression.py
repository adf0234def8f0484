"""Regression from readings, in closed form: ridge on the inputs and on rectified random projections of them.

Rahimi and Recht 2008 (random features) and Hoerl and Kennard 1970 (ridge). The same inputs give the same bits. N rows,
I inputs, T targets, H random features.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]

PENALTIES = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0, 3.0)
"""Penalties tried, in units of the mean of the features' variances."""


def fit_and_test(
    inputs: Float64,
    targets: Float64,
    held_out: NDArray[np.bool_],
    groups: NDArray[np.int64],
    features: int,
    seed: int,
) -> Float64:
    """R^2 of each target (T,) on the rows held out, after a fit on the others.

    The penalty is the one that does best on a third of the fitted groups after a fit on the other two: groups (homes)
    are never split, so that nothing of a home tells about itself.

    Args:
        inputs: (N, I).
        targets: (N, T).
        held_out: (N,), which rows test.
        groups: (N,), which home a row belongs to.
        features: number H of random features beside the inputs.
        seed: of the random features.
    """
    mean, scale = inputs[~held_out].mean(axis=0), inputs[~held_out].std(axis=0)
    expanded = expand((inputs - mean) / np.where(scale > 1e-9, scale, 1.0), features, seed)
    fitted = np.flatnonzero(~held_out)
    known = np.unique(groups[fitted])
    trial = np.isin(groups[fitted], known[2::3]) if len(known) > 2 else np.arange(len(fitted)) % 3 == 2
    first, second = fitted[~trial], fitted[trial]
    worth = [
        mean_r2(expanded[second] @ weights + centre, targets[second])
        for weights, centre in ridge_path(expanded[first], targets[first], PENALTIES)
    ]
    best = PENALTIES[int(np.argmax(worth))]
    weights, centre = ridge_path(expanded[fitted], targets[fitted], (best,))[0]
    return r2(expanded[held_out] @ weights + centre, targets[held_out])


def expand(inputs: Float64, features: int, seed: int) -> Float64:
    """Inputs (N, I) beside ``features`` rectified random projections of them: (N, I + H)."""
    rng = np.random.Generator(np.random.PCG64([seed, features]))
    directions = rng.standard_normal((inputs.shape[1], features)) / np.sqrt(inputs.shape[1])
    offsets = rng.standard_normal(features)
    return np.concatenate([inputs / np.sqrt(2.0), np.maximum(inputs @ directions + offsets, 0.0)], axis=1)


def ridge_path(features: Float64, targets: Float64, penalties: tuple[float, ...]) -> list[tuple[Float64, Float64]]:
    """Weights (H, T) and constants (T,) of ridge regressions, one per penalty (per row, times the mean variance)."""
    middle, centre = features.mean(axis=0), targets.mean(axis=0)
    centred = features - middle
    gram = centred.T @ centred
    values, vectors = np.linalg.eigh(gram)
    projected = vectors.T @ (centred.T @ (targets - centre))
    unit = float(np.trace(gram)) / len(gram)
    result = []
    for penalty in penalties:
        weights = vectors @ (projected / (np.maximum(values, 0.0) + penalty * unit + 1e-12)[:, None])
        result.append((weights, centre - middle @ weights))
    return result


def r2(predictions: Float64, targets: Float64) -> Float64:
    """Coefficient of determination of each column (T,): 1 is perfect, 0 no better than the mean, below 0 worse."""
    rest = ((targets - predictions) ** 2).sum(axis=0)
    spread = ((targets - targets.mean(axis=0)) ** 2).sum(axis=0)
    return 1.0 - rest / np.where(spread > 0.0, spread, 1.0)


def mean_r2(predictions: Float64, targets: Float64) -> float:
    """Mean of :func:`r2` over the columns."""
    return float(r2(predictions, targets).mean())
