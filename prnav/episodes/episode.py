"""What an episode is, and how one record of a Habitat PointNav file becomes one and back.

Every key of a record is kept: known ones as fields, all others in ``extra``. A known key whose value had to be made
regular (an integer id, ``"info": null``) keeps the file's own value in ``extra`` under its name, and the writer uses
that as long as it still says the same. The order of keys is kept too, so that an unchanged file is written back byte
for byte.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NoReturn

from prnav.aliases import JSON, JSONObject, Untyped
from prnav.errors import EpisodeError
from prnav.frames import quaternion_to_yaw

EPISODE_KEYS = ("episode_id", "scene_id", "start_position", "start_rotation", "info", "goals")
GOAL_KEYS = ("position", "radius")
_UPRIGHT = 0.05  #: y and w of a quaternion x, y, z, w together: less stands upside down
MAX_COORDINATE = 1e6  #: positions farther from the origin [m] are refused as damage

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Goal:
    """Where to go."""

    position: Vector  #: (3,) world [m]
    radius: float | None = None  #: [m]; None where the file does not say
    extra: JSONObject = field(default_factory=dict)  #: unknown keys of the record, kept
    keys: tuple[str, ...] = field(default=GOAL_KEYS, repr=False, compare=False)  #: key order of the record


@dataclass(frozen=True)
class Episode:
    """One start and its goals in one scene."""

    episode_id: str  #: unique within its scene
    scene_id: str
    start_position: Vector  #: (3,) world [m]
    start_rotation: Vector  #: unit quaternion x, y, z, w
    goals: tuple[Goal, ...]
    info: JSONObject = field(default_factory=dict)  #: geodesic_distance [m], difficulty, ...
    extra: JSONObject = field(default_factory=dict)  #: unknown keys of the record, kept
    keys: tuple[str, ...] = field(default=EPISODE_KEYS, repr=False, compare=False)  #: key order of the record

    @property
    def start_yaw(self) -> float:
        """Yaw [rad] of the start rotation."""
        return float(quaternion_to_yaw(self.start_rotation))

    @property
    def geodesic_distance(self) -> float:
        """Length of the shortest path as the file says it [m]; NaN where it does not."""
        return float(self.info.get("geodesic_distance", math.nan))


@dataclass(frozen=True)
class EpisodeDataset:
    """Episodes in file order, and the file's other top-level keys."""

    episodes: tuple[Episode, ...]
    header: JSONObject = field(default_factory=dict)

    @property
    def scene_ids(self) -> tuple[str, ...]:
        """Scenes in order of first appearance."""
        return tuple(dict.fromkeys(episode.scene_id for episode in self.episodes))


def episode_from_record(record: Untyped, source: str, index: int) -> Episode:
    """Episode from one JSON object.

    Args:
        record: the parsed object.
        source: the file's name, for errors.
        index: position of the record in its file, for errors.

    Raises:
        EpisodeError: a key is missing or holds what it cannot hold; names file, index and key.
    """
    where = f"{source}: episode {index}"
    if not isinstance(record, Mapping):
        raise EpisodeError(f"{where} is {_show(record)}; it must be an object with keys {', '.join(EPISODE_KEYS)}")
    extra = {key: value for key, value in record.items() if key not in EPISODE_KEYS}
    episode_id = _get(record, "episode_id", where)
    if isinstance(episode_id, int) and not isinstance(episode_id, bool):
        extra["episode_id"], episode_id = episode_id, str(episode_id)
    if not isinstance(episode_id, str) or not episode_id:
        _refuse(where, "episode_id", episode_id, "a non-empty string")
    scene_id = _get(record, "scene_id", where)
    if not isinstance(scene_id, str) or not scene_id:
        _refuse(where, "scene_id", scene_id, "a non-empty string")
    rotation = _vector(_get(record, "start_rotation", where), 4, where, "start_rotation")
    if abs(math.hypot(*rotation) - 1.0) > 1e-2:
        _refuse(where, "start_rotation", list(rotation), "a unit quaternion x, y, z, w")
    if math.hypot(rotation[1], rotation[3]) < _UPRIGHT:
        valid = "x, y, z, w; this stands upside down and is upright as w, x, y, z: put its first number last"
        _refuse(where, "start_rotation", list(rotation), valid)
    info = record.get("info")
    if info is None:
        if "info" in record:
            extra["info"] = None
        info = {}
    if not isinstance(info, dict):
        _refuse(where, "info", info, "an object")
    distance = info.get("geodesic_distance", 0.0)
    if not _is_number(distance) or distance < 0.0:
        _refuse(where, "info.geodesic_distance", distance, "a finite length in metres")
    goals = _get(record, "goals", where)
    if not isinstance(goals, list) or not goals:
        _refuse(where, "goals", goals, "a list with at least one goal")
    return Episode(
        episode_id=episode_id,
        scene_id=scene_id,
        start_position=_vector(_get(record, "start_position", where), 3, where, "start_position"),
        start_rotation=rotation,
        goals=tuple(_goal_from_record(goal, where, k) for k, goal in enumerate(goals)),
        info=info,
        extra=extra,
        keys=_intern_keys(record),
    )


