"""Compiled loops of the transformer on a CPU: normalisation, GELU and attention, forward and backward.

The matrix products between them are torch's (:mod:`prnav.policy.block_cpu`). All inner loops run over contiguous
numbers, so that the compiler makes vector instructions of them, and each adds in one fixed order. They take float32.

Letters in shapes: B batch, S tokens, R = B * S rows, D width, F hidden units of the MLP, H heads, E = D / H, P = S
padded to whole vectors.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

EPSILON = 1e-5
"""Of torch's LayerNorm."""
LANES = 8
"""Numbers that a vector instruction takes; P is a multiple of it."""
COMPILED: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "nsz"},
}


@njit(inline="always")
def exponential(x: Any) -> Any:
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
def _upper_tail(x: Any, e: Any) -> Any:
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


def padded(count: int) -> int:
    """P: so many tokens filled up to whole vectors."""
    return -(-count // LANES) * LANES


@njit(inline="always")
def _turn(rows, first, column, factor, out, count, size, across):
    """(E, P) from columns of rows (S, ...)."""
    for i in range(count):
        for d in range(size):
            out[d * across + i] = rows[first + i, column + d] * factor


@njit(inline="always")
def _products(rows, first, column, turned, out, count, size, across):
    """out[j, i] = sum over d of rows[first + j, column + d] turned[d, i], two rows by four columns at a time."""
    for pair in range(0, count, 2):
        j = min(pair, count - 2)
        one, two, a = j * across, j * across + across, first + j
        for i in range(across):
            out[one + i] = np.float32(0.0)
            out[two + i] = np.float32(0.0)
        for d in range(0, size - 3, 4):
            b, k = column + d, d * across
            v0, v1, v2, v3 = rows[a, b], rows[a, b + 1], rows[a, b + 2], rows[a, b + 3]
            u0, u1, u2, u3 = rows[a + 1, b], rows[a + 1, b + 1], rows[a + 1, b + 2], rows[a + 1, b + 3]
            for i in range(across):
                w0, w1 = turned[k + i], turned[k + across + i]
                w2, w3 = turned[k + 2 * across + i], turned[k + 3 * across + i]
                out[one + i] += v0 * w0 + v1 * w1 + v2 * w2 + v3 * w3
                out[two + i] += u0 * w0 + u1 * w1 + u2 * w2 + u3 * w3
        for d in range(size // 4 * 4, size):
            v0, u0 = rows[a, column + d], rows[a + 1, column + d]
            for i in range(across):
                out[one + i] += v0 * turned[d * across + i]
                out[two + i] += u0 * turned[d * across + i]


@njit(inline="always")
def _mix(rows, first, column, weight, out, count, size, across):
    """out[d, i] = sum over j of rows[first + j, column + d] weight[j, i], two columns by four rows at a time."""
    for d in range(0, size, 2):
        one, two = d * across, d * across + across
        for i in range(across):
            out[one + i] = np.float32(0.0)
            out[two + i] = np.float32(0.0)
        for j in range(0, count - 3, 4):
            a, b, k = first + j, column + d, j * across
            v0, v1, v2, v3 = rows[a, b], rows[a + 1, b], rows[a + 2, b], rows[a + 3, b]
            u0, u1, u2, u3 = rows[a, b + 1], rows[a + 1, b + 1], rows[a + 2, b + 1], rows[a + 3, b + 1]
            for i in range(across):
                w0, w1 = weight[k + i], weight[k + across + i]
                w2, w3 = weight[k + 2 * across + i], weight[k + 3 * across + i]
                out[one + i] += v0 * w0 + v1 * w1 + v2 * w2 + v3 * w3
                out[two + i] += u0 * w0 + u1 * w1 + u2 * w2 + u3 * w3
        for j in range(count // 4 * 4, count):
            v0, u0 = rows[first + j, column + d], rows[first + j, column + d + 1]
            for i in range(across):
                out[one + i] += v0 * weight[j * across + i]
                out[two + i] += u0 * weight[j * across + i]


@njit(inline="always")
def _gather(weight, j, rows, out, row, column, count, size, across):
    """out[row, column + d] = sum over i of weight[j, i] rows[i, d], for flat rows (S, E)."""
    for d in range(size):
        total = np.float32(0.0) * rows[d]
        for i in range(count):
            total += weight[j * across + i] * rows[i * size + d]
        out[row, column + d] = total


@njit(inline="always")
def _exponentials(scores, top, share, count, across):
    """Softmax over the keys of scores [j, i] in place, but for the factor ``share`` (P,)."""
    for i in range(across):
        top[i] = scores[i]
        share[i] = np.float32(0.0)
    for j in range(1, count):
        for i in range(across):
            top[i] = max(top[i], scores[j * across + i])
    for j in range(count):
        for i in range(across):
            e = exponential(scores[j * across + i] - top[i])
            scores[j * across + i] = e
            share[i] += e
    for i in range(across):
        share[i] = np.float32(1.0) / share[i]


@cache
def attention_kernels(heads: int, head: int, count: int) -> tuple[Callable[..., None], Callable[..., None]]:
    """Attention forward and backward for H, E and S: as constants they make loops three times as fast.

    Scores stand transposed, (S, P) of [key, query], so that queries fill the vectors. E must be even and S at least 2.

    Returns:
        ``forward(qkv, begin, end, out, *work)``: attended values (R, D) of rows ``begin`` to ``end`` of ``qkv``
        (R, 3 D). ``backward(qkv, begin, end, grad, out, sums, *work)``: gradient ``out`` of ``qkv`` from ``grad`` of
        the attended values, both from their first row on; its sum over rows is added to ``sums`` (3 D,). ``work`` is
        flat work space, as :func:`prnav.policy.block_cpu.work_space` makes it.
    """
    width, size, across = heads * head, head, padded(count)
    scale, zero = np.float32(head**-0.5), np.float32(0.0)

    @njit(**COMPILED)
    def forward(qkv, begin, end, out, turned, weight, top, share):
        for first in range(begin, end, count):
            for column in range(0, width, size):
                _turn(qkv, first, column, scale, turned, count, size, across)
                _products(qkv, first, width + column, turned, weight, count, size, across)
                _exponentials(weight, top, share, count, across)
                _mix(qkv, first, 2 * width + column, weight, turned, count, size, across)
                for i in range(count):
                    for d in range(size):
                        out[first + i, column + d] = turned[d * across + i] * share[i]

    @njit(**COMPILED)
    def backward(qkv, begin, end, grad, out, sums, turned, weight, top, share, pull, queries, grads):
        for first in range(begin, end, count):
            local = first - begin
            for column in range(0, width, size):
                _turn(qkv, first, column, scale, turned, count, size, across)
                _products(qkv, first, width + column, turned, weight, count, size, across)
                _exponentials(weight, top, share, count, across)
                _turn(grad, local, column, np.float32(1.0), turned, count, size, across)
                _products(qkv, first, 2 * width + column, turned, pull, count, size, across)
                for i in range(across):
                    top[i] = zero
                for j in range(count):
                    for i in range(across):
                        top[i] += pull[j * across + i] * weight[j * across + i]
                for i in range(across):
                    top[i] *= share[i]
                for j in range(count):
                    for i in range(across):
                        k = j * across + i
                        pull[k] = weight[k] * (pull[k] - top[i]) * (scale * share[i])
                _mix(qkv, first, width + column, pull, turned, count, size, across)
                for i in range(count):
                    for d in range(size):
                        out[local + i, column + d] = turned[d * across + i]
                        queries[i * size + d] = qkv[first + i, column + d]
                        grads[i * size + d] = grad[local + i, column + d] * share[i]
                for j in range(count):
                    _gather(pull, j, queries, out, local + j, width + column, count, size, across)
                    _gather(weight, j, grads, out, local + j, 2 * width + column, count, size, across)
            for i in range(local, local + count):
                for c in range(3 * width):
                    sums[c] += out[i, c]

    return forward, backward
