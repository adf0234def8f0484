"""Whether a mesh's extent can be what it says, before a navmesh is built of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from prnav.errors import NavMeshError
from prnav.navmesh.heightfield import MAX_SPAN_HEIGHT, grid_size
from prnav.navmesh.settings import NavMeshSettings
from prnav.scene import SceneMesh

MAX_COLUMNS = 50_000_000
"""Most columns of the grid; each takes 12 bytes, and every floor cell in it some 80."""

_BULK = 0.99
"""Share of a mesh's surface that is taken for the mesh itself where little of it lies far away."""


def check_extent(
    points: NDArray[np.float32], triangles: NDArray[np.int32], bounds: NDArray[np.float32], settings: NavMeshSettings
) -> None:
    """Refuse a mesh whose extent the grid's columns cannot hold.

    Args:
        points: vertices, (V, 3) [m], y up.
        triangles: (F, 3), at least one.
        bounds: of the vertices in use, (2, 3).
        settings: fineness of the grid.

    Raises:
        NavMeshError: the mesh is too wide, or too high: floors far above its lowest point would be put elsewhere. The
            message names what reaches out, or the unit that is likely.
    """
    extent = bounds[1].astype(np.float64) - bounds[0]
    width, depth = grid_size(bounds, settings.cell_size)
    most = MAX_SPAN_HEIGHT * settings.cell_height
    if width * depth > MAX_COLUMNS:
        problem = f"{width * depth} cells of cell_size {settings.cell_size}; at most {MAX_COLUMNS} are possible"
        larger = "a larger cell_size"
    elif extent[1] > most:
        problem = f"and its floors are told apart over {most:.0f} m of height at cell_height {settings.cell_height}"
        larger = "a larger cell_height"
    else:
        return
    size = " x ".join(f"{value:.6g}" for value in extent)
    raise NavMeshError(
        f"navmesh: the mesh is {size} m (x, y, z), {problem}: {_remedy(points, triangles, extent)}{larger}"
    )


def _remedy(points: NDArray[np.float32], triangles: NDArray[np.int32], extent: NDArray[np.float64]) -> str:
    """What to do: remove the triangle that lies far from the rest, or mind the unit."""
    low, high = bulk(points, triangles)
    distance = np.maximum(low - points, points - high).max(axis=1)
    used = np.unique(triangles)
    far = used[np.argmax(distance[used])]
    span = (high - low).max()
    if distance[far] > 4.0 * span:
        face = int(np.flatnonzero((triangles == far).any(axis=1))[0])
        axis = int(np.argmax(np.maximum(low - points[far], points[far] - high)))
        share = f"{100 * _BULK:.0f} % of its surface"
        return (
            f"{share} lie within {_corners(low, high)}, but triangle {face} reaches to {'xyz'[axis]} = "
            f"{points[far, axis]:.6g}; remove what lies outside, or give "
        )
    return "scale it to metres if it is in millimetres or centimetres, cut the mesh, or give "


def bulk(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of the box that all but a hundredth of a mesh's surface lies in, (3,) each.

    Along each axis a half per cent of the surface is left out on either side, and no triangle of it is cut.
    """
    a, b, c = (points[triangles[:, k]].astype(np.float64) for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        least = np.minimum(np.minimum(a[:, axis], b[:, axis]), c[:, axis])
        most = np.maximum(np.maximum(a[:, axis], b[:, axis]), c[:, axis])
        low[axis] = _quantile(least, areas, (1.0 - _BULK) / 2.0)
        high[axis] = _quantile(most, areas, (1.0 + _BULK) / 2.0)
    return low, high


def _quantile(values: NDArray[np.float64], weights: NDArray[np.float64], share: float) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[min(np.searchsorted(total, share * total[-1]), len(values) - 1)]])


def _corners(low: NDArray[np.float64], high: NDArray[np.float64]) -> str:
    return ", ".join(f"{axis} {a:.5g} to {b:.5g}" for axis, a, b in zip("xyz", low, high, strict=True))


HIGH, WIDE = 100.0, 1000.0
"""Extents [m] beyond which a mesh's unit is doubted: height, and width or depth."""


def extent_doubts(scene: SceneMesh) -> list[str]:
    """What is odd about a scene's extent, a sentence each: what no navmesh can be built of, or an unlikely unit."""
    bounds = scene.bounds
    try:
        check_extent(scene.vertices, scene.faces, bounds, NavMeshSettings())
    except NavMeshError as error:
        return [str(error).removeprefix("navmesh: ")]
    extent = bounds[1].astype(np.float64) - bounds[0]
    size = " x ".join(f"{value:.4g}" for value in extent)
    if extent[1] > HIGH or extent.max() > WIDE:
        return [f"it is {size} m (x, y, z): {_remedy(scene.vertices, scene.faces, extent).removesuffix(', or give ')}"]
    if extent.max() < 0.5:
        return [f"it is {size} m (x, y, z), too small to walk in: scale it to metres"]
    return []
