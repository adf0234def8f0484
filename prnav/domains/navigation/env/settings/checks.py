"""The few ways in which a setting can be wrong, each told in one line."""

from __future__ import annotations

from collections.abc import Iterable

from prnav.aliases import Untyped


def check_at_least(least: int, **values: Untyped) -> None:
    """Pass if all are whole numbers of at least ``least``, or None.

    Raises:
        ValueError: one is not; it is named by its keyword.
    """
    for name, value in values.items():
        if value is not None and (not isinstance(value, int) or isinstance(value, bool) or value < least):
            raise ValueError(f"{name} is {value!r}; it must be a whole number and at least {least}")


def check_choice(valid: Iterable[str], **values: Untyped) -> None:
    """Pass if all are among ``valid``.

    Raises:
        ValueError: one is not; it is named by its keyword.
    """
    choices = list(valid)
    for name, value in values.items():
        if value not in choices:
            raise ValueError(f"{name} is {value!r}; valid: {', '.join(map(repr, choices))}")


def check_filled(**values: Untyped) -> None:
    """Pass if all are texts with something in them, or None.

    Raises:
        ValueError: one is not; it is named by its keyword.
    """
    for name, value in values.items():
        if value is not None and (not isinstance(value, str) or not value.strip()):
            raise ValueError(f"{name} is {value!r}; it must be a text that is not empty")
