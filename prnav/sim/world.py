"""The scenes that a run plays in, with their navigation meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from prnav.aliases import Progress, Untyped
from prnav.navmesh import NavMesh, NavMeshSet, NavMeshSettings, load_navmesh, scene_navmesh
from prnav.scene import SceneMesh, load_scene, open_scene_set, resolve_scene
from prnav.scene.library import is_built_in
from prnav.scene.texture_budget import TextureLimits


@dataclass(frozen=True, eq=False)
class World:
    """Scenes by index; agents refer to them by that index."""

    scene_ids: tuple[str, ...]
    scenes: tuple[SceneMesh, ...]
    navmeshes: tuple[NavMesh, ...]
    navmesh_origins: tuple[str, ...] = ()
    """Where each navmesh is from: "built", or "file NAME"."""

    def __deepcopy__(self, memo: dict[int, Untyped]) -> World:
        """Nothing in it ever changes: copies share it."""
        return self

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
    data: str | None = None,
    navmesh_files: bool = True,
    limits: TextureLimits = TextureLimits(),  # noqa: B008 (frozen)
) -> World:
    """Load scenes (built-in ids, or files that :func:`prnav.scene.resolve_scene` finds) and their navmeshes.

    Args:
        scene_ids: which ones.
        data_root: folder under which they are.
        scene_files: mesh files that ids may mean.
        up: up axis of mesh files.
        settings: of navmeshes that are built.
        progress: called before each scene.
        data: the data set under ``data_root`` that the scenes belong to; it knows their frames and navmeshes.
        navmesh_files: whether the navmeshes of a data set count; False builds them anew.
        limits: of the textures of files.

    Raises:
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor to walk on.
    """
    scenes, navmeshes, origins = [], [], []
    scene_set = None if data is None else open_scene_set(data, data_root if data_root is not None else Path())
    for done, scene_id in enumerate(scene_ids):
        if progress is not None:
            progress(done, len(scene_ids), scene_id)
        if scene_set is None or is_built_in(scene_id):
            found = resolve_scene(scene_id, data_root, scene_files, only=len(scene_ids) == 1)
            scene = load_scene(found, up, limits.max_texture_size, limits.texture_budget, data_root)
            navmesh, origin = load_navmesh(scene, settings), "built"
        else:
            place = scene_set.scene(scene_id)
            scene = load_scene(place, up, limits.max_texture_size, limits.texture_budget)
            navmesh, origin = scene_navmesh(place, scene, settings, navmesh_files)
        scenes.append(scene)
        navmeshes.append(navmesh)
        origins.append(origin)
    if progress is not None:
        progress(len(scene_ids), len(scene_ids), "")
    return World(tuple(scene_ids), tuple(scenes), tuple(navmeshes), tuple(origins))
