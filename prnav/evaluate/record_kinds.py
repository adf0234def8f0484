"""What the files of an evaluation hold; every reader holds them to this."""

from __future__ import annotations

from typing import Any

from prnav.errors import RecordError
from prnav.schema import Anything, ListOf, MapOf, Maybe, Misfit, Number, Table, Text, Truth
from prnav.stored_arrays import Like

MEASURE = Maybe(Number(-1e12, 1e12))
"""A measure of an episode; null stands for infinity."""

POINT = ListOf(Number(-1e9, 1e9), 3)

ROW = Table(
    needed={"scene_id": Text(4096), "episode_id": Text(4096)},
    allowed={
        "success": Number(0, 1),
        "spl": Number(0, 1),
        "soft_spl": Number(-1e12, 1),
        "soft_spl_closest": Number(-1e12, 1),
        "distance_to_goal": MEASURE,
        "closest_distance": MEASURE,
        "geodesic_distance": MEASURE,
        "path_length": Number(0, 1e12),
        "collisions": Number(0, 1e12),
        "steps": Number(0, 1e12),
        "reward": MEASURE,
        "start": POINT,
        "goal": Maybe(POINT),
    },
)
"""A line of ``records.jsonl``."""

DESIGN = Table(
    needed={
        "name": Text(),
        "sensors": ListOf(ListOf(Number(-1e6, 1e6), 7)),
        "grid": Number(1, 64, whole=True),
        "body": Table(allowed={"radius": Number(0, 1e3), "height": Number(0, 1e3), "shape": Text()}),
    }
)

HEADER = Table(
    needed={"format": Number(0, 1e6, whole=True)},
    allowed={
        "finished": Truth(),
        "version": Text(),
        "benchmark": Maybe(Text()),
        "task": Text(200),
        "target": Maybe(Text()),
        "agent": Text(4096),
        "actions": Text(),
        "split": Text(4096),
        "episodes_hash": Text(),
        "episodes": Number(1, 1e12, whole=True),
        "navmeshes": MapOf(Text(4096)),
        "design": Maybe(DESIGN),
        "checkpoint": Maybe(
            Table(
                allowed={
                    "recipe": Text(),
                    "seed": Number(whole=True),
                    "steps": Number(0, 1e18, whole=True),
                    "encoder": Text(),
                }
            )
        ),
        "measures": MapOf(Table(dict.fromkeys(("mean", "low", "high"), MEASURE))),
        "rules": MapOf(Anything()),
    },
)
"""``evaluation.json``."""

RESULT = Table(
    needed={
        "kind": Text(),
        "format": Anything(),
        "task": Text(200),
        "rules": MapOf(Anything()),
        "measures": MapOf(Table(allowed=dict.fromkeys(("mean", "low", "high"), MEASURE))),
        "sha256": MapOf(Text(64)),
    }
)
"""``submission.json``."""

TRACES = {"scene_id": Like("U", 1), "episode_id": Like("U", 1), "steps": Like("iu", 1)}
"""What ``trajectories.npz`` has whatever the task; the task's own arrays have a row per step, or per state."""


def check_rows(rows: list[Any], where: str, remedy: str) -> None:
    """Hold rows of records to :data:`ROW`, and all to the first one's measures.

    Raises:
        RecordError: a row does not fit.
    """
    for number, row in enumerate(rows, start=1):
        try:
            ROW.check(row, "")
            if row.keys() != rows[0].keys():
                other = sorted(row.keys() ^ rows[0].keys())[0]
                raise Misfit(f"{other!r} is in one of this line and the first line only")
        except Misfit as problem:
            raise RecordError(f"{where}: line {number}: {problem}; {remedy}") from problem
