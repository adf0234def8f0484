"""How coarse a texture may get on a triangle before its neighbours in the picture bleed in.

A texture often holds many islands of texels (charts) that lie anywhere on the model, with unused texels between them.
A texel of a coarse mip level covers a piece of the picture; where that piece reaches over a chart's border it mixes
in colours that the surface does not have. The share of a chart's area within a texel of its border is about
``texel side * perimeter / area``, so a bound on that share is a bound on the level.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from prnav.cache import Arrays, cache_key, cached_arrays, hash_arrays

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

BORDER_SHARE = 0.25
"""Largest share of a chart's area within one texel of its border; more of it costs more by bleeding than it smooths."""


VERSION = 1
"""Raised when :func:`coarsest_levels` gives other levels than before: what is cached is then made anew."""


def cached_coarsest_levels(mesh: SceneMesh) -> NDArray[np.int32]:
    """The same as :func:`coarsest_levels`, kept on disk: it takes a second on a large scan."""
    used: Arrays = {"uvs": mesh.uvs, "faces": mesh.faces, "face_texture": mesh.face_texture, "table": mesh.atlas.table}
    key = cache_key(hash_arrays(used), VERSION, BORDER_SHARE)
    levels = cached_arrays("charts", key, lambda: {"coarsest": coarsest_levels(mesh)})["coarsest"]
    if levels.shape != mesh.face_texture.shape or levels.dtype != np.int32:
        return coarsest_levels(mesh)  # a foreign file under this name
    return levels


def coarsest_levels(mesh: SceneMesh) -> NDArray[np.int32]:
    """Coarsest mip level that each triangle may be shaded with, shape (F,)."""
    table = mesh.atlas.table
    limits = np.zeros(len(mesh.faces), dtype=np.int32)
    textured = np.flatnonzero(table[mesh.face_texture, 3] > 1)
    if not len(textured):
        return limits
    faces, texture = mesh.faces[textured], mesh.face_texture[textured]
    corner, points = _uv_points(mesh, faces, texture)
    # several parts may show the same piece of the picture: each piece counts once
    ordered, first, copies = np.unique(np.sort(corner, axis=1), axis=0, return_index=True, return_inverse=True)
    size = table[texture[first], 1:3].astype(np.float64)
    texel = mesh.uvs[faces[first]].astype(np.float64) * size[:, None]  # corners [texels]
    one, two = texel[:, 1] - texel[:, 0], texel[:, 2] - texel[:, 0]
    area = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])

    ends = np.concatenate([ordered[:, [0, 1]], ordered[:, [1, 2]], ordered[:, [0, 2]]])
    owner = np.tile(np.arange(len(ordered)), 3)
    keys, edge, uses = np.unique(ends[:, 0] * points + ends[:, 1], return_inverse=True, return_counts=True)
    links = coo_array((np.ones(len(owner), dtype=np.int8), (owner, edge)), shape=(len(ordered), len(keys)))
    graph = (links @ links.T).tocsr()
    count, chart = connected_components(graph, directed=False)

    border = uses[edge] == 1
    place = np.empty((points, 2))
    place[corner.ravel()] = (mesh.uvs[faces].astype(np.float64) * table[texture, 1:3][:, None]).reshape(-1, 2)
    length = np.linalg.norm(place[ends[:, 0]] - place[ends[:, 1]], axis=1) * border
    perimeter = np.bincount(chart[owner], length, minlength=count)
    side = BORDER_SHARE * np.bincount(chart, area, minlength=count) / np.maximum(perimeter, 1e-9)
    level = np.floor(np.log2(np.maximum(side, 1.0))).astype(np.int32)
    limits[textured] = np.minimum(level[chart[copies.ravel()]], table[texture, 3] - 1)
    return limits


def _uv_points(mesh: SceneMesh, faces: NDArray[np.int32], texture: NDArray[np.int32]) -> tuple[NDArray[np.int64], int]:
    """Number of each corner's place in its texture, (n, 3), one for equal texture, u and v; and how many there are."""
    rows = np.empty((faces.size, 3), dtype=np.float32)
    rows[:, 0] = np.repeat(texture, 3)
    rows[:, 1:] = mesh.uvs[faces.ravel()] + np.float32(0.0)  # no negative zeros
    whole = np.ascontiguousarray(rows).view(np.dtype((np.void, 12))).ravel()
    unique, inverse = np.unique(whole, return_inverse=True)
    return inverse.reshape(-1, 3).astype(np.int64), len(unique)
