"""The navmesh that lies beside a scene, or a new one where there is none."""

from __future__ import annotations

from prnav.errors import NavMeshError
from prnav.navmesh.fit import check_fit
from prnav.navmesh.navmesh import NavMesh, load_navmesh
from prnav.navmesh.settings import NavMeshSettings
from prnav.scene import SceneFile, SceneMesh

FROM_FILE, BUILT = "file", "built"


def scene_navmesh(
    place: SceneFile, scene: SceneMesh, settings: NavMeshSettings, use_files: bool = True
) -> tuple[NavMesh, str]:
    """Navmesh of a data set's scene, and where it is from: ``file NAME`` or ``built``.

    A file counts as it is, with its own settings, since episodes of its data set were drawn on it.

    Args:
        place: the scene on disk.
        scene: its mesh.
        settings: what to build a navmesh for where there is no file.
        use_files: False builds one in any case.

    Raises:
        NavMeshError: the file is broken or does not lie on the scene's floors, or the scene has none.
    """
    origin = navmesh_origin(place, use_files)
    if place.navmesh is None or not use_files:
        return load_navmesh(scene, settings), origin
    try:
        navmesh = NavMesh.load(place.navmesh)
    except NavMeshError as error:
        raise NavMeshError(f"{error}; fetch it again, or build navmeshes instead (navmesh_files=false)") from error
    check_fit(navmesh, scene, place.navmesh.name)
    return navmesh, origin


def navmesh_origin(place: SceneFile, use_files: bool = True) -> str:
    """Where :func:`scene_navmesh` takes the navmesh of a scene from: ``file NAME`` or ``built``."""
    return BUILT if place.navmesh is None or not use_files else f"{FROM_FILE} {place.navmesh.name}"
