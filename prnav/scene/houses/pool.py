"""Built-in homes made by several processes at once, into the cache."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

from prnav.errors import SceneError
from prnav.processes import become_worker, deaf_children, end_processes
from prnav.resources import available_cores
from prnav.scene.houses.manifest import HomeHashes
from prnav.scene.library import load_scene, missing_homes


def make_homes(names: Sequence[str], workers: int) -> Iterator[tuple[str, HomeHashes]]:
    """Make homes that are not in the cache yet, and yield each one's hashes as it is done, in no fixed order.

    Every home is written at once or not at all: a run that was stopped goes on where it was, and two runs at the same
    time do work twice, but no harm.
    """
    if workers <= 1 or len(names) <= 1:
        for name in names:
            yield name, _make(name)
        return
    context = multiprocessing.get_context("spawn")  # forking is unsafe where a library has started threads
    count = min(workers, len(names))
    with ProcessPoolExecutor(count, mp_context=context, initializer=become_worker) as pool:
        tasks: dict[Future[HomeHashes], str] = {}
        try:
            with deaf_children():
                tasks = {pool.submit(_make, name): name for name in names}
            for task in as_completed(tasks):
                yield tasks[task], task.result()
        except BrokenProcessPool as error:
            raise SceneError(
                "a process that makes homes was killed, or ran out of memory; give the same command again: homes that "
                "are made are kept"
            ) from error
        except BaseException:
            end_processes(list(pool._processes.values()))  # what they are at would take seconds
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def make_missing_homes(scene_ids: Sequence[str], progress: Callable[[int, int, str], object] | None = None) -> None:
    """Make the built-in homes that are wanted and not in the cache, on all cores.

    Args:
        scene_ids: scenes that are about to be loaded.
        progress: called with how many are done, of how many, and the name of the last one.
    """
    missing = missing_homes(scene_ids)
    for done, (name, _) in enumerate(make_homes(missing, available_cores()), start=1):
        if progress is not None:
            progress(done, len(missing), name)


def _make(name: str) -> HomeHashes:
    return HomeHashes.of(load_scene(name))
