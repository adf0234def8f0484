"""From a mesh to its navigation polygons, by the steps of Recast and with Habitat-sim's settings.

    triangles -> solid spans -> floor cells -> eroded by the radius -> regions -> contours -> convex polygons -> detail

Habitat-sim builds its navigation meshes with the library Recast; these modules follow the same steps with the same
meaning of every setting, so that areas, islands and distances agree. References: M. Mononen, Recast Navigation
(https://recastnav.com); D. Haumont et al., "Volumetric cell-and-portal generation", 2003 (the watershed).

Before: a scene's mesh, :mod:`.settings`. After: :mod:`.heightfield`, its first stage; :mod:`.polymesh`, its result.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import NavMeshError
from prnav.navmesh import compact, detail, heightfield
from prnav.navmesh.contours import region_contours
from prnav.navmesh.extent import check_extent
from prnav.navmesh.polygons import GridPolygons, convex_polygons
from prnav.navmesh.polymesh import FLAG_WALK, PolyMesh
from prnav.navmesh.regions import watershed_regions
from prnav.navmesh.settings import NavMeshSettings


def build_polygons(vertices: ArrayLike, faces: ArrayLike, settings: NavMeshSettings | None = None) -> PolyMesh:
    """Walkable polygons of a mesh.

    Args:
        vertices: Positions, shape (V, 3) [m], y up.
        faces: Vertex indices of triangles, shape (F, 3), counter-clockwise seen from their front.
        settings: Body and fineness; Habitat-sim's defaults if None.

    Returns:
        The polygons; none where no floor can be walked.

    Raises:
        NavMeshError: arrays of a wrong shape, vertices that are not finite, indices out of range, or a mesh too large
            for the cell size.
    """
    settings = settings or NavMeshSettings()
    points, triangles = _checked_mesh(vertices, faces)
    if len(triangles) == 0:
        return PolyMesh.empty(np.zeros((2, 3)))
    used = points[triangles.reshape(-1)]
    bounds = np.stack([used.min(axis=0), used.max(axis=0)])
    del used
    check_extent(points, triangles, bounds, settings)
    width, depth = heightfield.grid_size(bounds, settings.cell_size)
    if width == 0 or depth == 0:
        return PolyMesh.empty(bounds.astype(np.float64))
    field = floor_cells(points, triangles, bounds, settings)
    distance, largest = compact.border_distance(field.connected, field.area)
    region, num_regions = watershed_regions(
        field, distance, largest, int(settings.region_min_size**2), int(settings.region_merge_size**2)
    )
    del distance
    max_edge_length = int(np.float32(settings.edge_max_len) / np.float32(settings.cell_size))
    contours = region_contours(field, region, settings.edge_max_error, max_edge_length)
    polygons = convex_polygons(contours, num_regions, int(settings.verts_per_poly))
    return _poly_mesh(polygons, field, region, bounds, settings)


def floor_cells(
    vertices: NDArray[np.float32], faces: NDArray[np.int32], bounds: NDArray[np.float32], settings: NavMeshSettings
) -> compact.CompactField:
    """Floor cells of a mesh, eroded by the body's radius."""
    height, climb = settings.walkable_height, settings.walkable_climb
    solid = heightfield.solid_spans(
        vertices, faces, bounds, settings.cell_size, settings.cell_height, settings.agent_max_slope, climb
    )
    if settings.filter_low_hanging_obstacles:
        heightfield.filter_low_obstacles(solid.start, solid.top, solid.walkable, climb)
    if settings.filter_ledge_spans:
        heightfield.filter_ledges(*solid, height, climb)
    if settings.filter_walkable_low_height_spans:
        heightfield.filter_low_ceilings(solid.start, solid.bottom, solid.top, solid.walkable, height)
    field = compact.compact_field(solid, height, climb)
    compact.erode(field.connected, field.area, settings.walkable_radius)
    return field


def _checked_mesh(vertices: ArrayLike, faces: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    points = np.ascontiguousarray(vertices, np.float32)
    indices = np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3:
        raise NavMeshError(f"navmesh: vertices have shape {points.shape}; they must have shape (V, 3)")
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise NavMeshError(f"navmesh: faces have shape {indices.shape}; they must have shape (F, 3)")
    if not np.isfinite(points).all():
        row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise NavMeshError(f"navmesh: vertex {row} is {points[row].tolist()}; all must be finite float32 numbers")
    if len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        raise NavMeshError(
            f"navmesh: faces name vertices {indices.min()} to {indices.max()}; "
            f"valid are 0 to {len(points) - 1}, as there are {len(points)} vertices"
        )
    return points, np.ascontiguousarray(indices, np.int32)


def _poly_mesh(
    polygons: GridPolygons,
    field: compact.CompactField,
    region: NDArray[np.int32],
    bounds: NDArray[np.float32],
    settings: NavMeshSettings,
) -> PolyMesh:
    """Grid polygons in metres, with their detail; bounds reach a body's height above the mesh, as Habitat writes."""
    lower = bounds[0].astype(np.float64)
    upper = bounds[1].astype(np.float64)
    upper[1] += settings.walkable_height * settings.cell_height
    if len(polygons.corners) == 0:
        return PolyMesh.empty(np.stack([lower, upper]))
    size = np.array([settings.cell_size, settings.cell_height, settings.cell_size])
    used = polygons.corners >= 0
    start = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.int32)
    heights = detail.height_detail(polygons, field, region, settings)
    return PolyMesh(
        vertices=lower + polygons.vertices * size,
        polygon_start=start,
        polygon_vertices=polygons.corners[used].astype(np.int32),
        neighbours=polygons.neighbours[used].astype(np.int32),
        flags=np.full(len(start) - 1, FLAG_WALK, np.uint16),
        detail_vertices=lower + heights.vertices,
        detail_vertex_start=heights.vertex_start,
        detail_triangles=heights.triangles,
        detail_flags=heights.flags,
        detail_start=heights.triangle_start,
        bounds=np.stack([lower, upper]),
    )
