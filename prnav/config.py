"""Configuration: strict TOML in, frozen dataclasses out, and back.

A config class is a frozen dataclass whose fields are ``bool``, ``int``, ``float``, ``str``, ``Literal[...]``,
``tuple[T, ...]``, ``T | None`` or another such dataclass (a TOML table, whose class may depend on the values beside
it: :data:`TYPE_OF`). A file names every value it wants to change; what it does not name has the class's default.
Unknown keys, wrong types and values that a class's ``__post_init__`` refuses (it raises ``ValueError``) are errors
that name the file and the key.
"""

from __future__ import annotations

import dataclasses
import difflib
import hashlib
import json
import math
import tomllib
import types
import typing
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar

from prnav.errors import ConfigError

C = TypeVar("C")

TYPE_OF = "type_of"
"""Key of a field's metadata: a function that finds the field's class in the table that the field stands in."""


def load_config(cls: type[C], path: str | Path, overrides: Iterable[str] = ()) -> C:
    """Config of class ``cls`` from a TOML file, then ``key.sub=value`` overrides (values are TOML, or bare strings).

    Raises:
        ConfigError: no such file, not TOML, an unknown key, or a value of a wrong type or range.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"config {path}: cannot be read ({error}); give the path of a TOML file") from error
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"config {path}: not valid TOML: {error}") from error
    overrides = list(overrides)
    apply_overrides(values, overrides)
    return from_mapping(cls, values, f"{path} with {', '.join(overrides)}" if overrides else str(path))


def apply_overrides(values: dict[str, Any], overrides: Iterable[str]) -> None:
    """Set ``key.sub=value`` strings in a nested dictionary, in place."""
    for override in overrides:
        key, sign, raw = override.partition("=")
        if not sign or not key.strip():
            raise ConfigError(f"override {override!r} is not of the form key=value, for example ppo.learning_rate=1e-4")
        try:
            value = tomllib.loads(f"value = {raw}")["value"]
        except tomllib.TOMLDecodeError:
            value = raw.strip()
        table = values
        *tables, leaf = key.strip().split(".")
        for name in tables:
            table = table.setdefault(name, {})
            if not isinstance(table, dict):
                raise ConfigError(f"override {override!r}: {name!r} is a value, not a table")
        table[leaf] = value


def from_mapping(cls: type[C], values: Mapping[str, Any], source: str, prefix: str = "") -> C:
    """Config of class ``cls`` from a nested mapping; ``source`` names its origin in errors."""
    hints = typing.get_type_hints(cls)
    names = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    for key in values:
        if key not in names:
            near = difflib.get_close_matches(key, names, n=1)
            remedy = f"did you mean {prefix}{near[0]!s}?" if near else f"valid here: {', '.join(names)}"
            raise ConfigError(f"config {source}: unknown key {prefix + key!r}; {remedy}")
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if TYPE_OF in field.metadata and field.name in values:
            hints[field.name] = field.metadata[TYPE_OF](values)
    arguments = {key: _convert(value, hints[key], source, prefix + key) for key, value in values.items()}
    try:
        return cls(**arguments)
    except ValueError as error:
        where = f"{prefix.rstrip('.')}: " if prefix else ""
        raise ConfigError(f"config {source}: {where}{error}") from error
    except TypeError as error:
        missing = [f.name for f in dataclasses.fields(cls) if f.name not in arguments]  # type: ignore[arg-type]
        raise ConfigError(f"config {source}: {prefix or 'top level'} lacks keys; of these: {missing}") from error


def _convert(value: Any, hint: Any, source: str, key: str) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if dataclasses.is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise ConfigError(f"config {source}: {key!r} is {value!r}; it must be a table [{key}]")
        return from_mapping(typing.cast(type, hint), value, source, key + ".")
    if origin in (typing.Union, types.UnionType):
        inner = [argument for argument in arguments if argument is not type(None)]
        if value is None or (value == "" and str not in inner):
            return None
        return _convert(value, inner[0], source, key)
    if origin is Literal:
        if value not in arguments:
            raise ConfigError(f"config {source}: {key!r} is {value!r}; valid: {', '.join(map(repr, arguments))}")
        return value
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise ConfigError(f"config {source}: {key!r} is {value!r}; it must be a list")
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return tuple(_convert(item, arguments[0], source, f"{key}[{i}]") for i, item in enumerate(value))
        if len(value) != len(arguments):
            raise ConfigError(f"config {source}: {key!r} has {len(value)} items; it must have {len(arguments)}")
        return tuple(
            _convert(item, argument, source, f"{key}[{i}]")
            for i, (item, argument) in enumerate(zip(value, arguments, strict=True))
        )
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, hint) or (isinstance(value, bool) and hint is not bool):
        raise ConfigError(f"config {source}: {key!r} is {value!r}; it must be of type {hint.__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"config {source}: {key!r} is {value!r}; it must be finite")
    return value


def to_mapping(config: Any) -> dict[str, Any]:
    """Nested dictionary of a config: JSON-able, None left out."""
    result: dict[str, Any] = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if value is None:
            continue
        if dataclasses.is_dataclass(value):
            value = to_mapping(value)
        elif isinstance(value, tuple):
            value = list(value)
        result[field.name] = value
    return result


def to_toml(config: Any) -> str:
    """TOML text that :func:`load_config` reads back to an equal config."""
    lines: list[str] = []

    def write(table: Mapping[str, Any], prefix: str) -> None:
        for key, value in table.items():
            if not isinstance(value, dict):
                lines.append(f"{key} = {_toml_value(value)}")
        for key, value in table.items():
            if isinstance(value, dict):
                lines.extend(["", f"[{prefix}{key}]"])
                write(value, f"{prefix}{key}.")

    write(to_mapping(config), "")
    return "\n".join(lines).lstrip("\n") + "\n"


def _toml_value(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


def config_hash(config: Any) -> str:
    """First 16 hex digits of the SHA-256 of a config's values."""
    return hashlib.sha256(json.dumps(to_mapping(config), sort_keys=True).encode()).hexdigest()[:16]
