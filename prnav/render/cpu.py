"""Engine "embree": one compiled loop makes rays, lets Embree trace them, shades and averages them.

One Embree scene per mesh, built when a ray first needs it and held within the memory budget. Views are sorted by
scene; there is no loop over agents in Python, and the interpreter is free while a request is computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.render import embree
from prnav.render.embree import EmbreeMesh
from prnav.render.engine import EngineOptions, Float32
from prnav.render.kernels import read_patches, trace_pixels
from prnav.render.ray_table import RayTable, ray_table
from prnav.render.rays import Views
from prnav.render.residents import Residents
from prnav.render.sampling import Sampling
from prnav.render.surfaces import Surfaces

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

DENSE = 1024
"""Rays in a view from which packets are faster than rays one by one, as measured on four scenes."""


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
        table = ray_table(grid, sampling)
        pixel = 2.0 / (grid * sampling.side)
        areas = (pixel * pixel * (views.right * views.right).sum(axis=-1)).astype(np.float32)
        readings = np.empty((len(views), grid, grid, 3), dtype=np.float32)
        for scene, rows in runs_by_scene(scene_of_view):
            tracer = self.residents.get([scene])[scene]
            sums = np.zeros((len(rows) * grid * grid, 3), dtype=np.float32)
            read_patches(
                tracer.traced(table),
                _chosen(views, spheres, rows),
                table.fields,
                areas[rows],
                tracer.surfaces.records,
                tracer.surfaces.texels,
                self._background,
                self._sphere_color,
                grid * grid,
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
            depths[rows] = self._pixels(scene, views, size, spheres, rows)[1]
        return depths

    def trace(self, scene: int, views: Views, size: int) -> tuple[NDArray[np.int32], Float32]:
        """Hit triangle (-1 on a miss) and z-depth (inf on a miss) of every pixel, both (M, size, size)."""
        return self._pixels(scene, views, size, None, np.arange(len(views)))

    def _pixels(
        self, scene: int, views: Views, size: int, spheres: NDArray[np.float64] | None, rows: NDArray[np.int64]
    ) -> tuple[NDArray[np.int32], Float32]:
        tracer, table = self.residents.get([scene])[scene], ray_table(size, Sampling())
        triangles = np.empty((len(rows), size * size), dtype=np.int32)
        depths = np.empty((len(rows), size * size), dtype=np.float32)
        trace_pixels(
            tracer.traced(table),
            _chosen(views, spheres, rows),
            table.fields,
            tracer.surfaces.records,
            triangles,
            depths,
        )
        return triangles.reshape(-1, size, size), depths.reshape(-1, size, size)


class _Tracer:
    """One mesh in Embree, and its faces' records for shading."""

    def __init__(self, mesh: SceneMesh) -> None:
        self.surfaces = Surfaces.of(mesh)
        self._mesh = EmbreeMesh(mesh.name, mesh.vertices, mesh.faces)
        self.nbytes = self.surfaces.nbytes + embree.BYTES_PER_TRIANGLE * len(mesh.faces)

    def traced(self, table: RayTable) -> tuple[int, int, bool, Float32]:
        """The first arguments of the kernels: how to trace this mesh with such rays."""
        packet = len(table) >= DENSE
        return embree.intersect_address(packet), self._mesh.address, packet, embree.ray_buffer(packet)


def _chosen(
    views: Views, spheres: NDArray[np.float64] | None, rows: NDArray[np.int64]
) -> tuple[NDArray[np.float64], ...]:
    """Origins, axes (n, 3) and spheres (n, 4) of some views."""
    balls = np.zeros((len(rows), 4)) if spheres is None else spheres[rows]
    return views.origin[rows], views.right[rows], views.up[rows], views.forward[rows], balls


def runs_by_scene(scene_of_view: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Each scene that occurs, with its rows in ascending order."""
    if not len(scene_of_view):
        return
    order = np.argsort(scene_of_view, kind="stable")
    sorted_scenes = scene_of_view[order]
    starts = np.flatnonzero(np.r_[True, sorted_scenes[1:] != sorted_scenes[:-1]])
    for start, rows in zip(starts, np.split(order, starts[1:]), strict=True):
        yield int(sorted_scenes[start]), rows
