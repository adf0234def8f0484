"""Engine "reference": every ray against every triangle, in float64. Slow and plainly right; holds the others in tests.

Intersections follow Moeller and Trumbore (1997): a ray o + t d meets the plane coordinates (u, v) of a triangle where
t d, and the triangle's two edges, add up to o's offset from its first corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.render.charts import coarsest_levels
from prnav.render.engine import EngineOptions, Float32
from prnav.render.kernels import LEVEL_BIAS
from prnav.render.rays import Float64, Views, view_rays
from prnav.render.sampling import Sampling

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

RAYS_PER_BLOCK = 64
"""Rays held against all triangles at once, to bound memory."""


class ReferenceEngine:
    """Brute force; see :class:`prnav.render.engine.Engine`."""

    name = "reference"

    def __init__(self, scenes: Sequence[SceneMesh], options: EngineOptions) -> None:
        self._scenes = scenes
        self._background = options.background
        self._sphere_color = options.sphere_color

    def radiance(
        self,
        scene_of_view: NDArray[np.int64],
        views: Views,
        grid: int,
        sampling: Sampling,
        spheres: Float64 | None = None,
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.radiance`."""
        readings = np.empty((len(views), grid, grid, 3), dtype=np.float32)
        for row, scene in enumerate(scene_of_view):
            view = views.take(np.array([row]))
            origins, directions = (rays.reshape(-1, 3) for rays in view_rays(view, grid, sampling))
            pixel = 4.0 * float(view.right[0] @ view.right[0]) / (grid * sampling.side) ** 2
            ball = np.zeros(4) if spheres is None else spheres[row]
            colours = self._colours(self._scenes[scene], origins, directions, pixel, ball)
            weights = sampling.weights[:, None] / sampling.count
            readings[row] = (colours.reshape(grid, grid, sampling.count, 3) * weights).sum(axis=2)
        return readings

    def depth(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: Float64 | None = None
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.depth`."""
        depths = np.empty((len(views), size, size), dtype=np.float32)
        for row, scene in enumerate(scene_of_view):
            rays = view_rays(views.take(np.array([row])), size)
            origins, directions = (array.reshape(-1, 3) for array in rays)
            depth = intersect(self._scenes[scene], origins, directions)[1]
            if spheres is not None:
                depth = np.minimum(depth, sphere_depth(spheres[row], origins, directions))
            depths[row] = depth.reshape(size, size)
        return depths

    def _colours(
        self, mesh: SceneMesh, origins: Float64, directions: Float64, pixel: float, sphere: Float64
    ) -> Float64:
        triangle, depth, u, v = intersect(mesh, origins, directions)
        coarsest = coarsest_levels(mesh)
        colours = np.tile(self._background, (len(origins), 1))
        for i in np.flatnonzero(triangle >= 0):
            corners = mesh.faces[triangle[i]]
            weights = np.array([1.0 - u[i] - v[i], u[i], v[i]])
            texture = int(mesh.face_texture[triangle[i]])
            place, uvs = mesh.vertices[corners].astype(float), mesh.uvs[corners].astype(float)
            height, width = mesh.atlas.image(texture).shape[:2]
            # texels per square metre of the triangle, and square metres that the ray's pixel covers
            normal = np.cross(place[1] - place[0], place[2] - place[0])
            texels = abs(np.linalg.det(uvs[1:] - uvs[0])) * width * height / np.linalg.norm(normal)
            covers = pixel * depth[i] ** 2 / abs(normal @ directions[i]) * np.linalg.norm(normal)
            level = 0
            while level < coarsest[triangle[i]] and texels * covers * LEVEL_BIAS > 4.0**level:
                level += 1
            image = mesh.atlas.image(texture, level)
            column, row = (weights @ uvs % 1.0) * image.shape[1::-1]
            texel = image[min(int(row), image.shape[0] - 1), min(int(column), image.shape[1] - 1), :3]
            colours[i] = texel / 255.0 * (weights @ mesh.colors[corners] / 255.0)
        colours[sphere_depth(sphere, origins, directions) < depth] = self._sphere_color
        return colours


def intersect(
    mesh: SceneMesh, origins: Float64, directions: Float64
) -> tuple[NDArray[np.int64], Float64, Float64, Float64]:
    """First triangle each ray meets, from either side.

    Returns:
        triangle (n,), -1 on a miss; ray parameter (n,), inf on a miss; weights u and v of corners 1 and 2, (n,).
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    zero, one, two = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    results = []
    for start in range(0, len(origins), RAYS_PER_BLOCK):
        origin = origins[start : start + RAYS_PER_BLOCK, None]
        direction = directions[start : start + RAYS_PER_BLOCK, None]
        across = np.cross(direction, two)
        determinant = np.einsum("fi,rfi->rf", one, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = origin - zero
            u = np.einsum("rfi,rfi->rf", offset, across) / determinant
            turned = np.cross(offset, one)
            v = np.einsum("rki,rfi->rf", direction, turned) / determinant
            t = np.einsum("fi,rfi->rf", two, turned) / determinant
            hit = (determinant != 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
        t = np.where(hit, t, np.inf)
        first = t.argmin(axis=1)
        rows = np.arange(len(t))
        nearest = t[rows, first]
        triangle = np.where(np.isfinite(nearest), first, -1)
        results.append((triangle, nearest, u[rows, first], v[rows, first]))
    triangle, depth, u, v = (np.concatenate(parts) for parts in zip(*results, strict=True))
    return triangle, depth, u, v


def sphere_depth(sphere: Float64, origins: Float64, directions: Float64) -> Float64:
    """Ray parameter (n,) at which rays meet a sphere (x, y, z, radius), inf on a miss and for a radius of 0."""
    if sphere[3] <= 0.0:
        return np.full(len(origins), np.inf)
    # |o + t d - c|^2 = r^2
    offset = origins - sphere[:3]
    a = (directions**2).sum(1)
    b = 2.0 * (directions * offset).sum(1)
    c = (offset**2).sum(1) - sphere[3] ** 2
    discriminant = b * b - 4.0 * a * c
    root = np.sqrt(np.maximum(discriminant, 0.0))
    near, far = (-b - root) / (2.0 * a), (-b + root) / (2.0 * a)
    first = np.where(near > 0.0, near, far)
    return np.where((discriminant >= 0.0) & (first > 0.0), first, np.inf)
