"""Engine "warp": NVIDIA Warp traces, shades and averages in one launch, on a CUDA device or on Warp's CPU device.

Poses go to the device in one small copy per request, through staging buffers in page-locked memory, and readings stay
there: nothing waits for the device. Results are Warp arrays, which torch and others take without a copy through
DLPack (``torch.from_dlpack``). Work runs on the device's current stream, see ``warp.ScopedStream``.
"""

from __future__ import annotations

import importlib.util
import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.cache import cache_dir
from prnav.errors import RenderError
from prnav.render.engine import EngineOptions, Float32
from prnav.render.rays import Float64, Views
from prnav.render.residents import Residents
from prnav.render.sampling import Sampling
from prnav.render.surfaces import Surfaces

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

BVH_BYTES_PER_TRIANGLE = 120
"""Memory of a Warp mesh per triangle beside its points: indices, boxes and tree."""

VIEW_COLUMNS = 16
"""A view's row on the device: origin, right, up, forward, and a sphere's centre and radius."""

STAGES = 4
"""Requests whose poses may be on their way to the device at once."""


def load_warp(device: str) -> tuple[Untyped, Untyped]:
    """The warp module and one of its devices, "cpu", "cuda" or "cuda:N".

    Raises:
        RenderError: the package is missing, or there is no such device.
    """
    if importlib.util.find_spec("warp") is None:
        raise RenderError('engine "warp" needs the package warp-lang; pip install "prnav[gpu]"')
    wp = _warp()
    names = [d.alias for d in wp.get_devices()]
    if device != "cuda" and device not in names or device == "cuda" and not wp.is_cuda_available():
        raise RenderError(f"device {device!r} is not on this machine; Warp found: {', '.join(names)}")
    return wp, wp.get_device(device)


def finds_cuda() -> bool:
    """Whether Warp is installed and finds a GPU."""
    return importlib.util.find_spec("warp") is not None and bool(_warp().is_cuda_available())


def _warp() -> Untyped:
    """The warp module, ready for use."""
    ours = "warp" not in sys.modules
    import warp as wp

    if ours:  # nobody else uses it: keep it quiet, and its compiled kernels beside what else is derived
        wp.config.log_level = wp.LOG_WARNING
        wp.config.kernel_cache_dir = str(cache_dir() / "warp")
    wp.init()
    return wp


