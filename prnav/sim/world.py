"""The scenes that a run plays in, with their navigation meshes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from prnav.navmesh import NavMesh, NavMeshSet, NavMeshSettings, load_navmesh
from prnav.scene import SceneMesh, load_scene, resolve_scene

Progress = Callable[[int, int, str], None]
"""Called with the number of scenes done, of all scenes, and the id of the next one."""


@dataclass(frozen=True, eq=False)
class World:
    """Scenes by index; agents refer to them by that index."""

    scene_ids: tuple[str, ...]
    scenes: tuple[SceneMesh, ...]
    navmeshes: tuple[NavMesh, ...]

    @cached_property
    def navmesh_set(self) -> NavMeshSet:
        """All navigation meshes as one, for batched queries."""
        return NavMeshSet(self.navmeshes)

    @cached_property
    def index(self) -> dict[str, int]:
        """Index of each scene id."""
        return {scene_id: i for i, scene_id in enumerate(self.scene_ids)}


def load_world(
    scene_ids: Sequence[str],
    *,
    data_root: Path | None = None,
    scene_files: Sequence[Path] = (),
    up: str = "y",
    settings: NavMeshSettings = NavMeshSettings(),  # noqa: B008 (frozen)
    progress: Progress | None = None,
) -> World:
    """Load scenes (built-in ids, or files that :func:`prnav.scene.resolve_scene` finds) and their navmeshes.

    Raises:
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor to walk on.
    """
    scenes, navmeshes = [], []
    for done, scene_id in enumerate(scene_ids):
        if progress is not None:
            progress(done, len(scene_ids), scene_id)
        scene = load_scene(resolve_scene(scene_id, data_root, scene_files), up=up)
        scenes.append(scene)
        navmeshes.append(load_navmesh(scene, settings))
    if progress is not None:
        progress(len(scene_ids), len(scene_ids), "")
    return World(tuple(scene_ids), tuple(scenes), tuple(navmeshes))
