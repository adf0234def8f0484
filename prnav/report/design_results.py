"""What results of designs say: performances, gains and correlations with their intervals, as pure functions.

A result is a row as ``prnav-design`` leaves them in ``results.jsonl``: a specialist's group, design, task, seed and the
measures of each episode. A *unit* is one specialist; intervals resample units and episodes (a two-level bootstrap), so
that they cover another draw of seeds and designs as well as another draw of episodes. U units, E episodes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, JSONObject, Untyped
from prnav.catalog import task_names, task_spec
from prnav.errors import RecordError
from prnav.evaluate.intervals import Interval
from prnav.files import read_regular
from prnav.result_kinds import ROW
from prnav.schema import parse_json

Float64 = NDArray[np.float64]
Row = Mapping[str, JSON]

RESULTS = "results.jsonl"
RESAMPLES = 2_000


@dataclass(frozen=True, eq=False)
class Performance:
    """One group of designs on one task."""

    group: str
    task: str
    interval: Interval
    """Mean over units and episodes."""
    units: Float64
    """Mean of each unit, (U,)."""
    designs: tuple[str, ...]
    """Name of each unit's design, (U,)."""


@dataclass(frozen=True, eq=False)
class Gains:
    """Optimised against initial designs, start by start."""

    starts: tuple[str, ...]
    initial: list[Interval]
    optimised: list[Interval]
    gain: Interval
    """Mean over the starts of the difference."""
    improved: int
    """Starts whose optimised design is better."""


@dataclass(frozen=True, eq=False)
class Correlation:
    """Whether two scores order designs alike."""

    names: tuple[str, ...]
    first: Float64
    second: Float64
    rho: Interval
    """Spearman's rank correlation."""
    labels: tuple[str, str] = ("first", "second")
    """What the scores are."""


def load_rows(folders: Sequence[str | Path]) -> list[JSONObject]:
    """Rows of several folders' results.

    Raises:
        RecordError: there are none, or a file is broken.
    """
    rows = []
    for folder in folders:
        path = Path(folder)
        path = path / RESULTS if path.is_dir() else path
        try:
            lines = read_regular(path).decode("utf-8").splitlines()
        except (OSError, ValueError) as error:
            raise RecordError(
                f"results {path}: cannot be read ({error}); give a folder made by prnav-design"
            ) from error
        for number, line in enumerate(lines, start=1):
            rows.append(parse_json(line, ROW, RecordError, f"results {path}: line {number}", "make them again"))
    if not rows:
        raise RecordError(
            f"results {', '.join(map(str, folders))}: no line in them; let the search or sweep finish first"
        )
    return rows


def performances(rows: Sequence[Row], measure: str) -> list[Performance]:
    """Each group's performance on each task, groups in the order of the rows."""
    keys = list(dict.fromkeys((str(row["group"]), _task(row)) for row in rows))
    result = []
    for group, task in keys:
        own = [row for row in rows if str(row["group"]) == group and _task(row) == task]
        values = episodes(own, measure)
        units = np.array([unit.mean() for unit in values])
        names = tuple(str(row["design"]) for row in own)
        result.append(Performance(group, task, two_level_interval(values), units, names))
    return result


def gains(rows: Sequence[Row], measure: str) -> Gains:
    """Gain of every start that has a row "initial N" and one "optimised N"; episodes are paired, seeds too.

    Raises:
        RecordError: there is no such pair.
    """
    starts = [str(row["group"]).removeprefix("initial ") for row in rows if str(row["group"]).startswith("initial ")]
    before, after, differences, kept = [], [], [], []
    for start in dict.fromkeys(starts):
        pair = [[row for row in rows if row["group"] == f"{which} {start}"] for which in ("initial", "optimised")]
        if not pair[1]:
            continue
        values = [episodes(own, measure) for own in pair]
        kept.append(start)
        before.append(two_level_interval(values[0]))
        after.append(two_level_interval(values[1]))
        differences += [b - a for a, b in zip(*values, strict=False) if len(a) == len(b)]
    if not kept or not differences:
        raise RecordError(
            "results: no pair of groups 'initial N' and 'optimised N' on equal episodes; run an optimisation"
        )
    improved = sum(b.mean > a.mean for a, b in zip(before, after, strict=True))
    return Gains(tuple(kept), before, after, two_level_interval(differences), improved)


def transfer(rows: Sequence[Row], measures: Mapping[str, str], default: str) -> Correlation:
    """Designs' performance on one task against that on another (the paper's "Do designs transfer between tasks?").

    Args:
        rows: results of the same designs on two tasks.
        measures: measure of each task by name.
        default: measure of tasks not named.

    Raises:
        RecordError: there are not two tasks, or no designs that both have.
    """
    tasks = list(dict.fromkeys(_task(row) for row in rows))
    if len(tasks) != 2:
        raise RecordError(f"results: transfer compares two tasks; found {', '.join(tasks)}")
    means: list[dict[str, float]] = []
    for task in tasks:
        own = [row for row in rows if _task(row) == task]
        measure = measures.get(task, default)
        names = dict.fromkeys(str(row["design"]) for row in own)
        means.append(
            {
                n: float(np.mean([v.mean() for v in episodes([r for r in own if r["design"] == n], measure)]))
                for n in names
            }
        )
    both = [name for name in means[0] if name in means[1]]
    return correlation(both, [means[0][name] for name in both], [means[1][name] for name in both], (tasks[0], tasks[1]))