class WarpEngine:
    """Ray casting with Warp; see :class:`prnav.render.engine.Engine`."""

    name = "warp"

    def __init__(self, scenes: Sequence[SceneMesh], options: EngineOptions) -> None:
        self._wp, self.device = load_warp(options.device)
        from prnav.render import warp_kernels

        self._kernels = warp_kernels
        self._background = self._wp.vec3(*(options.background * 255.0))
        self._sphere_color = self._wp.vec3(*(options.sphere_color * 255.0))
        self._rays: dict[Sampling, Untyped] = {}
        self._staging: dict[int, _Staging] = {}
        self._lock = threading.RLock()  #: over what requests share: the staging buffers and the table of scenes
        self.residents: Residents[_DeviceScene] = Residents(scenes, self._prepare, options.memory, self._forget)
        self._scene_count = len(scenes)
        self._tabled: dict[int, _DeviceScene] = {}  #: scenes as the table on the device has them
        self._table: Untyped = None

    def radiance(
        self,
        scene_of_view: NDArray[np.int64],
        views: Views,
        grid: int,
        sampling: Sampling,
        spheres: Float64 | None = None,
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.radiance`; waits for the device and copies to the host."""
        array: Float32 = self.radiance_on_device(scene_of_view, views, grid, sampling, spheres).numpy()
        return array

    def radiance_on_device(
        self,
        scene_of_view: NDArray[np.int64],
        views: Views,
        grid: int,
        sampling: Sampling,
        spheres: Float64 | None = None,
    ) -> Untyped:
        """The same as a Warp array on the device, which may still be at work on it."""
        readings = self._wp.empty((len(views), grid, grid, 3), dtype=self._wp.float32, device=self.device)
        if not len(views):
            return readings
        with self._lock:
            inputs = self._inputs(scene_of_view, views, spheres)
            colours = [self._rays_of(sampling), grid, sampling.side, self._background, self._sphere_color]
            self._launch(self._kernels.read_patches, len(views) * grid * grid, [*inputs, *colours, readings.flatten()])
        return readings

    def depth(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: Float64 | None = None
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.depth`."""
        return self._pixels(scene_of_view, views, size, spheres)[1]

    def trace(self, scene: int, views: Views, size: int) -> tuple[NDArray[np.int32], Float32]:
        """Hit triangle (-1 on a miss) and z-depth (inf on a miss) of every pixel, both (M, size, size)."""
        return self._pixels(np.full(len(views), scene), views, size, None)

    def _pixels(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: Float64 | None
    ) -> tuple[NDArray[np.int32], Float32]:
        shape = (len(views), size, size)
        depths = self._wp.empty(shape, dtype=self._wp.float32, device=self.device)
        triangles = self._wp.empty(shape, dtype=self._wp.int32, device=self.device)
        if len(views):
            with self._lock:
                inputs = self._inputs(scene_of_view, views, spheres)
                self._launch(
                    self._kernels.trace_pixels, depths.size, [*inputs, size, depths.flatten(), triangles.flatten()]
                )
        return triangles.numpy(), depths.numpy()

    def _launch(self, kernel: Untyped, threads: int, inputs: list[Untyped]) -> None:
        self._wp.launch(kernel, dim=threads, inputs=inputs, device=self.device)

    def _inputs(self, scene_of_view: NDArray[np.int64], views: Views, spheres: Float64 | None) -> list[Untyped]:
        """The scenes' table, each view's row of it, and the views' rows, on the device."""
        held = self.residents.get(int(scene) for scene in np.unique(scene_of_view))
        if any(self._tabled.get(scene) is not item for scene, item in held.items()):
            self._tabled = self.residents.items()
            nothing = self._kernels.WarpScene()
            rows = [self._tabled[i].struct if i in self._tabled else nothing for i in range(self._scene_count)]
            self._table = self._wp.array(rows, dtype=self._kernels.WarpScene, device=self.device)
        if len(views) not in self._staging:
            self._staging[len(views)] = _Staging(self._wp, self.device, len(views))
        return [self._table, *self._staging[len(views)].send(scene_of_view, views, spheres)]

    def _rays_of(self, sampling: Sampling) -> Untyped:
        """Places and weights of a receptor's rays on the device, (rays, 3)."""
        if sampling not in self._rays:
            rays = np.concatenate([sampling.offsets, sampling.weights[:, None]], axis=1).astype(np.float32)
            self._rays[sampling] = self._wp.array(rays, dtype=self._wp.float32, device=self.device)
        return self._rays[sampling]

    def _forget(self, scene: int) -> None:
        """Let go of a scene once the device has done with it."""
        self._wp.synchronize_device(self.device)
        self._tabled.pop(scene, None)

    def _prepare(self, mesh: SceneMesh) -> _DeviceScene:
        return _DeviceScene(self._wp, self._kernels, self.device, mesh)


class _DeviceScene:
    """A mesh on the device: its tree, its faces' records and its texels."""

    def __init__(self, wp: Untyped, kernels: Untyped, device: Untyped, mesh: SceneMesh) -> None:
        surfaces = Surfaces.of(mesh)
        points = wp.array(mesh.vertices, dtype=wp.vec3, device=device)
        indices = wp.array(mesh.faces.ravel(), dtype=wp.int32, device=device)
        # built once and traced for hours: worth the slower construction by surface area
        self._mesh = wp.Mesh(points, indices, bvh_constructor="sah")
        self._surfaces = kernels.surface_array(surfaces.records, device)
        self._texels = wp.array(surfaces.texels, dtype=wp.uint32, device=device)
        self.struct = kernels.WarpScene()
        self.struct.mesh = self._mesh.id
        self.struct.surfaces = self._surfaces
        self.struct.texels = self._texels
        self.nbytes = surfaces.nbytes + mesh.vertices.nbytes + BVH_BYTES_PER_TRIANGLE * len(mesh.faces)


class _Staging:
    """Takes the poses of M views to the device."""

    def __init__(self, wp: Untyped, device: Untyped, views: int) -> None:
        self._wp, self._device, self._next = wp, device, 0
        # a page-locked buffer may be filled again once its copy is done; on the CPU a launch has ended by then
        self._buffers = [
            (
                wp.empty(views, dtype=wp.int32, device="cpu", pinned=device.is_cuda),
                wp.empty((views, VIEW_COLUMNS), dtype=wp.float32, device="cpu", pinned=device.is_cuda),
                wp.Event(device) if device.is_cuda else None,
            )
            for _ in range(STAGES if device.is_cuda else 1)
        ]

    def send(self, scene_of_view: NDArray[np.int64], views: Views, spheres: Float64 | None) -> list[Untyped]:
        """Scene of each view and the views' rows, on the device."""
        scenes, rows, sent = self._buffers[self._next]
        self._next = (self._next + 1) % len(self._buffers)
        if sent is not None:
            self._wp.synchronize_event(sent)
        scenes.numpy()[:] = scene_of_view
        row = rows.numpy()
        for i, axis in enumerate((views.origin, views.right, views.up, views.forward)):
            row[:, 3 * i : 3 * i + 3] = axis
        row[:, 12:] = 0.0 if spheres is None else spheres
        if sent is None:
            return [scenes, rows]
        there = [self._wp.empty_like(array, device=self._device, pinned=False) for array in (scenes, rows)]
        for destination, source in zip(there, (scenes, rows), strict=True):
            self._wp.copy(destination, source)
        self._device.stream.record_event(sent)
        return there
