"""Episodes of many scenes: drawn by several processes, a file per scene, taken up again where they were interrupted.

The layout is Habitat's: ``content/SCENE.json.gz`` per scene, and beside it the split file, which is written last. Each
scene's file is written whole or not at all and says in its header what it was drawn from, so that a run that ends
early, however it ends, keeps the scenes that are done, and the next one draws the others. What a file holds does not
depend on how many processes there are. A process has one scene and a few thousand episodes in memory.

What comes before: :mod:`.generate` (one scene), :mod:`.files` (the layout).
"""

from __future__ import annotations

import dataclasses
import glob
import multiprocessing
import queue
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from prnav.aliases import JSONObject, Untyped
from prnav.episodes.builtin import make_header
from prnav.episodes.files import content_names, read_header, write_episode_stream
from prnav.episodes.generate import GenerationConfig, generate_chunks
from prnav.errors import EpisodeError, PrnavError
from prnav.locks import held_folder
from prnav.navmesh import BUILDER_VERSION, NavMeshSettings, load_navmesh, scene_navmesh
from prnav.navmesh.beside import BUILT, navmesh_origin
from prnav.navmesh.cover import indoor_floors
from prnav.processes import deaf_children, end_processes, worker_process
from prnav.resources import available_cores
from prnav.scene import SceneFile, load_scene
from prnav.scene.library import is_built_in

SceneProgress = Callable[[str, int], object]
"""Called with a scene's id and how many more of its episodes are there."""


@dataclass(frozen=True)
class BulkConfig:
    """What to draw in each scene."""

    per_scene: int  #: episodes
    seed: int = 0
    up: str = "y"  #: up axis of mesh files
    data: str | None = None  #: data set that the scenes belong to
    navmesh_files: bool = True  #: take the navmesh beside a data set's scene where there is one
    navmesh: NavMeshSettings = NavMeshSettings()
    limits: GenerationConfig = GenerationConfig()
    root: str | None = None  #: folder that pictures of mesh files may be in


class Written(NamedTuple):
    """What :func:`generate_files` did."""

    kept: int  #: scenes that were there already
    origins: dict[str, str]  #: per scene id, where its navmesh is from: "built", or "file NAME"


def generate_files(
    sources: Mapping[str, Source],
    path: Path,
    config: BulkConfig,
    workers: int | None = None,
    progress: SceneProgress | None = None,
) -> Written:
    """Write a data set of several scenes in Habitat's ``content/`` layout; scenes that are there already are kept.

    Args:
        sources: per scene id, the mesh file, the built-in home or the scene of a data set.
        path: the split file.
        config: what to draw.
        workers: processes; by default one per core that this process may use.
        progress: called as episodes are written.

    Raises:
        PrnavError: a scene cannot be read, or has no episodes.
        EpisodeError: a process was killed, or another one writes to the same folder.
    """
    taken = f"{path.parent}: another process draws episodes here; wait for it, or choose another --out or --split"
    with held_folder(path.parent, EpisodeError, taken):
        return _generate_files(sources, path, config, workers, progress)


def _generate_files(
    sources: Mapping[str, Source],
    path: Path,
    config: BulkConfig,
    workers: int | None,
    progress: SceneProgress | None,
) -> Written:
    content = path.parent / "content"
    alone = len(sources) == 1
    files = {scene_id: content / f"{name}.json.gz" for scene_id, name in content_names(sources).items()}
    if alone:
        files = dict.fromkeys(sources, path)
    else:
        path.unlink(missing_ok=True)  # a data set is there when its split file is
    _remove_parts(files.values())
    jobs = [(scene_id, source, files[scene_id]) for scene_id, source in sources.items()]
    origins = {scene_id: _origin(source, config) for scene_id, source in sources.items()}
    hashes: dict[str, str] = {}
    kept: list[str] = []

    def note(kind: str, scene_id: str, value: Untyped) -> None:
        if kind == "done":
            hashes[scene_id] = value
            return
        if kind == "kept":
            kept.append(scene_id)
        if progress is not None:
            progress(scene_id, value)

    count = min(len(jobs), workers or available_cores())
    try:
        if count == 1:
            for job in jobs:
                _draw(job, config, note)
        else:
            _share(jobs, config, count, note)
    finally:
        _remove_parts(files.values())
    if not alone:
        write_episode_stream(path, _header(config, {name: hashes[name] for name in sources}, origins), ())
    return Written(len(kept), origins)


