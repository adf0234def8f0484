"""Compiled loops of the transformer on a CPU: normalisation, GELU and attention, forward and backward.

The matrix products between them are torch's (:mod:`prnav.policy.block_cpu`). All inner loops run over contiguous
numbers, so that the compiler makes vector instructions of them, and each adds in one fixed order. They take float32;
float64 gives the same accuracy, of about 2e-7, and serves the tests.

Letters in shapes: B batch, S tokens, R = B * S rows, D width, F hidden units of the MLP, H heads, E = D / H, P = S
padded to whole vectors.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

EPSILON = 1e-5
"""Of torch's LayerNorm."""
LANES = 8
"""Numbers that a vector instruction takes; P is a multiple of it."""
_COMPILED: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "nsz"},
}


@njit(inline="always")
def _exp(x: Any) -> Any:
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


@njit(**_COMPILED)
def gelu(inputs: Floats, begin: int, end: int, out: Floats) -> None:
    """GELU of rows ``begin`` to ``end`` of ``inputs`` (R, F) into the first rows of ``out``."""
    for r in range(end - begin):
        row, result = inputs[begin + r], out[r]
        for j in range(row.size):
            x = row[j]
            tail = _upper_tail(x, _exp(np.float32(-0.5) * x * x))
            result[j] = x * (np.float32(1.0) - tail if x > np.float32(0.0) else tail)


@njit(**_COMPILED)
def gelu_backward(inputs: Floats, begin: int, end: int, out: Floats, grad: Floats) -> None:
    """GELU again, and the gradient ``grad`` of its outputs turned in place into that of its inputs."""
    for r in range(end - begin):
        row, result, d = inputs[begin + r], out[r], grad[r]
        for j in range(row.size):
            x = row[j]
            e = _exp(np.float32(-0.5) * x * x)
            tail = _upper_tail(x, e)
            phi = np.float32(1.0) - tail if x > np.float32(0.0) else tail
            result[j] = x * phi
            d[j] = d[j] * (phi + x * np.float32(0.3989422804014327) * e)


@njit(**_COMPILED)
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


@njit(**_COMPILED)
def normalize_backward(
    grad: Floats, normed: Floats, scales: Floats, begin: int, end: int, around: Floats, out: Floats
) -> None:
    """Gradient of the rows before :func:`normalize`, plus that which went around it.

    Args:
        grad: Of the normalised rows ``begin`` to ``end``, in the first rows.
        normed: Normalised rows (R, D).
        scales: From :func:`normalize`, (R,).
        begin: First row.
        end: After the last.
        around: Gradient of the same rows by another way, (R, D).
        out: The sum, (R, D).
    """
    size = normed.shape[1]
    for r in range(begin, end):
        d, x, other, result = grad[r - begin], normed[r], around[r], out[r]
        total = d[0] * np.float32(0.0)
        along = total
        for j in range(size):
            total += d[j]
            along += d[j] * x[j]
        mean, along, scale = total / np.float32(size), along / np.float32(size), scales[r]
        for j in range(size):
            result[j] = other[j] + scale * (d[j] - mean - x[j] * along)


