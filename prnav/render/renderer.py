"""The renderer: readings, pictures and depths of any sensors of many agents, in any mix of scenes."""

from __future__ import annotations

import importlib
import re
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Untyped
from prnav.errors import RenderError
from prnav.render.engine import Engine, EngineOptions, Float32
from prnav.render.rays import Views, rays_per_side, sensor_views
from prnav.render.residents import Progress, Residents
from prnav.render.sampling import Sampling

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

ENGINES = {
    "embree": ("prnav.render.cpu", "EmbreeEngine"),
    "warp": ("prnav.render.gpu", "WarpEngine"),
    "reference": ("prnav.render.reference", "ReferenceEngine"),
    "egl": ("prnav.render.gl", "EglEngine"),
    "osmesa": ("prnav.render.gl", "OsmesaEngine"),
}
"""Engines by name: module and class, imported when one is first asked for."""

MOST_SIDE = 8192
"""Largest grid of a reading and largest side of a picture."""

MOST_BYTES = 16_000_000_000
"""Most bytes of one request's answer."""

MEMORY_GB = 8.0
"""Memory [GB] that prepared scenes may take unless told otherwise."""


class Renderer:
    """Unlit light and depth as sensors on agents' bodies see them.

    A reading is the mean colour over a receptor's patch of the sensor's pinhole image; a picture is the same with one
    pixel per receptor. Colours are the stored 8-bit values over 255, without gamma decoding or light. What a ray sees
    where it meets nothing is ``background``. Results are the same whatever else is in the batch.

    Sensors are given in their body's frame (origin at the feet, x right, y up, -z ahead) as x, y, z [m], yaw, pitch,
    roll and fov [rad]; see :func:`prnav.render.rays.sensor_views`.
    """

    def __init__(
        self,
        scenes: Sequence[SceneMesh],
        device: str = "cpu",
        engine: str = "auto",
        rays_per_receptor: int = 16,
        background: tuple[float, float, float] = (0.0, 0.0, 0.0),
        pattern: str = "grid",
        sphere_color: tuple[float, float, float] = (0.0, 1.0, 0.0),
        memory_gb: float = MEMORY_GB,
        acceptance: str = "uniform",
    ) -> None:
        """Renderer of ``scenes``.

        Args:
            scenes: what agents can be in.
            device: "cpu", "cuda", "cuda:N", or "auto": a GPU where there is one and the engine can use it, else "cpu".
            engine: "auto" (the fastest on the device: "embree" on the CPU, "warp" on CUDA) or a key of
                :data:`ENGINES`.
            rays_per_receptor: a square number; sets the cost and the error of readings.
            background: red, green, blue, 0 to 1, where a ray meets nothing.
            pattern: where a receptor's rays lie in its patch: "grid" (the pixels of a finer picture) or "lattice"
                (less error for as many rays); see :func:`prnav.render.sampling.patch_offsets`.
            sphere_color: red, green, blue, 0 to 1, of the spheres that requests may add.
            memory_gb: memory [GB] of the device that prepared scenes may take; over it, the least recently used go and
                are prepared anew when they are needed again. What one request needs is held whatever the budget.
            acceptance: how much a receptor's rays count across its patch, "uniform", "cosine" or "gaussian"; see
                :func:`prnav.render.sampling.acceptance_weights`. Pictures have one ray per pixel and know none.

        Raises:
            RenderError: no scenes, an unknown device or engine, one that cannot run here, a number of rays that is
                no square, an unknown pattern or acceptance, a colour outside 0..1, or a budget that is not positive.
        """
        if device == "auto":
            device = "cuda" if engine in ("auto", "warp") and cuda_available() else "cpu"
        cuda = re.fullmatch(r"cuda(:\d+)?", device) is not None
        if not cuda and device != "cpu":
            raise RenderError(f'device {device!r} is not known; valid: "cpu", "cuda", "cuda:N", "auto"')
        if engine != "auto" and engine not in ENGINES:
            raise RenderError(f"engine {engine!r} is not known; valid: auto, {', '.join(ENGINES)}")
        if cuda and engine not in ("auto", "warp"):
            raise RenderError(f'engine {engine!r} does not run on device {device!r}; use engine "warp" or device "cpu"')
        if not memory_gb > 0.0:
            raise RenderError(f"memory_gb is {memory_gb!r}; it must be a positive number of gigabytes")
        if not len(scenes):
            raise RenderError("there are no scenes to render; give at least one")
        colours = _colour("background", background), _colour("sphere_color", sphere_color)
        self.rays_per_receptor = rays_per_receptor
        self._scenes = scenes
        self._arguments = (device, engine, rays_per_receptor, background, pattern, sphere_color, memory_gb, acceptance)
        self.device = device
        """"cpu", "cuda" or "cuda:N"."""
        self._sampling = Sampling(rays_per_side(rays_per_receptor), pattern, acceptance)
        self._pixel = Sampling(1, pattern)
        self._scene_count = len(scenes)
        if engine == "auto":
            engine = "warp" if cuda else "embree"
        module, name = ENGINES[engine]
        options = EngineOptions(*colours, device, memory_gb * 1e9)
        self._engine: Engine = getattr(importlib.import_module(module), name)(scenes, options)
        self._residents: Residents[Untyped] | None = getattr(self._engine, "residents", None)

    def __reduce__(self) -> tuple[Untyped, ...]:
        """Made anew from its scenes and arguments: handles of libraries and devices stay in their process."""
        return Renderer, (self._scenes, *self._arguments)

    def __deepcopy__(self, memo: dict[int, Untyped]) -> Renderer:
        """A renderer of the same scenes, which nothing changes."""
        return Renderer(self._scenes, *self._arguments)

    @property
    def engine(self) -> str:
        """Name of the engine in use."""
        return self._engine.name

    def preload(self, progress: Progress | None = None) -> threading.Thread:
        """Prepare all scenes in the background until the memory budget is full; the returned thread may be joined.

        ``progress`` is called with the number of scenes done, of all scenes, and the name of the next one. Requests go
        on meanwhile. Engines without prepared scenes (the reference and the rasterisers) have nothing to do.
        """
        if self._residents is None:
            thread = threading.Thread(target=lambda: None)
            thread.start()
            return thread
        return self._residents.preload(progress)

    @property
    def resident_scenes(self) -> tuple[int, ...]:
        """Indices of the scenes that are prepared, the least recently used first."""
        return () if self._residents is None else self._residents.held

    @property
    def resident_bytes(self) -> int:
        """Memory of the prepared scenes [bytes], estimated from their sizes."""
        return 0 if self._residents is None else self._residents.nbytes

    def read(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike,
        grid: int = 4,
        spheres: ArrayLike | None = None,
    ) -> Float32:
        """Photoreceptor readings, shape (N, K, grid, grid, 3), 0 to 1; row 0 is the top, column 0 the left.

        Args:
            scene_ids: index into the renderer's scenes, shape (N,).
            positions: agents' feet [m], shape (N, 3).
            yaws: agents' headings [rad], shape (N,).
            designs: sensor poses in the body frame, shape (N, K, 7).
            grid: receptors per row of a sensor.
            spheres: centre and radius [m] of an opaque sphere that each agent alone sees, shape (N, 4), radius 0 for
                none; all of it left out if not given.

        Raises:
            RenderError: a wrong shape, a value that is not finite or out of range.
        """
        readings: Float32 = self._radiance(
            scene_ids, positions, yaws, designs, _count("grid", grid), self._sampling, spheres
        )
        return readings

    def read_on_device(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike,
        grid: int = 4,
        spheres: ArrayLike | None = None,
    ) -> Untyped:
        """The same as :meth:`read`, left on the renderer's device: (N, K, grid * grid, 3), an array that DLPack shares.

        ``torch.from_dlpack(renderer.read_on_device(...))`` is a tensor on that device with no copy. With engine
        "warp" on CUDA nothing waits for the device: the work runs on Warp's current stream, and DLPack lets the
        consumer's stream wait for it. Other engines give NumPy arrays. Receptors come row by row from the top left
        (Warp's arrays have four dimensions at most).
        """
        return self._radiance(
            scene_ids, positions, yaws, designs, _count("grid", grid), self._sampling, spheres, on_device=True
        )

    def image_on_device(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike,
        size: int = 128,
        spheres: ArrayLike | None = None,
    ) -> Untyped:
        """The same as :meth:`image`, left on the device: (N, K, size * size, 3); see :meth:`read_on_device`."""
        return self._radiance(
            scene_ids, positions, yaws, designs, _count("size", size), self._pixel, spheres, on_device=True
        )

    def image(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike,
        size: int = 128,
        spheres: ArrayLike | None = None,
    ) -> Float32:
        """Pictures of shape (N, K, size, size, 3), 0 to 1, one ray per pixel; arguments as in :meth:`read`."""
        pictures: Float32 = self._radiance(
            scene_ids, positions, yaws, designs, _count("size", size), self._pixel, spheres
        )
        return pictures

    def depth(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike,
        size: int = 128,
        spheres: ArrayLike | None = None,
    ) -> Float32:
        """z-depth [m] (distance along the optical axis) at the pixel centres, (N, K, size, size); inf on a miss."""
        scene_of_view, views, shape = self._views(scene_ids, positions, yaws, designs)
        size = _count("size", size)
        _check_memory(shape[0] * shape[1] * size * size)
        depths = self._engine.depth(scene_of_view, views, size, _spheres(spheres, *shape))
        return depths.reshape(*shape, size, size)

    def _radiance(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike,
        grid: int,
        sampling: Sampling,
        spheres: ArrayLike | None,
        on_device: bool = False,
    ) -> Untyped:
        scene_of_view, views, shape = self._views(scene_ids, positions, yaws, designs)
        _check_memory(shape[0] * shape[1] * grid * grid)
        balls = _spheres(spheres, *shape)
        if not on_device:
            readings = self._engine.radiance(scene_of_view, views, grid, sampling, balls)
            return readings.reshape(*shape, grid, grid, 3)
        radiance = getattr(self._engine, "radiance_on_device", self._engine.radiance)
        return radiance(scene_of_view, views, grid, sampling, balls).reshape((*shape, grid * grid, 3))

    def _views(
        self, scene_ids: ArrayLike, positions: ArrayLike, yaws: ArrayLike, designs: ArrayLike
    ) -> tuple[NDArray[np.int64], Views, tuple[int, int]]:
        views = sensor_views(positions, yaws, designs)
        agents, sensors = np.shape(designs)[:2]
        scenes = np.asarray(scene_ids)
        if scenes.shape != (agents,) or (agents and not np.issubdtype(scenes.dtype, np.integer)):
            raise RenderError(
                f"scene_ids have shape {scenes.shape} and type {scenes.dtype}; with {agents} designs they must be "
                f"{agents} whole numbers"
            )
        if agents and not (scenes.min() >= 0 and scenes.max() < self._scene_count):
            bad = int(scenes[(scenes < 0) | (scenes >= self._scene_count)][0])
            raise RenderError(f"scene id {bad} does not exist; valid: 0 to {self._scene_count - 1}")
        return np.repeat(scenes.astype(np.int64), sensors), views, (agents, sensors)


