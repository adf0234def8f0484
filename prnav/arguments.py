"""Arguments of public functions, checked where they come in, so that errors name them and not NumPy's insides."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Array, Untyped
from prnav.errors import PrnavError


def whole(value: Untyped, name: str, low: int, high: int, error: type[PrnavError], reason: str = "") -> int:
    """A whole number from ``low`` to ``high``.

    Raises:
        error: it is none; ``reason`` says why it may not be larger.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer) or not low <= value <= high:
        told = repr(value)[:60]
        why = f" ({reason})" if reason else ""
        raise error(f"{name} is {told}; it must be a whole number from {low} to {high}{why}")
    return int(value)


def number(value: Untyped, name: str, low: float, high: float, error: type[PrnavError]) -> float:
    """A number from ``low`` to ``high``.

    Raises:
        error: it is none.
    """
    try:
        found = float(value)
    except (TypeError, ValueError) as problem:
        raise error(f"{name} is {value!r:.60}; it must be a number from {low:g} to {high:g}") from problem
    if not low <= found <= high:
        raise error(f"{name} is {found!r}; it must be a number from {low:g} to {high:g}")
    return found


def floats(values: ArrayLike, name: str, error: type[PrnavError]) -> NDArray[np.float64]:
    """An array of float64.

    Raises:
        error: the values are no numbers, or rows differ in length.
    """
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "fiub":
            raise ValueError(f"they are of type {array.dtype}")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as problem:
        raise error(f"{name} are not an array of numbers ({str(problem)[:100]})") from problem


def has_fractions(array: Array) -> bool:
    """Whether an array holds anything but whole numbers, of whatever type they are."""
    if array.size == 0 or array.dtype.kind in "iu":
        return False
    return array.dtype.kind != "f" or not bool((np.isfinite(array) & (array == np.floor(array))).all())


def indices(
    values: ArrayLike, name: str, limit: int, error: type[PrnavError], count: int | None = None
) -> NDArray[np.int64]:
    """Whole numbers (n,) from 0 to ``limit`` - 1, ``count`` of them where it is given.

    Raises:
        error: they are none. Numbers with a fraction are refused, never cut off.
    """
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as problem:
        raise error(f"{name} are not an array of whole numbers ({str(problem)[:100]})") from problem
    if array.size == 0:
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise error(f"{name} are of type {array.dtype}; they must be whole numbers from 0 to {limit - 1}")
    array = np.ascontiguousarray(array).reshape(-1)
    if count is not None and len(array) != count:
        raise error(f"{name} are {len(array)}; there must be {count}, one per row")
    if len(array) and not 0 <= int(array.min()) <= int(array.max()) < limit:
        bad = int(array[(array < 0) | (array >= limit)][0])
        raise error(f"{name} hold {bad}; valid: 0 to {limit - 1}")
    return array.astype(np.int64, copy=False)