def episode_to_record(episode: Episode) -> JSONObject:
    """JSON object of an episode: the inverse of :func:`episode_from_record`."""
    values = {
        "episode_id": episode.episode_id,
        "scene_id": episode.scene_id,
        "start_position": list(episode.start_position),
        "start_rotation": list(episode.start_rotation),
        "info": episode.info,
        "goals": [_goal_to_record(goal) for goal in episode.goals],
    }
    originals = episode.extra
    if "episode_id" in originals and str(originals["episode_id"]) == episode.episode_id:
        values["episode_id"] = originals["episode_id"]
    if not episode.info:
        if "info" in originals:
            values["info"] = originals["info"]
        elif "info" not in episode.keys:
            del values["info"]
    return _ordered(values, originals, episode.keys)


def _goal_from_record(record: Untyped, where: str, index: int) -> Goal:
    name = f"goals[{index}]"
    if not isinstance(record, Mapping):
        _refuse(where, name, record, "an object with keys position, radius")
    radius = record.get("radius")
    if radius is not None and not (_is_number(radius) and radius >= 0.0):
        _refuse(where, f"{name}.radius", radius, "a finite length in metres or null")
    return Goal(
        position=_vector(_get(record, "position", where, f"{name}."), 3, where, f"{name}.position"),
        radius=radius,
        extra={key: value for key, value in record.items() if key not in GOAL_KEYS},
        keys=_intern_keys(record),
    )


def _goal_to_record(goal: Goal) -> JSONObject:
    values: JSONObject = {"position": list(goal.position), "radius": goal.radius}
    if goal.radius is None and "radius" not in goal.keys:
        del values["radius"]
    return _ordered(values, goal.extra, goal.keys)


def _ordered(values: JSONObject, extra: JSONObject, keys: tuple[str, ...]) -> JSONObject:
    every = {**extra, **values}
    return {key: every[key] for key in dict.fromkeys((*keys, *values, *extra)) if key in every}


_KEYS: dict[tuple[str, ...], tuple[str, ...]] = {EPISODE_KEYS: EPISODE_KEYS, GOAL_KEYS: GOAL_KEYS}


def _intern_keys(record: Mapping[str, JSON]) -> tuple[str, ...]:
    """The record's keys, one tuple shared by the records that have the same."""
    keys = tuple(record)
    return _KEYS.setdefault(keys, keys) if len(_KEYS) < 1000 else keys


def _get(record: Mapping[str, JSON], key: str, where: str, prefix: str = "") -> Untyped:
    if key not in record:
        raise EpisodeError(f"{where}: key {prefix + key!r} is missing")
    return record[key]


def _is_number(value: Untyped) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MAX_COORDINATE


def _vector(value: Untyped, size: int, where: str, key: str) -> Vector:
    if not isinstance(value, list) or len(value) != size or not all(map(_is_number, value)):
        _refuse(where, key, value, f"a list of {size} finite numbers of size at most {MAX_COORDINATE:g}")
    return tuple(value)


def _refuse(where: str, key: str, value: Untyped, valid: str) -> NoReturn:
    raise EpisodeError(f"{where}: {key!r} is {_show(value)}; it must be {valid}")


def _show(value: Untyped) -> str:
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python prints
        text = f"a {type(value).__name__} too long to print"
    return text if len(text) <= 80 else text[:77] + "..."