def cuda_available() -> bool:
    """Whether the package for engine "warp" is installed and finds a GPU."""
    from prnav.render.gpu import finds_cuda

    return finds_cuda()


def _count(name: str, value: int) -> int:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 1:
        raise RenderError(f"{name} is {value!r:.60}; it must be a whole number of at least 1")
    if value > MOST_SIDE:
        raise RenderError(f"{name} is {value!r:.60}; at most {MOST_SIDE}: every one of its squares is a ray or more")
    return int(value)


def _check_memory(reading: int) -> None:
    """Refuse a request whose answer alone would take more than :data:`MOST_BYTES`."""
    if 12 * reading > MOST_BYTES:
        raise RenderError(
            f"the request asks for {reading:,} colours, {12 * reading / 1e9:.1f} GB; ask for fewer views at once, at "
            f"most {MOST_BYTES / 1e9:.0f} GB"
        )


def _colour(name: str, value: tuple[float, float, float]) -> NDArray[np.float64]:
    colour = np.asarray(value, dtype=np.float64)
    if colour.shape != (3,) or not ((colour >= 0.0) & (colour <= 1.0)).all():
        raise RenderError(f"{name} is {value!r}; it must be red, green, blue from 0 to 1")
    return colour


def _spheres(spheres: ArrayLike | None, agents: int, sensors: int) -> NDArray[np.float64] | None:
    if spheres is None:
        return None
    balls = np.asarray(spheres, dtype=np.float64)
    if balls.shape != (agents, 4) or not np.isfinite(balls).all() or (balls[:, 3] < 0.0).any():
        raise RenderError(
            f"spheres have shape {balls.shape}; with {agents} designs they must be ({agents}, 4), finite: x, y, z and "
            f"a radius of at least 0 m"
        )
    return np.repeat(balls, sensors, axis=0)
