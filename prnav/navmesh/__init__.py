"""Navigation meshes: built from a scene or read from Habitat's files, then asked for moves and shortest paths.

Read in this order: :mod:`.settings`, :mod:`.polymesh`, :mod:`.build` (mesh to polygons), :mod:`.surface` (polygons to
query arrays), :mod:`.locate`, :mod:`.step`, :mod:`.geodesic` (the compiled queries), :mod:`.navmesh` (what users call).
"""

from prnav.navmesh.beside import scene_navmesh
from prnav.navmesh.goal_fields import GoalFields
from prnav.navmesh.navmesh import Island, NavMesh, load_navmesh
from prnav.navmesh.navmesh_set import NavMeshSet
from prnav.navmesh.polymesh import PolyMesh
from prnav.navmesh.settings import NavMeshSettings

__all__ = [
    "GoalFields",
    "Island",
    "NavMesh",
    "NavMeshSet",
    "NavMeshSettings",
    "PolyMesh",
    "load_navmesh",
    "scene_navmesh",
]
