"""Compiled loops of the transformer on a CPU: normalisation and GELU, forward and backward.

The matrix products between them are torch's (:mod:`prnav.policy.block_cpu`). All inner loops run over contiguous
numbers, so that the compiler makes vector instructions of them, and each adds in one fixed order. They take float32.

Letters in shapes: R rows, D width, F hidden units of the MLP.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.aliases import JSONObject, Untyped

Floats = NDArray[np.floating[Untyped]]

EPSILON = 1e-5
"""Of torch's LayerNorm."""
COMPILED: JSONObject = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "nsz"},
}


@njit(inline="always")
def exponential(x: Untyped) -> Untyped:
    """Exponential of x <= 0 by a polynomial and a power of two, relative error below 2e-7 (Cephes' expf)."""
    x = max(x, np.float32(-87.0))
    n = np.floor(x * np.float32(1.44269504088896341) + np.float32(0.5))
    x = x - n * np.float32(0.693359375)
    x = x + n * np.float32(2.12194440e-4)
    y = np.float32(1.9875691500e-4)
    y = y * x + np.float32(1.3981999507e-3)
    y = y * x + np.float32(8.3334519073e-3)
    y = y * x + np.float32(4.1665795894e-2)
    y = y * x + np.float32(1.6666665459e-1)
    y = y * x + np.float32(5.0000001201e-1)
    y = y * x * x + x + np.float32(1.0)
    return y * np.int32((np.int32(n) + np.int32(127)) << np.int32(23)).view(np.float32)


@njit(inline="always")
def _upper_tail(x: Untyped, e: Untyped) -> Untyped:
    """1 - Phi(|x|) of the normal distribution with e = exp(-x^2 / 2), error below 8e-8 (Abramowitz, Stegun 7.1.26)."""
    t = np.float32(1.0) / (np.float32(1.0) + np.float32(0.3275911 * 0.7071067811865476) * abs(x))
    p = np.float32(1.061405429)
    p = p * t + np.float32(-1.453152027)
    p = p * t + np.float32(1.421413741)
    p = p * t + np.float32(-0.284496736)
    p = p * t + np.float32(0.254829592)
    return np.float32(0.5) * p * t * e


@njit(**COMPILED)
def gelu(inputs: Floats, begin: int, end: int, out: Floats) -> None:
    """GELU of rows ``begin`` to ``end`` of ``inputs`` (R, F) into the first rows of ``out``."""
    for r in range(end - begin):
        row, result = inputs[begin + r], out[r]
        for j in range(row.size):
            x = row[j]
            tail = _upper_tail(x, exponential(np.float32(-0.5) * x * x))
            result[j] = x * (np.float32(1.0) - tail if x > np.float32(0.0) else tail)


@njit(**COMPILED)
def gelu_backward(inputs: Floats, begin: int, end: int, out: Floats, grad: Floats, sums: Floats) -> None:
    """GELU again, and the gradient ``grad`` of its outputs turned in place into that of its inputs.

    The sum over rows of the latter is added to ``sums`` (F,).
    """
    for r in range(end - begin):
        row, result, d = inputs[begin + r], out[r], grad[r]
        for j in range(row.size):
            x = row[j]
            e = exponential(np.float32(-0.5) * x * x)
            tail = _upper_tail(x, e)
            phi = np.float32(1.0) - tail if x > np.float32(0.0) else tail
            result[j] = x * phi
            d[j] = d[j] * (phi + x * np.float32(0.3989422804014327) * e)
        for j in range(row.size):
            sums[j] += d[j]


@njit(**COMPILED)
def normalize(tokens: Floats, begin: int, end: int, out: Floats, at: int, scales: Floats) -> None:
    """Rows of ``tokens`` (R, D) to mean 0 and variance 1, to ``out`` from row ``at``.

    1 / deviation of each goes to ``scales`` likewise.
    """
    size = tokens.shape[1]
    for r in range(begin, end):
        row, result = tokens[r], out[at + r - begin]
        total = row[0] * np.float32(0.0)
        for j in range(size):
            total += row[j]
        mean = total / np.float32(size)
        squares = total * np.float32(0.0)
        for j in range(size):
            x = row[j] - mean
            result[j] = x
            squares += x * x
        scale = np.float32(1.0) / np.sqrt(squares / np.float32(size) + np.float32(EPSILON))
        scales[at + r - begin] = scale
        for j in range(size):
            result[j] *= scale


@njit(**COMPILED)
def add_rows(tokens: Floats, begin: int, end: int, out: Floats) -> None:
    """Add rows ``begin`` to ``end`` of ``tokens`` to the same of ``out``."""
    for r in range(begin, end):
        row, result = tokens[r], out[r]
        for j in range(row.size):
            result[j] += row[j]


@njit(**COMPILED)
def add_row(row: Floats, begin: int, end: int, out: Floats) -> None:
    """Add ``row`` (D,) to rows ``begin`` to ``end`` of ``out``."""
    for r in range(begin, end):
        result = out[r]
        for j in range(row.size):
            result[j] += row[j]


@njit(**COMPILED)
def normalize_backward(
    grad: Floats, normed: Floats, scales: Floats, begin: int, end: int, around: Floats, out: Floats, sums: Floats
) -> None:
    """Gradient of the rows before :func:`normalize`, plus that which went around it.

    Args:
        grad: Of the normalised rows ``begin`` to ``end``, in the first rows.
        normed: Normalised rows (R, D).
        scales: From :func:`normalize`, (R,).
        begin: First row.
        end: After the last.
        around: Gradient of the same rows by another way, (R, D).
        out: The sum, (R, D); may be ``around``.
        sums: The sum over rows of ``around`` is added to it, (D,).
    """
    size = normed.shape[1]
    for r in range(begin, end):
        d, x, other, result = grad[r - begin], normed[r], around[r], out[r]
        total = d[0] * np.float32(0.0)
        along = total
        for j in range(size):
            total += d[j]
            along += d[j] * x[j]
            sums[j] += other[j]
        mean, along, scale = total / np.float32(size), along / np.float32(size), scales[r]
        for j in range(size):
            result[j] = other[j] + scale * (d[j] - mean - x[j] * along)
