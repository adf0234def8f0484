"""Records of an evaluation on disk: one row per episode, trajectories, and what they belong to.

A folder holds ``evaluation.json`` (what was evaluated: agent, episodes, seed, body, version), ``records.jsonl`` (one
row per episode, in the order of the episode list) and ``trajectories.npz`` (in the same order). While an evaluation
runs, finished episodes are appended to ``records.jsonl`` in blocks, each after its trajectories are safe in
``trajectories.partial/``; a killed evaluation resumes after its last whole block and ends with the same bytes.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from prnav.aliases import JSON, Array, JSONObject, Untyped
from prnav.catalog import DEFAULT_TASK, task_spec
from prnav.contracts import Evaluation, Header, Played, Trace
from prnav.errors import ConfigError, RecordError
from prnav.evaluate.record_kinds import HEADER, TRACES, check_rows
from prnav.files import atomic_path, read_regular, remove_parts, write_text
from prnav.locks import FolderLock
from prnav.schema import read_json
from prnav.stored_arrays import BROKEN, read_arrays

EVALUATION, RECORDS, TRAJECTORIES, PARTIAL = (
    "evaluation.json",
    "records.jsonl",
    "trajectories.npz",
    "trajectories.partial",
)
FORMAT = 1
"""Version of the folder's layout; a reader refuses a newer one."""

BLOCK_EPISODES, BLOCK_SECONDS = 64, 20.0
"""A block is written when it holds so many episodes or is so old: what a kill can cost."""

EpisodeId = tuple[str, str]

_AGAIN = "evaluate again with --restart"


class RecordWriter:
    """Appends episodes to an evaluation's folder; picks up what an interrupted evaluation left there.

    Use it as a context manager: the folder is locked for its lifetime.

    Args:
        directory: made where it does not exist.
        header: what is evaluated, JSON-able; an interrupted evaluation is continued only under an equal header.
        restart: forget what an interrupted evaluation left.

    Raises:
        RecordError: another process writes here, the folder holds another unfinished evaluation, or a broken row.
    """

    def __init__(self, directory: str | Path, header: Mapping[str, JSON], restart: bool = False) -> None:
        self.directory = Path(directory)
        self._header: JSONObject = json.loads(json.dumps({"format": FORMAT, **header}))
        self.directory.mkdir(parents=True, exist_ok=True)
        self._lock = FolderLock(self.directory)
        if not self._lock.acquire():
            raise RecordError(f"{self.directory}: another evaluation writes here; wait for it or choose another --out")
        try:
            self.rows: dict[EpisodeId, JSONObject] = {} if restart else self._recover()
        except RecordError:
            self._lock.release()
            raise
        remove_parts(self.directory)
        remove_parts(self.directory / PARTIAL)
        if not self.rows:
            self._clear()
        write_text(self.directory / EVALUATION, _dump({**self._header, "finished": False}, indent=1))
        self._block: list[Played] = []
        self._block_started = time.monotonic()
        self._parts = len(list((self.directory / PARTIAL).glob("*.npz")))

    def __enter__(self) -> RecordWriter:
        return self

    def __exit__(self, *exception: object) -> None:
        try:
            self._flush()
        finally:
            self._lock.release()

    def add(self, played: Played) -> None:
        """Keep an episode; it is safe on disk once its block is full or old enough."""
        if not self._block:
            self._block_started = time.monotonic()
        self._block.append(played)
        if len(self._block) >= BLOCK_EPISODES or time.monotonic() - self._block_started > BLOCK_SECONDS:
            self._flush()

    def all_rows(self, order: Sequence[EpisodeId]) -> list[JSONObject]:
        """Rows of all episodes in this order, once each has been added."""
        self._flush()
        return [self.rows[episode] for episode in order]

    def finish(self, order: Sequence[EpisodeId], extra: Mapping[str, JSON]) -> Evaluation:
        """Put rows and trajectories in the order of the episode list and mark the evaluation finished.

        Args:
            order: (scene_id, episode_id) of every episode.
            extra: added to ``evaluation.json``: measures and the like.
        """
        rows = self.all_rows(order)
        stored: dict[EpisodeId, Trace] = {}
        for part in sorted((self.directory / PARTIAL).glob("*.npz")):
            stored.update(_read_traces(part))
        with atomic_path(self.directory / TRAJECTORIES) as temporary:
            _write_traces(temporary, {episode: stored[episode] for episode in order})
        write_text(self.directory / RECORDS, "".join(_dump(row) + "\n" for row in rows))
        header = {**self._header, **extra, "episodes": len(rows), "finished": True}
        write_text(self.directory / EVALUATION, _dump(header, indent=1))
        shutil.rmtree(self.directory / PARTIAL, ignore_errors=True)
        return Evaluation(self.directory, json.loads(_dump(header)), rows)

    def _flush(self) -> None:
        if not self._block:
            return
        part = self.directory / PARTIAL / f"{self._parts:06d}.npz"
        with atomic_path(part) as temporary:
            _write_traces(temporary, {_episode(played.row): played.trace for played in self._block})
        rows = [json.loads(_dump(played.row)) for played in self._block]
        with open(self.directory / RECORDS, "a", encoding="utf-8") as file:
            file.write("".join(_dump(row) + "\n" for row in rows))
            file.flush()
            os.fsync(file.fileno())
        self.rows.update({_episode(row): row for row in rows})
        self._parts += 1
        self._block = []

    def _recover(self) -> dict[EpisodeId, JSONObject]:
        """Rows that an interrupted evaluation left; a last row that was cut short is cut off the file."""
        if not (self.directory / EVALUATION).exists():
            return {}
        header = _read_header(self.directory)
        if header.pop("finished", False):
            return {}
        path = self.directory / RECORDS
        if not path.exists() or not path.stat().st_size:
            return {}  # it ended before anything was worth keeping
        if header != self._header:
            changed = sorted(k for k in {*header, *self._header} if header.get(k) != self._header.get(k))
            raise RecordError(
                f"{self.directory}: holds an unfinished evaluation with another {', '.join(changed)}; "
                "run that one to its end, give --restart to drop it, or choose another --out"
            )
        data = path.read_bytes()
        whole = data[: data.rfind(b"\n") + 1]
        rows = _parse_rows(path, whole)
        if len(whole) < len(data):
            with open(path, "r+b") as file:
                file.truncate(len(whole))
        return {_episode(row): row for row in rows}

    def _clear(self) -> None:
        for name in (RECORDS, TRAJECTORIES):
            (self.directory / name).unlink(missing_ok=True)
        shutil.rmtree(self.directory / PARTIAL, ignore_errors=True)


