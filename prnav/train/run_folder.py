"""The run directory: ``config.toml``, ``run.json``, ``metrics.jsonl``, ``tb/``, ``checkpoints/``.

Config and facts are written before the first step. Metrics are one JSON object a line; when a run resumes, lines after
its checkpoint are dropped, so that the file reads as if the run had never stopped.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path

from prnav.aliases import JSON, JSONObject
from prnav.config import load_config, to_mapping, to_toml
from prnav.errors import CheckpointError, ConfigError
from prnav.files import read_regular, remove_parts, write_text
from prnav.locks import FolderLock
from prnav.schema import MapOf, Maybe, Number, Table, Text, fit
from prnav.train.checkpoint import list_checkpoints
from prnav.train.config import FREE_ON_RESUME, TrainConfig

_VALUES = MapOf(Maybe(Number(finite=False)))

METRICS = Table(
    needed={"step": Number(0, 1e18, whole=True)},
    allowed={"phase": Text(), "measures": _VALUES, "losses": _VALUES, "times": _VALUES, "validation": _VALUES},
)
"""A line of ``metrics.jsonl``."""


class RunFolder:
    """A run's files; held by one process at a time."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.config_path = path / "config.toml"
        self.facts_path = path / "run.json"
        self.metrics_path = path / "metrics.jsonl"
        self.tensorboard = path / "tb"
        self.checkpoints = path / "checkpoints"
        self._lock = FolderLock(path)

    def exists(self) -> bool:
        """Whether a run was started here, so far that it can be resumed: a start without a checkpoint is begun anew."""
        return self.config_path.exists() and (self.metrics_path.exists() or bool(list_checkpoints(self.checkpoints)))

    def load_config(self) -> TrainConfig:
        """The run's config.

        Raises:
            CheckpointError: no run was started here.
            ConfigError: its config cannot be read.
        """
        if not self.config_path.exists():
            raise CheckpointError(f"run {self.path}: there is no config.toml; give the folder of a run (--run DIR)")
        return load_config(TrainConfig, self.config_path)

    def start(self, config: TrainConfig, facts: Mapping[str, JSON]) -> None:
        """Make the folder and write what is known before the first step.

        Raises:
            ConfigError: a run was started here before.
        """
        if self.exists():
            raise ConfigError(
                f"run {self.path} exists already; resume it with --resume, or choose another folder with --run DIR"
            )
        self.checkpoints.mkdir(parents=True, exist_ok=True)
        write_text(self.facts_path, json.dumps(facts, indent=2) + "\n")
        write_text(self.config_path, to_toml(config))

    def check_resumable(self, config: TrainConfig) -> None:
        """Hold a resumed run to the config it was started with.

        Raises:
            ConfigError: a key differs that may not change within a run.
        """
        before, now = _flat(to_mapping(self.load_config())), _flat(to_mapping(config))
        for key in sorted(before.keys() | now.keys()):
            if key not in FREE_ON_RESUME and before.get(key) != now.get(key):
                raise ConfigError(
                    f"run {self.path}: {key} is {before.get(key)!r} in its config.toml and {now.get(key)!r} now; a "
                    f"resumed run may only change {', '.join(sorted(FREE_ON_RESUME))}; start another with --run DIR"
                )

    def acquire(self) -> None:
        """Hold the folder against other processes until :meth:`release` or the process's end.

        Raises:
            ConfigError: another process trains here.
        """
        if not self._lock.acquire():
            raise ConfigError(
                f"run {self.path} is being trained by another process; wait for it, or choose another --run DIR"
            )
        remove_parts(self.path)

    def release(self) -> None:
        """Let other processes have the folder."""
        self._lock.release()

    def append_metrics(self, row: Mapping[str, JSON]) -> None:
        """Add one line of metrics, whole or not at all.

        Raises:
            OSError: it cannot be written.
        """
        with open(self.metrics_path, "ab") as file:
            before = file.tell()
            try:
                file.write(json.dumps(row).encode() + b"\n")
                file.flush()
            except OSError:
                os.truncate(self.metrics_path, before)
                raise

    def cut_metrics(self, step: int) -> None:
        """Drop metrics of later steps, and a last line that was not written to its end."""
        if not self.metrics_path.exists():
            return
        kept = []
        text = read_regular(self.metrics_path).decode("utf-8", errors="replace")
        for number, line in enumerate(text.split("\n")[:-1], start=1):
            try:
                row = json.loads(line)
            except (ValueError, RecursionError):
                break  # the process was killed while it wrote this line
            where = f"{self.metrics_path}: line {number}"
            if fit(row, METRICS, CheckpointError, where, "restore the file, or delete it")["step"] <= step:
                kept.append(line + "\n")
        if "".join(kept) != text:
            write_text(self.metrics_path, "".join(kept))


def read_metrics(folder: Path) -> list[JSONObject]:
    """All rows of a run's ``metrics.jsonl``."""
    return [json.loads(line) for line in (folder / "metrics.jsonl").read_text(encoding="utf-8").splitlines()]


def _flat(values: Mapping[str, JSON], prefix: str = "") -> JSONObject:
    result: JSONObject = {}
    for key, value in values.items():
        if isinstance(value, dict):
            result |= _flat(value, f"{prefix}{key}.")
        else:
            result[prefix + key] = value
    return result
