"""What our own JSON files hold, said once and checked where they are read.

A file of ours may come from anybody, or be what a fault left. A schema says which parts there are, of which type, and
whether they may be missing; what does not fit is one error that names the file, the part and what would be valid.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from prnav.errors import PrnavError
from prnav.files import read_regular

MAX_JSON = 1 << 28
"""Most bytes of a JSON file that is read."""


class Misfit(Exception):
    """A value is not of its kind; the message says where and how."""


class Kind(Protocol):
    """A kind of values."""

    def check(self, value: Any, place: str) -> None:
        """Raise :class:`Misfit` for a value that is not of this kind; ``place`` is where it stands."""
        ...


@dataclass(frozen=True)
class Anything:
    """Any value."""

    def check(self, value: Any, place: str) -> None:
        """Nothing to check."""


@dataclass(frozen=True)
class Text:
    """A string."""

    longest: int = 100_000

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        if not isinstance(value, str) or len(value) > self.longest:
            _misfit(value, place, "a text")


@dataclass(frozen=True)
class Truth:
    """true or false."""

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        if not isinstance(value, bool):
            _misfit(value, place, "true or false")


@dataclass(frozen=True)
class Number:
    """A number, ``whole`` without a fraction, ``finite`` or infinite as well."""

    low: float = -1e300
    high: float = 1e300
    whole: bool = False
    finite: bool = True

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        good = isinstance(value, int if self.whole else int | float) and not isinstance(value, bool)
        if good and not self.finite and math.isinf(value):
            return
        if not good or not self.low <= value <= self.high:  # so is NaN
            between = f" from {self.low:g} to {self.high:g}" if (self.low, self.high) != (-1e300, 1e300) else ""
            _misfit(value, place, f"a {'whole' if self.whole else 'finite'} number{between}")


@dataclass(frozen=True)
class Maybe:
    """null, or a value of another kind."""

    kind: Kind

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        if value is not None:
            self.kind.check(value, place)


@dataclass(frozen=True)
class ListOf:
    """A list of values of one kind, ``size`` of them where it is given."""

    kind: Kind
    size: int | None = None

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        if not isinstance(value, list) or self.size not in (None, len(value)):
            _misfit(value, place, "a list" if self.size is None else f"a list of {self.size}")
        for index, item in enumerate(value):
            self.kind.check(item, f"{place}[{index}]")


@dataclass(frozen=True)
class MapOf:
    """An object with any keys, whose values are of one kind."""

    kind: Kind

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        if not isinstance(value, dict):
            _misfit(value, place, "an object")
        for key, item in value.items():
            self.kind.check(item, _joined(place, key))


@dataclass(frozen=True)
class Table:
    """An object with keys that must be there, and others that may; what neither names is let through."""

    needed: Mapping[str, Kind] = field(default_factory=dict)
    allowed: Mapping[str, Kind] = field(default_factory=dict)

    def check(self, value: Any, place: str) -> None:
        """See :meth:`Kind.check`."""
        if not isinstance(value, dict):
            _misfit(value, place, "an object")
        for key in self.needed:
            if key not in value:
                raise Misfit(f"{_joined(place, key)!r} is missing")
        for key, item in value.items():
            kind = self.needed.get(key) or self.allowed.get(key)
            if kind is not None:
                kind.check(item, _joined(place, key))


def fit(value: Any, kind: Kind, error: type[PrnavError], where: str, remedy: str) -> Any:
    """``value``, which is of a kind.

    Raises:
        error: it is not; the message begins with ``where`` and ends with ``remedy``.
    """
    try:
        kind.check(value, "")
    except Misfit as problem:
        raise error(f"{where}: {problem}; {remedy}") from problem
    return value


def parse_json(text: str | bytes, kind: Kind, error: type[PrnavError], where: str, remedy: str) -> Any:
    """The value of a JSON text, which is of a kind.

    Raises:
        error: it is no JSON, or of another kind.
    """
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise error(f"{where}: not valid JSON ({str(problem)[:120]}); {remedy}") from problem
    return fit(value, kind, error, where, remedy)


def read_json(path: str | Path, kind: Kind, error: type[PrnavError], remedy: str) -> Any:
    """The value of a JSON file, which is of a kind.

    Raises:
        error: the file cannot be read, is no JSON, or of another kind.
    """
    try:
        text = read_regular(path, MAX_JSON)
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise error(f"{path}: cannot be read ({reason}); {remedy}") from problem
    return parse_json(text, kind, error, str(path), remedy)


def _joined(place: str, key: str) -> str:
    return f"{place}.{key}"[:120] if place else key[:120]


def _misfit(value: Any, place: str, valid: str) -> None:
    told = repr(value)
    told = told if len(told) <= 60 else f"{told[:57]}..."
    raise Misfit(f"{place + ' is' if place else 'it holds'} {told}, which is not {valid}")
