"""What the numbers of a config must be, said in one way: each function names the field, its value and what is valid.

They are for ``__post_init__`` of frozen dataclasses, whose ``ValueError`` :mod:`prnav.config` turns into an error that
names the file.
"""

from __future__ import annotations


def require_at_least(config: object, least: int, *names: str) -> None:
    """Hold fields of a config to a least value.

    Raises:
        ValueError: one is below it.
    """
    for name in names:
        value = getattr(config, name)
        if not value >= least:
            needed = "0 or more" if least == 0 else f"at least {least}"
            raise ValueError(f"{name} is {value}; it must be {needed}")


def require_positive(config: object, *names: str) -> None:
    """Hold fields of a config above 0.

    Raises:
        ValueError: one is not.
    """
    for name in names:
        value = getattr(config, name)
        if not value > 0.0:
            raise ValueError(f"{name} is {value}; it must be positive")


def require_share(config: object, *names: str) -> None:
    """Hold fields of a config between 0 and 1.

    Raises:
        ValueError: one is not.
    """
    for name in names:
        value = getattr(config, name)
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"{name} is {value}; it must be in [0, 1]")
