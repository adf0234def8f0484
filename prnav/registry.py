"""Tables of what can be chosen by name: each entry says where the choice is, and is imported when it is chosen.

A new choice is one module and one line in its table.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

Registry = Mapping[str, str]
"""Name -> "module:attribute"."""


def require_known(name: str, table: Registry, field: str) -> None:
    """Hold a config's field to the names of a table.

    Raises:
        ValueError: it is none of them.
    """
    if name not in table:
        raise ValueError(f"{field} is {name!r}; valid: {', '.join(map(repr, table))}")


def resolve(table: Registry, name: str) -> Any:
    """What stands under a name of the table."""
    module, _, attribute = table[name].partition(":")
    return vars(importlib.import_module(module))[attribute]