def padded(count: int) -> int:
    """P: so many tokens filled up to whole vectors."""
    return -(-count // LANES) * LANES


@lru_cache(maxsize=None)
def attention_kernels(heads: int, head: int, count: int) -> tuple[Callable[..., None], Callable[..., None]]:
    """Attention forward and backward for H, E and S: as constants they make loops twice as fast.

    Scores stand transposed, (S, P) of [key, query], so that queries fill the vectors. Work space is flat, and its
    size is that of :func:`attention_work`.
    """
    width, size, across = heads * head, head, padded(count)
    scale, zero = np.float32(head**-0.5), np.float32(0.0)
    whole = count // 4 * 4

    @njit(inline="always")
    def turn(rows, first, column, factor, out):  # type: ignore[no-untyped-def]
        """(E, P) from columns of rows (S, ...)."""
        for i in range(count):
            for d in range(size):
                out[d * across + i] = rows[first + i, column + d] * factor

    @njit(inline="always")
    def products(rows, first, column, turned, out):  # type: ignore[no-untyped-def]
        """out[j, i] = sum over d of rows[first + j, column + d] turned[d, i]."""
        for j in range(count):
            for i in range(across):
                total = zero * turned[i]
                for d in range(size):
                    total += rows[first + j, column + d] * turned[d * across + i]
                out[j * across + i] = total

    @njit(inline="always")
    def mix(rows, first, column, weight, out):  # type: ignore[no-untyped-def]
        """out[d, i] = sum over j of rows[first + j, column + d] weight[j, i]."""
        for d in range(size):
            for i in range(across):
                out[d * across + i] = zero
            for j in range(0, whole, 4):
                v0, v1 = rows[first + j, column + d], rows[first + j + 1, column + d]
                v2, v3 = rows[first + j + 2, column + d], rows[first + j + 3, column + d]
                k = j * across
                for i in range(across):
                    out[d * across + i] += (
                        v0 * weight[k + i]
                        + v1 * weight[k + across + i]
                        + v2 * weight[k + 2 * across + i]
                        + v3 * weight[k + 3 * across + i]
                    )
            for j in range(whole, count):
                v0 = rows[first + j, column + d]
                for i in range(across):
                    out[d * across + i] += v0 * weight[j * across + i]

    @njit(inline="always")
    def gather(weight, j, rows, out, row, column):  # type: ignore[no-untyped-def]
        """out[row, column + d] = sum over i of weight[j, i] rows[i, d], for rows (S, E) in flat work space."""
        for d in range(size):
            total = zero * rows[d]
            for i in range(count):
                total += weight[j * across + i] * rows[i * size + d]
            out[row, column + d] = total

    @njit(inline="always")
    def softmax(scores, top, total):  # type: ignore[no-untyped-def]
        """Softmax over the keys of scores [j, i], in place."""
        for i in range(across):
            top[i] = scores[i]
            total[i] = zero
        for j in range(1, count):
            for i in range(across):
                top[i] = max(top[i], scores[j * across + i])
        for j in range(count):
            for i in range(across):
                e = _exp(scores[j * across + i] - top[i])
                scores[j * across + i] = e
                total[i] += e
        for i in range(across):
            total[i] = np.float32(1.0) / total[i]
        for j in range(count):
            for i in range(across):
                scores[j * across + i] *= total[i]

    @njit(**_COMPILED)
    def forward(qkv, begin, end, out, turned, weight, top, total):  # type: ignore[no-untyped-def]
        for first in range(begin, end, count):
            for column in range(0, width, size):
                turn(qkv, first, column, scale, turned)
                products(qkv, first, width + column, turned, weight)
                softmax(weight, top, total)
                mix(qkv, first, 2 * width + column, weight, turned)
                for i in range(count):
                    for d in range(size):
                        out[first + i, column + d] = turned[d * across + i]

    @njit(**_COMPILED)
    def backward(qkv, begin, end, grad, out, turned, weight, top, total, pull, queries, grads):  # type: ignore[no-untyped-def]
        for first in range(begin, end, count):
            local = first - begin
            for column in range(0, width, size):
                turn(qkv, first, column, scale, turned)
                products(qkv, first, width + column, turned, weight)
                softmax(weight, top, total)
                turn(grad, local, column, np.float32(1.0), turned)
                products(qkv, first, 2 * width + column, turned, pull)
                for i in range(across):
                    total[i] = zero
                for j in range(count):
                    for i in range(across):
                        total[i] += pull[j * across + i] * weight[j * across + i]
                for j in range(count):
                    for i in range(across):
                        k = j * across + i
                        pull[k] = scale * weight[k] * (pull[k] - total[i])
                mix(qkv, first, width + column, pull, turned)
                for i in range(count):
                    for d in range(size):
                        out[local + i, column + d] = turned[d * across + i]
                        queries[i * size + d] = qkv[first + i, column + d]
                        grads[i * size + d] = grad[local + i, column + d]
                for j in range(count):
                    gather(pull, j, queries, out, local + j, width + column)
                    gather(weight, j, grads, out, local + j, 2 * width + column)

    return forward, backward
