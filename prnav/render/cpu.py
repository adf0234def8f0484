"""Engine "embree": one compiled loop makes rays, lets Embree trace them, shades and averages them.

One Embree scene per mesh, built when a ray first needs it and held within the memory budget. Views are sorted by
scene, so that a scene's data stay in the cache; there is no loop over agents or scenes but in compiled code, and the
interpreter is free while a request is computed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
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

Int64 = NDArray[np.int64]

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
        pixel = 2.0 / (grid * sampling.side)
        areas = (pixel * pixel * (views.right * views.right).sum(axis=-1)).astype(np.float32)
        sums = np.zeros((len(views) * grid * grid, 3), dtype=np.float32)
        table = ray_table(grid, sampling)
        with self._traced(scene_of_view) as scenes:
            read_patches(
                _tracing(table),
                *scenes,
                _axes(views, spheres),
                table.fields,
                areas,
                self._background,
                self._sphere_color,
                grid * grid,
                sums,
            )
        return (sums / np.float32(255 * sampling.count)).reshape(-1, grid, grid, 3)

    def depth(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: NDArray[np.float64] | None = None
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.depth`."""
        return self._pixels(scene_of_view, views, size, spheres)[1]

    def trace(self, scene: int, views: Views, size: int) -> tuple[NDArray[np.int32], Float32]:
        """Hit triangle (-1 on a miss) and z-depth (inf on a miss) of every pixel, both (M, size, size)."""
        return self._pixels(np.full(len(views), scene), views, size, None)

    def _pixels(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: NDArray[np.float64] | None
    ) -> tuple[NDArray[np.int32], Float32]:
        triangles = np.empty((len(views), size * size), dtype=np.int32)
        depths = np.empty((len(views), size * size), dtype=np.float32)
        table = ray_table(size, Sampling())
        with self._traced(scene_of_view) as scenes:
            trace_pixels(_tracing(table), *scenes, _axes(views, spheres), table.fields, triangles, depths)
        return triangles.reshape(-1, size, size), depths.reshape(-1, size, size)

    @contextmanager
    def _traced(self, scene_of_view: Int64) -> Iterator[tuple[Int64, Int64, Int64]]:
        """What the kernels need of the scenes, which stay meanwhile; each view's row of it; views, scene by scene."""
        needed, rows = np.unique(scene_of_view, return_inverse=True)
        held = self.residents.get(needed.tolist())
        yield (
            np.array([tracer.addresses for tracer in held.values()], dtype=np.int64).reshape(-1, 5),
            rows,
            np.argsort(rows, kind="stable"),
        )
        del held


class _Tracer:
    """One mesh in Embree, and its faces' records for shading."""

    def __init__(self, mesh: SceneMesh) -> None:
        self._surfaces = Surfaces.of(mesh)
        self._mesh = EmbreeMesh(mesh.name, mesh.vertices, mesh.faces)
        self.nbytes = self._surfaces.nbytes + embree.BYTES_PER_TRIANGLE * len(mesh.faces)
        records, texels = self._surfaces.records, self._surfaces.texels
        self.addresses = (self._mesh.address, records.ctypes.data, len(records), texels.ctypes.data, len(texels))
        """A row of the kernels' ``scenes``; valid as long as this object lives."""


def _tracing(table: RayTable) -> tuple[int, bool, Float32]:
    """How such rays are traced best, as the kernels take it."""
    packet = len(table) >= DENSE
    return embree.intersect_address(packet), packet, embree.ray_buffer(packet)


def _axes(views: Views, spheres: NDArray[np.float64] | None) -> tuple[NDArray[np.float64], ...]:
    """Origins, axes (M, 3) and spheres (M, 4) of the views."""
    balls = np.zeros((len(views), 4)) if spheres is None else spheres
    return views.origin, views.right, views.up, views.forward, balls
