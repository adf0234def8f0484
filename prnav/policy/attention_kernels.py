"""Compiled loops of attention on a CPU, forward and backward.

Scores are made a few queries at a time, transposed, (S, P) of [key, query]: queries fill the vectors, a softmax needs
no sum across one, and scores stay in the nearest cache. All add in one fixed order.

Letters in shapes: B batch, S tokens, R = B * S rows, H heads, E width of a head, D = H * E, P queries that are looked
at together.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numba import njit

from prnav.policy.block_kernels import COMPILED, exponential

LANES = 8
"""Numbers that a vector instruction takes; P is a multiple of it."""


def query_tile(count: int) -> int:
    """P: how many queries are looked at together, in whole vectors: few enough that their scores stay in the cache.

    Of those that leave the fewest places empty the smallest.
    """
    return min(range(2 * LANES, 6 * LANES + 1, LANES), key=lambda size: (-(-count // size) * size, size))


@njit(inline="always")
def _turn(rows, first, valid, column, factor, out, size, across):
    """(E, P) from columns of ``valid`` rows, the rest 0."""
    for i in range(valid):
        for d in range(size):
            out[d * across + i] = rows[first + i, column + d] * factor
    for i in range(valid, across):
        for d in range(size):
            out[d * across + i] = np.float32(0.0)


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
def _gather(weight, j, rows, out, row, column, reach, size, across):
    """out[row, column + d] += sum over i of weight[j, i] rows[i, d], over ``reach`` queries, for flat rows (P, E)."""
    for d in range(size):
        total = np.float32(0.0) * rows[d]
        for i in range(reach):
            total += weight[j * across + i] * rows[i * size + d]
        out[row, column + d] += total


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

    E must be even and S at least 2.

    Returns:
        ``forward(qkv, begin, end, out, *work)``: attended values (R, D) of rows ``begin`` to ``end`` of ``qkv``
        (R, 3 D). ``backward(qkv, begin, end, grad, out, sums, *work)``: gradient ``out`` of ``qkv`` from ``grad`` of
        the attended values, both from their first row on; its sum over rows is added to ``sums`` (3 D,). ``work`` is
        flat work space, as :func:`prnav.policy.block_cpu.work_space` makes it.
    """
    width, size, across = heads * head, head, query_tile(count)
    reach = min(count, across)
    scale, zero = np.float32(head**-0.5), np.float32(0.0)

    @njit(**COMPILED)
    def forward(qkv, begin, end, out, turned, weight, top, share):
        for first in range(begin, end, count):
            for column in range(0, width, size):
                for tile in range(first, first + count, across):
                    valid = min(across, first + count - tile)
                    _turn(qkv, tile, valid, column, scale, turned, size, across)
                    _products(qkv, first, width + column, turned, weight, count, size, across)
                    _exponentials(weight, top, share, count, across)
                    _mix(qkv, first, 2 * width + column, weight, turned, count, size, across)
                    for i in range(valid):
                        for d in range(size):
                            out[tile + i, column + d] = turned[d * across + i] * share[i]

    @njit(**COMPILED)
    def backward(qkv, begin, end, grad, out, sums, turned, weight, top, share, pull, queries, grads):
        for first in range(begin, end, count):
            for i in range(first - begin, first - begin + count):
                for c in range(width, 3 * width):
                    out[i, c] = zero
            for column in range(0, width, size):
                for tile in range(first, first + count, across):
                    local, valid = tile - begin, min(across, first + count - tile)
                    _turn(qkv, tile, valid, column, scale, turned, size, across)
                    _products(qkv, first, width + column, turned, weight, count, size, across)
                    _exponentials(weight, top, share, count, across)
                    _turn(grad, local, valid, column, np.float32(1.0), turned, size, across)
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
                    for i in range(valid):
                        for d in range(size):
                            out[local + i, column + d] = turned[d * across + i]
                            queries[i * size + d] = qkv[tile + i, column + d]
                            grads[i * size + d] = grad[local + i, column + d] * share[i]
                    for k in range(valid * size, across * size):
                        queries[k] = zero
                        grads[k] = zero
                    for j in range(count):
                        row = first - begin + j
                        _gather(pull, j, queries, out, row, width + column, reach, size, across)
                        _gather(weight, j, grads, out, row, 2 * width + column, reach, size, across)
            for i in range(first - begin, first - begin + count):
                for c in range(3 * width):
                    sums[c] += out[i, c]

    return forward, backward
