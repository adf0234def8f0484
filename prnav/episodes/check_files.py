"""One pass over a folder: which scenes, navmeshes, episode files and configs work, and why the others do not.

Each file is read by a worker process (:mod:`.check_worker`) that has a memory limit and a time limit, so that no file
can bring down the pass: not one that lies about its size, not one that a decoder of compressed data crashes on.
"""

from __future__ import annotations

import json
import os
import queue
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from prnav.aliases import JSONObject
from prnav.errors import SceneError
from prnav.processes import deaf_children
from prnav.scene.datasets import LAYOUTS, data_folder, open_scene_set
from prnav.scene.habitat_configs import DATASET_SUFFIX, OBJECT_SUFFIX, SCENE_SUFFIX, STAGE_SUFFIX
from prnav.scene.source import SUFFIXES as MESH_SUFFIXES

Kind = Literal["scene", "navmesh", "episodes", "config"]

CONFIG_SUFFIXES = (DATASET_SUFFIX, OBJECT_SUFFIX, SCENE_SUFFIX, STAGE_SUFFIX)

_TILE_MAGICS = (b"TESM", b"VAND", b"TESX")
_PEEK = 1 << 16


@dataclass(frozen=True)
class FileCheck:
    """One thing to try.

    Attributes:
        kind: what it is taken for.
        path: the file.
        scene_id: of a data set's scene, which is tried with its configs, objects and navmesh.
    """

    kind: Kind
    path: Path
    scene_id: str | None = None


@dataclass(frozen=True)
class Report:
    """What became of one file."""

    kind: Kind
    path: str  #: relative to the folder
    problem: str | None  #: why it does not work; None where it does
    notes: tuple[str, ...] = ()  #: what else is worth knowing, the warnings among it
    warnings: tuple[str, ...] = ()  #: what was not found, left out, or looks wrong
    seconds: float = 0.0

    def to_record(self) -> JSONObject:
        """JSON object."""
        return asdict(self) | {"status": "good" if self.problem is None else "broken"}


@dataclass(frozen=True)
class CheckLimits:
    """What one file may take."""

    seconds: float = 300.0
    memory_gb: float = 4.0
    workers: int = 1
    root: str | None = None  #: folder that pictures of meshes may be in, above their own

    def __post_init__(self) -> None:
        if self.seconds <= 0 or self.memory_gb < 0.5 or self.workers < 1:
            raise SceneError(
                f"limits of {self.seconds} s, {self.memory_gb} GB and {self.workers} workers; valid: more than 0 s, at "
                "least 0.5 GB, at least 1 worker"
            )


def find_tasks(folder: str | Path, data: str | None = None) -> list[FileCheck]:
    """All files of a folder that prnav might be given, in order of their paths.

    Args:
        folder: searched with all its subfolders, links to folders left aside; with ``data`` it is the data root.
        data: only the scenes and episodes of this data set, each scene with its configs, objects and navmesh.

    Raises:
        SceneError: no such folder, or nothing to check in it.
    """
    root = Path(folder)
    if not root.is_dir():
        raise SceneError(f"{root}: no such folder; name a folder with scenes, navmeshes or episode files")
    if data is not None:
        return _data_tasks(root, data)
    tasks = []
    for base, folders, names in os.walk(root):
        folders.sort()
        for name in sorted(names):
            path = Path(base) / name
            kind = kind_of(path)
            if kind is not None:
                tasks.append(FileCheck(kind, path))
    if not tasks:
        raise SceneError(f"{root}: nothing to check; looked for {', '.join(MESH_SUFFIXES)}, .navmesh and .json.gz")
    return tasks


def kind_of(path: Path) -> Kind | None:
    """What a file is taken for by its name, and by its first bytes where names are shared; None for anything else."""
    name = path.name.lower()
    if name.endswith(MESH_SUFFIXES):
        return "scene"
    if name.endswith(".navmesh"):
        return "navmesh"
    if name.endswith(CONFIG_SUFFIXES):
        return "config"
    if name.endswith(".json.gz"):
        return "episodes"
    if name.endswith((".json", ".bin")) and path.is_file():
        try:
            with open(path, "rb") as file:
                start = file.read(_PEEK)
        except OSError:
            return None
        if name.endswith(".bin"):
            return "navmesh" if start[:4] in _TILE_MAGICS or b"VAND" in start[:128] else None
        return "episodes" if b'"episodes"' in start else None
    return None