def load_evaluation(directory: str | Path) -> Evaluation:
    """Read a finished evaluation.

    Raises:
        RecordError: there is none, it is unfinished, broken, or of a newer format.
    """
    directory = Path(directory)
    header = _read_header(directory)
    if not header.get("finished"):
        raise RecordError(f"{directory}: the evaluation is unfinished; give the same prnav-eval command to resume it")
    path = directory / RECORDS
    try:
        rows = _parse_rows(path, read_regular(path))
    except OSError as error:
        raise RecordError(f"{path}: cannot be read ({error}); evaluate again with prnav-eval") from error
    if len(rows) != header.get("episodes"):
        raise RecordError(
            f"{path}: {len(rows)} rows where {EVALUATION} says {header.get('episodes')}; evaluate again with --restart"
        )
    return Evaluation(directory, header, rows)


def load_traces(evaluation: Evaluation) -> list[Trace]:
    """Traces of an evaluation, one per row.

    Raises:
        RecordError: the file is missing, broken, or of other episodes.
    """
    path = evaluation.directory / TRAJECTORIES
    stored = _read_traces(path)
    try:
        tracks = [stored[_episode(row)] for row in evaluation.rows]
    except KeyError as error:
        raise RecordError(f"{path}: lacks episode {error}; {_AGAIN}") from error
    for row, track in zip(evaluation.rows, tracks, strict=True):
        if "steps" in row and row["steps"] != len(track) * evaluation.header.get("action_repeat", 1):
            raise RecordError(
                f"{path}: episode {_episode(row)} has {len(track)} steps and {row['steps']:g} in {RECORDS}; {_AGAIN}"
            )
    return tracks


def is_finished(directory: str | Path) -> bool:
    """Whether the evaluation in this folder ran to its end.

    Raises:
        RecordError: there is none, or it cannot be read.
    """
    return bool(_read_header(Path(directory)).get("finished"))


