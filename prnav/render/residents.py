"""Scenes prepared for an engine: made when first needed or ahead in the background, held up to a memory budget."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from prnav.aliases import Progress
from prnav.errors import PrnavError

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

GIGABYTE = 1e9


class Prepared(Protocol):
    """What an engine keeps of a scene."""

    @property
    def nbytes(self) -> int:
        """Memory [bytes]."""
        ...


T = TypeVar("T", bound=Prepared)


class Residents(Generic[T]):
    """Prepared scenes by index. What one request needs is held together, whatever the budget.

    Over budget, scenes leave in the order of their last use. A request that finds a scene gone makes it anew, so a
    budget costs time and never changes a result. Safe to use from several threads.
    """

    def __init__(
        self,
        scenes: Sequence[SceneMesh],
        prepare: Callable[[SceneMesh], T],
        budget: float,
        evicted: Callable[[int], None] = lambda scene: None,
    ) -> None:
        """Empty; ``budget`` in bytes, ``evicted`` is told the index of a scene before its memory goes."""
        self._scenes = scenes
        self._prepare = prepare
        self._budget = budget
        self._evicted = evicted
        self._held: OrderedDict[int, T] = OrderedDict()
        self._bytes = 0
        self._lock = threading.RLock()
        self._stop = threading.Event()

    @property
    def nbytes(self) -> int:
        """Memory of all held scenes [bytes]."""
        with self._lock:
            return self._bytes

    @property
    def held(self) -> tuple[int, ...]:
        """Indices of held scenes, the least recently used first."""
        with self._lock:
            return tuple(self._held)

    def items(self) -> dict[int, T]:
        """Held scenes by index."""
        with self._lock:
            return dict(self._held)

    def get(self, needed: Iterable[int]) -> dict[int, T]:
        """The prepared scenes that a request needs, by index."""
        with self._lock:
            found: dict[int, T] = {}
            for scene in needed:
                if scene not in self._held:
                    self._hold(scene, self._prepare(self._scenes[scene]))
                self._held.move_to_end(scene)
                found[scene] = self._held[scene]
                self._make_room(len(found))
            return found

    def preload(self, progress: Progress | None = None) -> threading.Thread:
        """Prepare all scenes in order in a thread of its own until the budget is full; returns the running thread.

        Requests go on meanwhile. ``progress`` is called in that thread. A scene that cannot be prepared is left to the
        request that needs it, which then raises the error.
        """
        thread = threading.Thread(target=self._preload, args=(progress,), name="prnav-scenes", daemon=True)
        thread.start()
        return thread

    def close(self) -> None:
        """End a preload after its current scene."""
        self._stop.set()

    def _preload(self, progress: Progress | None) -> None:
        total = len(self._scenes)
        for scene in range(total):
            if self._stop.is_set():
                return
            if scene in self.held:
                continue
            try:
                mesh = self._scenes[scene]
                if progress is not None:
                    progress(scene, total, mesh.name)
                item = self._prepare(mesh)  # requests go on meanwhile; one that needs this scene makes it too
            except PrnavError:
                continue  # raised again where it is asked for
            with self._lock:
                if scene in self._held:
                    continue
                if self.nbytes + item.nbytes > self._budget:
                    return
                self._hold(scene, item)
                self._held.move_to_end(scene, last=False)  # not used yet: the first to go
        if progress is not None:
            progress(total, total, "")

    def _make_room(self, needed: int) -> None:
        """Let go of what was used longest ago, but of none of the ``needed`` used last."""
        while self._bytes > self._budget and len(self._held) > needed:
            scene = next(iter(self._held))
            self._evicted(scene)
            self._bytes -= self._held.pop(scene).nbytes

    def _hold(self, scene: int, item: T) -> None:
        self._held[scene] = item
        self._bytes += item.nbytes