def _data_tasks(root: Path, data: str) -> list[FileCheck]:
    scenes = open_scene_set(data, root)
    tasks = [FileCheck("scene", scenes.files[scene_id], scene_id) for scene_id in scenes.scene_ids()]
    base = data_folder(root) / "datasets" / "pointnav"
    for alias in LAYOUTS[data].episodes:
        tasks += [FileCheck("episodes", path) for path in sorted((base / alias).rglob("*.json.gz"))]
    return tasks


def check_tasks(
    tasks: Sequence[FileCheck],
    folder: str | Path,
    data: str | None = None,
    limits: CheckLimits = CheckLimits(),  # noqa: B008 (frozen)
    progress: Callable[[Report], object] = lambda report: None,
) -> list[Report]:
    """Try every task; reports stand in the order of the tasks.

    Args:
        tasks: from :func:`find_tasks`.
        folder: as given there.
        data: as given there.
        limits: of each file.
        progress: called with each report as it comes.
    """
    todo: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number in range(len(tasks)):
        todo.put(number)
    reports: dict[int, Report] = {}
    lock = threading.Lock()

    def work() -> None:
        worker = _Worker(Path(folder), data, limits)
        try:
            while True:
                try:
                    number = todo.get_nowait()
                except queue.Empty:
                    return
                report = worker.run(tasks[number])
                with lock:
                    reports[number] = report
                    progress(report)
        finally:
            worker.close()

    threads = [threading.Thread(target=work, daemon=True) for _ in range(min(limits.workers, max(1, len(tasks))))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [reports[number] for number in range(len(tasks))]


class _Worker:
    """A process that reads files; a new one is started where it dies or takes too long."""

    def __init__(self, folder: Path, data: str | None, limits: CheckLimits) -> None:
        self.folder, self.data, self.limits = folder, data, limits
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, task: FileCheck) -> Report:
        start = time.monotonic()
        request = {"kind": task.kind, "path": str(task.path), "scene_id": task.scene_id, "root": self.limits.root}
        answer = self._ask(json.dumps(request).encode() + b"\n")
        relative = os.path.relpath(task.path, self.folder)
        problem, notes, warnings = answer.get("problem"), tuple(answer.get("notes", ())), answer.get("warnings", ())
        if problem is not None:
            problem = _short(problem, task.path)
        return Report(task.kind, relative, problem, notes, tuple(warnings), round(time.monotonic() - start, 3))

    def _ask(self, request: bytes) -> JSONObject:
        if self._process is None or self._process.poll() is not None:
            self._process = self._start()
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(request)
            process.stdin.flush()
        except BrokenPipeError:
            return self._died(process)
        end = time.monotonic() + self.limits.seconds
        line = b""
        while not line.endswith(b"\n"):
            ready, _, _ = select.select([process.stdout], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                self.close()
                return {"problem": f"not read within {self.limits.seconds:g} s; simplify it, or allow more (--timeout)"}
            part = os.read(process.stdout.fileno(), 1 << 16)
            if not part:
                return self._died(process)
            line += part
        answer = json.loads(line)
        assert isinstance(answer, dict)
        return answer

    def _died(self, process: subprocess.Popen[bytes]) -> JSONObject:
        status = process.wait()
        self._process = None
        name = signal.Signals(-status).name if status < 0 else f"status {status}"
        return {"problem": f"its reader was ended by {name}: the file is damaged, or needs more memory than there is"}

    def _start(self) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "prnav.episodes.check_worker", str(self.folder), self.data or ""]
        command.append(str(int(self.limits.memory_gb * 2**30)))
        with deaf_children():
            return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def close(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def _short(problem: str, path: Path) -> str:
    """A message without the name of the file that it stands beside."""
    text = " ".join(problem.split())
    for start in (f"scene {path}: ", f"navmesh {path}: ", f"config {path}: ", f"{path}: "):
        text = text.removeprefix(start)
    return text