def find_evaluations(run: str | Path) -> list[Path]:
    """Folders of evaluations in a run directory (or the folder itself, where it is one), by name."""
    run = Path(run)
    if (run / EVALUATION).exists():
        return [run]
    return sorted(path.parent for path in (run / "eval").glob(f"*/{EVALUATION}"))


def _episode(row: Mapping[str, JSON]) -> EpisodeId:
    return str(row["scene_id"]), str(row["episode_id"])


def _dump(value: Untyped, indent: int | None = None) -> str:
    return json.dumps(_plain(value), allow_nan=False, indent=indent)


def _plain(value: Untyped) -> Untyped:
    """The value in JSON's own types; infinity becomes null, NaN stays and is refused."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and math.isinf(value) else value


def _read_header(directory: Path) -> JSONObject:
    path = directory / EVALUATION
    header: JSONObject = read_json(path, HEADER, RecordError, "evaluate again with prnav-eval --restart")
    check_benchmark(header, path)
    if header["format"] > FORMAT:
        raise RecordError(f"{path}: format {header['format']} is newer than {FORMAT}, the newest known; update prnav")
    return header


def _parse_rows(path: Path, data: bytes) -> list[JSONObject]:
    rows = []
    for number, line in enumerate(data.splitlines(), start=1):
        try:
            rows.append(json.loads(line))
        except (ValueError, RecursionError) as error:
            raise RecordError(f"{path}: line {number} is not a record; {_AGAIN}") from error
    check_rows(rows, str(path), _AGAIN)
    return rows


def check_benchmark(header: Header, path: Path) -> None:
    """Hold a result to the benchmark of this version, where its task has one.

    Raises:
        RecordError: the result is of another version of it.
    """
    benchmark = header.get("benchmark")
    if not isinstance(benchmark, str):
        return
    try:
        current = task_spec(str(header.get("task", DEFAULT_TASK))).evaluation.current_benchmark(benchmark)
    except ConfigError as error:
        raise RecordError(f"{path}: {error}") from error
    if benchmark != current:
        raise RecordError(
            f"{path}: a result of benchmark {benchmark}, and this version of prnav has {current}; evaluate again, or "
            f"read it with prnav {header.get('version')}"
        )


def _write_traces(path: Path, traces: Mapping[EpisodeId, Trace]) -> None:
    """All arrays end to end: those of states have T + 1 rows an episode, those of steps T."""
    items = list(traces.values())
    arrays: dict[str, Array] = {
        "scene_id": np.array([scene for scene, _ in traces], dtype=np.str_),
        "episode_id": np.array([episode for _, episode in traces], dtype=np.str_),
        "steps": np.array([len(item) for item in items], dtype=np.int64),
    }
    for kind in ("states", "steps"):
        names = {"states": items[0].states, "steps": items[0].steps}[kind] if items else {}
        for name in names:
            arrays[name] = np.concatenate([item[name] for item in items])
    with open(path, "wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _read_traces(path: Path) -> dict[EpisodeId, Trace]:
    try:
        arrays = read_arrays(path)
        for name, like in TRACES.items():
            like.check(name, arrays[name])
        scenes, episodes, steps = (arrays.pop(name) for name in ("scene_id", "episode_id", "steps"))
        if len(steps) and not 0 <= int(steps.min()) <= int(steps.max()) <= len(arrays["actions"]):
            raise ValueError(f"'steps' are from {steps.min()} to {steps.max()}")
        ends = np.cumsum(steps)
        begins = ends - steps
        total, count = int(steps.sum()), len(steps)
        states = {name: values for name, values in arrays.items() if len(values) == total + count}
        events = {name: values for name, values in arrays.items() if len(values) == total}
        if len(states) + len(events) != len(arrays) or "actions" not in events:
            raise ValueError("arrays do not have a row for each step, or for each state")
        for name, values in arrays.items():
            if values.dtype.kind not in "fiub" or (values.dtype.kind == "f" and not np.isfinite(values).all()):
                raise ValueError(f"{name!r} holds what is no finite number")
        result = {}
        for i, (scene, episode) in enumerate(zip(scenes, episodes, strict=True)):
            a, b = int(begins[i]), int(ends[i])
            result[str(scene), str(episode)] = Trace(
                {name: values[a + i : b + i + 1] for name, values in states.items()},
                {name: values[a:b] for name, values in events.items()},
            )
    except BROKEN as error:
        raise RecordError(f"{path}: cannot be read ({error}); {_AGAIN}") from error
    return result
