"""The result file: one evaluation in a few kilobytes, which anyone with the records can compute again.

It says what it is of, and stands beside the records. Verifying reads each episode's trace, works its measures out
anew by the task's rules, holds the rows to them, and then the means and intervals to the rows.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np

from prnav.aliases import JSONObject
from prnav.catalog import task_spec
from prnav.contracts import Evaluation
from prnav.errors import ConfigError, RecordError
from prnav.evaluate.record_kinds import RESULT
from prnav.evaluate.records import RECORDS, TRAJECTORIES, check_benchmark, load_evaluation, load_traces
from prnav.evaluate.summary import summarise
from prnav.files import sha256_file, write_text
from prnav.schema import Anything, MapOf, fit, read_json

SUBMISSION = "submission.json"
KIND, FORMAT = "prnav-result", 1
TOLERANCE = 1e-9
"""How far a number may be from what is computed again: sums are taken in another order."""


def write_submission(evaluation: Evaluation) -> Path:
    """Write ``submission.json`` beside the records of a finished evaluation."""
    head = {key: value for key, value in evaluation.header.items() if key not in ("format", "finished")}
    files = {name: sha256_file(evaluation.directory / name) for name in (RECORDS, TRAJECTORIES)}
    path = evaluation.directory / SUBMISSION
    write_text(path, json.dumps({"kind": KIND, "format": FORMAT, **head, "sha256": files}, indent=1) + "\n")
    return path


def verify_submission(path: str | Path, records: str | Path | None = None) -> Evaluation:
    """Compute a result file's numbers again from its records.

    Args:
        path: the result file.
        records: folder of the records; where the file stands, by default.

    Raises:
        RecordError: the file or the records are broken, of another benchmark version, or not of each other, or a
            number is not what the records give.
    """
    path = Path(path)
    told = _read(path)
    folder = path.parent if records is None else Path(records)
    evaluation = load_evaluation(folder)
    try:
        recompute = task_spec(told["task"]).evaluation.recompute
    except ConfigError as error:
        raise RecordError(f"{path}: {error}") from error
    for name, digest in told["sha256"].items():
        if name not in (RECORDS, TRAJECTORIES):
            raise RecordError(f"{path}: 'sha256' names {name!r}; valid: {RECORDS}, {TRAJECTORIES}")
        if not (folder / name).is_file() or sha256_file(folder / name) != digest:
            raise RecordError(
                f"{path}: {folder / name} is not the file it was computed from (SHA-256 differs); give the records' "
                f"folder with --records DIR, or make the result anew with prnav-eval --submit"
            )
    for key, value in evaluation.header.items():
        if key not in ("format", "finished") and told.get(key) != value:
            raise RecordError(f"{path}: {key!r} is not that of the records in {folder}; make it anew with --submit")
    for number, (row, track) in enumerate(zip(evaluation.rows, load_traces(evaluation), strict=True), start=1):
        for key, value in recompute(row, track, told).items():
            if key in row and not abs(float(row[key]) - value) <= TOLERANCE:
                raise RecordError(
                    f"{folder / RECORDS}: line {number}: {key} is {row[key]!r}, and its trajectory gives {value!r}; "
                    f"evaluate again with prnav-eval --restart"
                )
    for key, interval in summarise(evaluation.rows).items():
        for name, value in dataclasses.asdict(interval).items():
            stated = told["measures"].get(key, {}).get(name)
            if not (stated is None and np.isinf(value)) and not (
                isinstance(stated, int | float) and abs(stated - value) <= TOLERANCE
            ):
                raise RecordError(f"{path}: {key} {name} is {stated!r}, and the records give {value!r}")
    return evaluation


def _read(path: Path) -> JSONObject:
    told: JSONObject = read_json(path, MapOf(Anything()), RecordError, "give a file that prnav-eval --submit wrote")
    if told.get("kind") != KIND:
        raise RecordError(f"{path}: no result of prnav; give a file that prnav-eval --submit wrote")
    if told.get("format") != FORMAT:
        raise RecordError(f"{path}: format {told.get('format')!r}; this version of prnav reads {FORMAT}")
    fit(told, RESULT, RecordError, str(path), "make it anew with prnav-eval --submit")
    check_benchmark(told, path)
    return told