def against_scores(rows: Sequence[Row], scores: Mapping[str, Mapping[str, float]], measure: str) -> Correlation:
    """Designs' proxy scores against the performance of their specialists.

    Args:
        rows: results.
        scores: by name of design, each with "score", as ``prnav-design evaluate --proxy --json`` writes them.
        measure: what counts as performance.

    Raises:
        RecordError: fewer than three designs have both.
    """
    names = [name for name in dict.fromkeys(str(row["design"]) for row in rows) if name in scores]
    worth = [
        float(np.mean([v.mean() for v in episodes([r for r in rows if r["design"] == n], measure)])) for n in names
    ]
    return correlation(names, [float(scores[name]["score"]) for name in names], worth, ("proxy's score", measure))


def _own_scores(rows: Sequence[Row]) -> dict[str, str]:
    """The measure of each task that is ranked by another one than SPL."""
    names = {_task(row) for row in rows} & set(task_names())
    return {name: score for name in names if (score := task_spec(name).score) != "spl"}


def correlation(
    names: Sequence[str],
    first: Sequence[float],
    second: Sequence[float],
    labels: tuple[str, str] = ("first", "second"),
) -> Correlation:
    """Spearman's rho of two scores of the same designs, with a bootstrap interval over designs.

    Raises:
        RecordError: fewer than three designs.
    """
    if len(names) < 3:
        raise RecordError(f"results: a rank correlation needs at least 3 designs; there are {len(names)}")
    a, b = np.asarray(first, np.float64), np.asarray(second, np.float64)
    rng = np.random.Generator(np.random.PCG64(0))
    drawn = [spearman(a[rows], b[rows]) for rows in rng.integers(0, len(a), (RESAMPLES, len(a)))]
    low, high = np.nanquantile(drawn, [0.025, 0.975])
    return Correlation(tuple(names), a, b, Interval(spearman(a, b), float(low), float(high)), labels)


def spearman(first: Float64, second: Float64) -> float:
    """Spearman's rank correlation, ties sharing their mean rank; NaN where a score does not vary."""
    ranks = [_ranks(values) - (len(values) - 1) / 2.0 for values in (first, second)]
    norm = float(np.sqrt((ranks[0] ** 2).sum() * (ranks[1] ** 2).sum()))
    return float(ranks[0] @ ranks[1]) / norm if norm > 0.0 else float("nan")


def two_level_interval(units: Sequence[Float64], confidence: float = 0.95, seed: int = 0) -> Interval:
    """Mean of units (U arrays of E episodes) with its percentile-bootstrap interval over units and episodes.

    Units of as many episodes share the drawn ones, as they played the same. A single unit is resampled over its
    episodes alone: its interval says nothing of other seeds.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    count = len(units)
    same = len({len(unit) for unit in units}) == 1
    means = np.empty(RESAMPLES)
    for index in range(RESAMPLES):
        chosen = rng.integers(0, count, count) if count > 1 else np.zeros(1, np.int64)
        if same:
            rows = rng.integers(0, len(units[0]), len(units[0]))
            means[index] = np.mean([units[unit][rows].mean() for unit in chosen])
        else:
            means[index] = np.mean(
                [units[unit][rng.integers(0, len(units[unit]), len(units[unit]))].mean() for unit in chosen]
            )
    low, high = np.quantile(means, [0.5 - confidence / 2.0, 0.5 + confidence / 2.0])
    return Interval(float(np.mean([unit.mean() for unit in units])), float(low), float(high))


def episodes(rows: Sequence[Row], measure: str) -> list[Float64]:
    """A measure of each row's episodes, one array (E,) per row.

    Raises:
        RecordError: a row lacks it.
    """
    for row in rows:
        if not row["measures"].get(measure):
            have = ", ".join(sorted(row["measures"]))
            raise RecordError(f"results: design {row['design']} has no measure {measure!r}; it has {have}")
    return [np.asarray(row["measures"][measure], np.float64) for row in rows]


def _task(row: Row) -> str:
    return str(row.get("task", "pointgoal"))


def _ranks(values: Float64) -> Float64:
    order = np.argsort(values, kind="stable")
    ranks = np.empty(len(values))
    ranks[order] = np.arange(len(values))
    for value in np.unique(values):
        same = values == value
        ranks[same] = ranks[same].mean()
    return ranks


ANALYSES: Mapping[str, Callable[[Sequence[Row], str], Untyped]] = {
    "spread": performances,
    "gain": gains,
    "axes": performances,
    "interpolation": performances,
    "dropout": performances,
    "cameras": performances,
    "designs": performances,
    "transfer": lambda rows, measure: transfer(rows, _own_scores(rows), measure),
}
"""What each figure of ``prnav-design compare`` shows."""
