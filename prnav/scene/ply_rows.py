"""Compiled loops that find the rows of a PLY file's elements whose lists differ in length."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def walk_text(numbers, start, lists, offsets):
    """Fill in where columns start; the end, or -1 - row where a row does not fit."""
    for row in range(len(offsets)):
        for column in range(len(lists)):
            if start >= len(numbers):
                return -1 - row
            offsets[row, column] = start
            if lists[column]:
                size = numbers[start]
                if not 0.0 <= size <= len(numbers) - start - 1 or size != np.floor(size):
                    return -1 - row
                start += int(size)
            start += 1
    return start


@njit(cache=True, nogil=True, error_model="numpy")
def walk_binary(body, start, sizes, counts, signed, big, offsets):
    """Fill in where columns start; the end, or -1 - row where a row does not fit."""
    for row in range(len(offsets)):
        for column in range(len(sizes)):
            offsets[row, column] = start
            if counts[column] == 0:
                start += sizes[column]
                continue
            width = counts[column]
            if start + width > len(body):
                return -1 - row
            size = np.uint64(0)
            for k in range(width):
                byte = body[start + k] if big else body[start + width - 1 - k]
                size = size << np.uint64(8) | np.uint64(byte)
            if signed[column] and size >> np.uint64(8 * width - 1):
                return -1 - row
            start += width
            if size > np.uint64((len(body) - start) // sizes[column]):
                return -1 - row
            start += int(size) * sizes[column]
        if start > len(body):
            return -1 - row
    return start
