"""What the files of searches and sweeps hold; every reader holds them to this."""

from __future__ import annotations

from pathlib import Path

from prnav.aliases import JSONObject
from prnav.errors import RecordError
from prnav.schema import ListOf, MapOf, Number, Table, Text, read_json

_VALUES = MapOf(ListOf(Number(finite=False)))

JUDGED = Table({"asked": Table({"steps": Number(0, 1e18, whole=True)}), "measures": _VALUES})
"""``judged.json``: the measures of a specialist, one per episode."""

ROW = Table(
    {"group": Text(4096), "design": Text(4096), "measures": _VALUES},
    {
        "task": Text(4096),
        "seed": Number(whole=True),
        "steps": Number(0, 1e18),
        "sensors": Number(0, 1e6, whole=True),
        "grid": Number(0, 1e6, whole=True),
        "kind": Text(),
    },
)
"""A line of ``results.jsonl``."""

START = Table(
    {
        "method": Text(),
        "score": Text(),
        "steps": Number(0, 1e18),
        "trials": Number(0, 1e12, whole=True),
        "initial": Number(),
        "found": Number(),
    },
    {"scores": ListOf(Number())},
)
"""``start.json``: what a start of a search came to."""

_JOB = dict.fromkeys(("name", "group", "design", "task"), Text(4096))
PLAN_KIND = Table({"kind": Text(), "jobs": ListOf(Table({**_JOB, "seed": Number(whole=True)}))})
"""``plan.json``: the jobs of a sweep."""


def read_judged(path: Path) -> JSONObject:
    """Measures of a specialist.

    Raises:
        RecordError: the file is broken.
    """
    told: JSONObject = read_json(path, JUDGED, RecordError, "delete it, and give the command again")
    return told


def read_start(path: Path) -> JSONObject:
    """What a start of a search came to.

    Raises:
        RecordError: the file is missing or broken.
    """
    told: JSONObject = read_json(path, START, RecordError, "delete it, and give the command again")
    return told
