"""Navigation meshes: built from a scene or read from Habitat's files, then asked for moves and shortest paths.

A chapter in four parts, to be read in this order; ``docs/navmesh.md`` is its introduction.

1. Making polygons: :mod:`.settings`, :mod:`.build`, then its stages :mod:`.heightfield`, :mod:`.compact`,
   :mod:`.regions`, :mod:`.contours`, :mod:`.triangles`, :mod:`.polygons`, :mod:`.detail` (with :mod:`.delaunay`).
2. Files: :mod:`.polymesh`, :mod:`.detour_format`, :mod:`.detour`, :mod:`.stitch`, :mod:`.detour_write`.
3. Compiled queries: :mod:`.planar` (tolerances), :mod:`.surface` (arrays), :mod:`.boxes`, :mod:`.locate`, :mod:`.step`,
   :mod:`.geodesic`, :mod:`.windows`.
4. What users call: :mod:`.queries`, :mod:`.pairs`, :mod:`.navmesh`, :mod:`.navmesh_set`, :mod:`.goal_fields`.
"""

from prnav.navmesh.beside import scene_navmesh
from prnav.navmesh.goal_fields import GoalFields
from prnav.navmesh.navmesh import BUILDER_VERSION, FloorPoints, Island, NavMesh, load_navmesh
from prnav.navmesh.navmesh_set import NavMeshSet
from prnav.navmesh.polymesh import PolyMesh
from prnav.navmesh.settings import NavMeshSettings

__all__ = [
    "BUILDER_VERSION",
    "FloorPoints",
    "GoalFields",
    "Island",
    "NavMesh",
    "NavMeshSet",
    "NavMeshSettings",
    "PolyMesh",
    "load_navmesh",
    "scene_navmesh",
]
