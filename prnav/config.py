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
from typing import Literal, TypeVar

import tomli_w

from prnav.aliases import JSON, JSONObject, Untyped
from prnav.errors import ConfigError, PrnavError
from prnav.files import read_regular

C = TypeVar("C")

TYPE_OF = "type_of"
"""Key of a field's metadata: a function that finds the field's class in the table that the field stands in."""

LIMITS: dict[str, tuple[int, str]] = {
    "seed": (2**62, "seeds are 64-bit numbers that others are counted up from"),
    "episode_seed": (2**62, "seeds are 64-bit numbers that others are counted up from"),
    "rays_per_receptor": (4096, "more rays change nothing that float32 can tell"),
    "grid": (64, "64 x 64 receptors are a camera"),
    "camera_size": (2048, "a picture of more pixels fits no rollout"),
    "sensors": (256, "each sensor is drawn at every step"),
    "num_envs": (65_536, "each is an agent with its own rollout"),
    "groups": (1024, "each is a thread"),
    "threads": (1024, "no machine runs more at once"),
    "window": (1_000_000, "as many episodes are kept in memory"),
    "episodes_per_scene": (10_000_000, "they are kept in memory"),
    "validation_episodes": (65_536, "each is an environment"),
    "keep_checkpoints": (1_000_000, "each is a file"),
    "rollout_steps": (100_000, "a rollout is kept in memory"),
    "mini_batches": (65_536, "each has one environment at least"),
    "epochs": (10_000, "an update goes through its rollout so often"),
    "max_steps": (10_000_000, "an episode has so many at most"),
    "width": (16_384, "a layer is a matrix of this side"),
    "feedforward": (65_536, "a layer is a matrix of this side"),
    "lstm_hidden": (16_384, "a layer is a matrix of this side"),
    "head_hidden": (16_384, "a layer is a matrix of this side"),
    "position_width": (4096, "a layer is a matrix of this side"),
    "transformer_layers": (256, "each is a matrix product at every step"),
    "transformer_heads": (1024, "they share the width"),
    "lstm_layers": (64, "each is a matrix product at every step"),
    "max_texture_size": (16_384, "no image with a longer side is decoded"),
    "texture_budget": (1 << 30, "that is 5.7 GB with mip levels"),
    "starts": (100_000, "each is a search of its own"),
    "judge_seeds": (10_000, "each is a training run"),
}
"""Largest values of whole numbers by the last part of their key, and why; all others end at :data:`LARGEST`."""

LARGEST = 10**15
"""Largest whole number of any key that :data:`LIMITS` does not name."""

MAX_TEXT = 4096
"""Most characters of a text: no path is longer."""

MAX_TOML = 1 << 20
"""Most bytes of a TOML file that is read."""
RENAMED = "renamed_keys"
"""Class variable of a config class: tables that files of earlier versions have, and what they are called now."""


def load_config(cls: type[C], path: str | Path, overrides: Iterable[str] = ()) -> C:
    """Config of class ``cls`` from a TOML file, then ``key.sub=value`` overrides (values are TOML, or bare strings).

    Raises:
        ConfigError: no such file, not TOML, an unknown key, or a value of a wrong type or range.
    """
    values = read_toml(path, ConfigError, f"config {path}")
    overrides = list(overrides)
    apply_overrides(values, overrides)
    return from_mapping(cls, values, f"{path} with {', '.join(overrides)}" if overrides else str(path))


def apply_overrides(values: JSONObject, overrides: Iterable[str]) -> None:
    """Set ``key.sub=value`` strings in a nested dictionary, in place."""
    for override in overrides:
        key, sign, raw = override.partition("=")
        if not sign or not key.strip():
            raise ConfigError(f"override {override!r} is not of the form key=value, for example ppo.learning_rate=1e-4")
        try:
            value = tomllib.loads(f"value = {raw}")["value"]
        except tomllib.TOMLDecodeError:
            value = raw.strip()
        except (ValueError, RecursionError) as error:  # thousands of digits or brackets
            raise ConfigError(f"override {override[:60]!r}...: its value cannot be read ({error})") from error
        table = values
        *tables, leaf = key.strip().split(".")
        for name in tables:
            table = table.setdefault(name, {})
            if not isinstance(table, dict):
                raise ConfigError(f"override {override!r}: {name!r} is a value, not a table")
        table[leaf] = value


def read_toml(path: str | Path, error: type[PrnavError], where: str) -> JSONObject:
    """Table of a TOML file.

    Args:
        path: the file.
        error: what to raise.
        where: what errors call the file.

    Raises:
        error: no such file, no regular one, too big, or not TOML.
    """
    try:
        return tomllib.loads(read_regular(path, MAX_TOML).decode("utf-8-sig"))
    except OSError as problem:
        reason = problem.strerror or problem
        raise error(f"{where}: cannot be read ({reason}); give the path of a TOML file") from problem
    except UnicodeDecodeError as problem:
        raise error(f"{where}: not valid TOML: it is no UTF-8 text ({problem.reason})") from problem
    except (ValueError, RecursionError) as problem:
        raise error(f"{where}: not valid TOML: {problem}") from problem


def from_mapping(cls: type[C], values: Mapping[str, JSON], source: str, prefix: str = "") -> C:
    """Config of class ``cls`` from a nested mapping; ``source`` names its origin in errors."""
    hints = typing.get_type_hints(cls)
    names = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    for key in values:
        if key not in names:
            now = getattr(cls, RENAMED, {}).get(key)
            if now is not None:
                raise ConfigError(f"config {source}: [{prefix}{key}] is now called [{prefix}{now}]; rename it")
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


def _convert(value: Untyped, hint: Untyped, source: str, key: str) -> Untyped:
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
            raise ConfigError(f"config {source}: {key!r} is {value!r}; it must be a list, such as [{value!r}]")
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
    if hint is int and not isinstance(value, bool):
        most, reason = LIMITS.get(key.rpartition(".")[2], (LARGEST, "no run gets that far"))
        if abs(value) > most:
            told = str(value) if abs(value) < 10**30 else f"{str(value)[:12]}... ({len(str(value))} digits)"
            raise ConfigError(f"config {source}: {key!r} is {told}; at most {most} ({reason})")
    if isinstance(value, str) and len(value) > MAX_TEXT:
        raise ConfigError(f"config {source}: {key!r} is a text of {len(value)} characters; at most {MAX_TEXT}")
    plain = value.translate({10: " ", 9: " "}) if isinstance(value, str) and key.endswith("description") else value
    if isinstance(plain, str) and not plain.isprintable():
        raise ConfigError(f"config {source}: {key!r} is {value!r}; valid: text without control characters")
    return value


def to_mapping(config: Untyped) -> JSONObject:
    """Nested dictionary of a config: JSON-able, None left out."""
    result: JSONObject = {}
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


def to_toml(config: Untyped) -> str:
    """TOML text that :func:`load_config` reads back to an equal config."""
    return tomli_w.dumps(to_mapping(config))


def config_hash(config: Untyped) -> str:
    """First 16 hex digits of the SHA-256 of a config's values."""
    return hashlib.sha256(json.dumps(to_mapping(config), sort_keys=True).encode()).hexdigest()[:16]
