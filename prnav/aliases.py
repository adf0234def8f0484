"""Types that many modules need and no type checker can say more about, named once for what they hold."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""A NumPy array whose type of entries is said where it is used, or does not matter."""

JSON: TypeAlias = Any
"""A value in JSON's types, read from a file and not yet held to anything."""

JSONObject: TypeAlias = dict[str, JSON]
"""An object in JSON's types."""

Untyped: TypeAlias = Any
"""An object of a library without types, or one whose type is its maker's own affair."""

Progress: TypeAlias = Callable[[int, int, str], None]
"""Called with the number of things done, of all of them, and the name of the next one."""