Source = str | SceneFile
"""A mesh file, a built-in home, or a scene of a data set."""

Job = tuple[str, Source, Path]
"""Id, source and file of a scene."""

Note = Callable[[str, str, Untyped], object]
"""Called with ``drawn`` or ``kept``, a scene's id and a number of episodes; with ``done``, the id and the hash."""


def _draw(job: Job, config: BulkConfig, note: Note) -> None:
    """Write one scene's file, unless it is there."""
    scene_id, source, file = job
    scene = load_scene(source, config.up, root=config.root)
    header = _header(config, {scene_id: scene.hash}, {scene_id: _origin(source, config)})
    header["prnav"] |= {"builder": BUILDER_VERSION, "per_scene": config.per_scene}
    header["prnav"]["limits"] = dataclasses.asdict(config.limits)
    if read_header(file) == header:
        note("kept", scene_id, config.per_scene)
    else:
        if isinstance(source, SceneFile):
            navmesh, _ = scene_navmesh(source, scene, config.navmesh, config.navmesh_files)
        else:
            navmesh = load_navmesh(scene, config.navmesh)
        built_in = isinstance(source, str) and is_built_in(source)
        floors = None if built_in or config.limits.roofs else indoor_floors(navmesh, scene)

        def records() -> Iterator[str]:
            for table in generate_chunks(navmesh, scene_id, config.per_scene, config.seed, config.limits, floors):
                yield from table.to_json()
                note("drawn", scene_id, len(table))

        write_episode_stream(file, header, records())
    note("done", scene_id, scene.hash)


def _origin(source: Source, config: BulkConfig) -> str:
    return navmesh_origin(source, config.navmesh_files) if isinstance(source, SceneFile) else BUILT


def _header(config: BulkConfig, hashes: Mapping[str, str], origins: Mapping[str, str]) -> JSONObject:
    """Header of a file with these scenes' episodes."""
    header = make_header(config.navmesh, config.up, config.seed, dict(hashes))
    if config.data is not None:
        header["prnav"] |= {"data": config.data, "navmeshes": dict(origins)}
    return header


def _share(jobs: Sequence[Job], config: BulkConfig, workers: int, note: Note) -> None:
    """Have worker processes take the jobs one by one, and pass on what they say."""
    context = multiprocessing.get_context("spawn")
    messages, following = context.Queue(), context.Value("q", 0)
    processes = [worker_process(context, _worker, jobs, config, messages, following) for _ in range(workers)]
    done = 0
    try:
        with deaf_children():
            for process in processes:
                process.start()
        while done < len(jobs):
            try:
                kind, scene_id, value = messages.get(timeout=1.0)
            except queue.Empty:
                dead = [process for process in processes if process.exitcode not in (None, 0)]
                if dead:
                    raise EpisodeError(
                        f"a process that draws episodes ended with status {dead[0].exitcode} (killed, or out of "
                        "memory); run the same command again, scenes that are done are kept"
                    ) from None
                continue
            if kind == "error":
                raise value
            done += kind == "done"
            note(kind, scene_id, value)
    finally:
        end_processes(processes)


def _worker(jobs: Sequence[Job], config: BulkConfig, messages: Untyped, following: Untyped) -> None:
    """Take jobs until there are no more."""

    def note(kind: str, scene_id: str, value: Untyped) -> None:
        messages.put((kind, scene_id, value))

    while True:
        with following.get_lock():
            number = following.value
            following.value += 1
        if number >= len(jobs):
            return
        try:
            _draw(jobs[number], config, note)
        except PrnavError as error:
            messages.put(("error", jobs[number][0], type(error)(str(error))))
            return


def _remove_parts(files: Iterable[Path]) -> None:
    """Remove what an interrupted run has left of files that it did not finish."""
    for file in files:
        for part in file.parent.glob(f".{glob.escape(file.name)}.*.tmp*"):
            part.unlink(missing_ok=True)
