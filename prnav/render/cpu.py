"""Engine "embree": Embree traces the rays, compiled loops make and shade them.

One Embree scene per mesh, built when a ray first needs it and held within the memory budget. Views are sorted by
scene and traced in runs of at most ``RAYS_PER_CALL`` rays, so that a run's arrays stay in the processor's cache; there
is no loop over agents.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from prnav.render.engine import EngineOptions, Float32
from prnav.render.kernels import fill_rays, hit_spheres, shade
from prnav.render.rays import Views
from prnav.render.residents import Residents
from prnav.render.sampling import Sampling
from prnav.render.surfaces import Surfaces

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

RAYS_PER_CALL = 8192

PIXEL = Sampling()
"""One ray, through the middle."""

EMBREE_BYTES_PER_TRIANGLE = 130
"""Memory of an Embree scene per triangle, as measured: vertices, indices, tree and its leaves."""


class EmbreeEngine:
    """CPU ray casting; see :class:`prnav.render.engine.Engine`."""

    name = "embree"

    def __init__(self, scenes: Sequence[SceneMesh], options: EngineOptions) -> None:
        self._background = np.asarray(options.background * 255.0, dtype=np.float32)
        self._sphere_color = np.asarray(options.sphere_color * 255.0, dtype=np.float32)
        self.residents: Residents[_Tracer] = Residents(scenes, _Tracer, options.memory)

    def radiance(
        self,
        scene_of_view: NDArray[np.int64],
        views: Views,
        grid: int,
        sampling: Sampling,
        spheres: NDArray[np.float64] | None = None,
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.radiance`."""
        size = grid * sampling.side
        weights = sampling.weights.astype(np.float32)
        readings = np.empty((len(views), grid, grid, 3), dtype=np.float32)
        for scene, rows in runs_by_scene(scene_of_view):
            tracer = self.residents.get([scene])[scene]
            chosen = views.take(rows)
            width = 2.0 / size * np.sqrt((chosen.right * chosen.right).sum(axis=-1))
            pixel_area = (width * width).astype(np.float32)
            sums = np.zeros((len(chosen) * grid * grid, 3), dtype=np.float32)
            balls = None if spheres is None else spheres[rows]
            for start, directions, hits in tracer.trace(chosen, grid, sampling, balls):
                shade(
                    start,
                    weights,
                    grid * grid,
                    pixel_area,
                    directions,
                    hits["primID"],
                    hits["u"],
                    hits["v"],
                    hits["tfar"],
                    hits["Ng"],
                    tracer.surfaces.records,
                    tracer.surfaces.texels,
                    self._background,
                    self._sphere_color,
                    sums,
                )
            readings[rows] = (sums / np.float32(255 * sampling.count)).reshape(-1, grid, grid, 3)
        return readings

    def depth(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: NDArray[np.float64] | None = None
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.depth`."""
        depths = np.empty((len(views), size, size), dtype=np.float32)
        for scene, rows in runs_by_scene(scene_of_view):
            tracer = self.residents.get([scene])[scene]
            chosen = views.take(rows)
            flat = np.empty(len(chosen) * size * size, dtype=np.float32)
            balls = None if spheres is None else spheres[rows]
            for start, _, hits in tracer.trace(chosen, size, spheres=balls):
                flat[start : start + len(hits["tfar"])] = np.where(hits["primID"] == -1, np.inf, hits["tfar"])
            depths[rows] = flat.reshape(-1, size, size)
        return depths

    def trace(self, scene: int, views: Views, size: int) -> tuple[NDArray[np.int32], Float32]:
        """Hit triangle (-1 on a miss) and z-depth (inf on a miss) of every pixel, both (M, size, size)."""
        triangles = np.empty(len(views) * size * size, dtype=np.int32)
        for start, _, hits in self.residents.get([scene])[scene].trace(views, size):
            triangles[start : start + len(hits["primID"])] = hits["primID"]
        return triangles.reshape(-1, size, size), self.depth(np.full(len(views), scene), views, size)


class _Tracer:
    """One mesh in Embree, and its faces' records for shading."""

    def __init__(self, mesh: SceneMesh) -> None:
        self.surfaces = Surfaces.of(mesh)
        self._embree = EmbreeScene()
        self._geometry = TriangleMesh(self._embree, mesh.vertices, mesh.faces)
        self._embree.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # builds the tree now
        self.nbytes = self.surfaces.nbytes + EMBREE_BYTES_PER_TRIANGLE * len(mesh.faces)

    def trace(
        self,
        views: Views,
        grid: int,
        sampling: Sampling = PIXEL,
        spheres: NDArray[np.float64] | None = None,
    ) -> Iterator[tuple[int, Float32, dict[str, NDArray]]]:
        """Per run of pixels: the first one's number, the rays' directions (n, 3), and Embree's hits."""
        side, offsets = sampling.side, sampling.offsets
        total = len(views) * (grid * side) ** 2
        for start in range(0, total, RAYS_PER_CALL):
            count = min(RAYS_PER_CALL, total - start)
            origins = np.empty((count, 3), dtype=np.float32)
            directions = np.empty((count, 3), dtype=np.float32)
            fill_rays(
                views.origin, views.right, views.up, views.forward, grid, side, offsets, start, origins, directions
            )
            hits = self._embree.run(origins, directions, output=True)
            if spheres is not None:
                rays_per_view = (grid * side) ** 2
                hit_spheres(start, rays_per_view, spheres, views.origin, directions, hits["primID"], hits["tfar"])
            yield start, directions, hits


def runs_by_scene(scene_of_view: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Each scene that occurs, with its rows in ascending order."""
    if not len(scene_of_view):
        return
    order = np.argsort(scene_of_view, kind="stable")
    sorted_scenes = scene_of_view[order]
    starts = np.flatnonzero(np.r_[True, sorted_scenes[1:] != sorted_scenes[:-1]])
    for start, rows in zip(starts, np.split(order, starts[1:]), strict=True):
        yield int(sorted_scenes[start]), rows
