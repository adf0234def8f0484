"""Light for sensors on bodies: a compiled ray caster over a MuJoCo model's geoms and sites.

It draws what MuJoCo's classic OpenGL renderer draws, but only along the rays that receptors need. N states, K sensors
in each, B x B receptors per sensor, G geoms, S sites, L lights.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.domains.control.appearance import FloorAnchor, build_appearance
from prnav.domains.control.casting import SAMPLES, Scene, Strip, Work, new_strip, new_work, read_states
from prnav.domains.control.engine import mujoco
from prnav.errors import RenderError
from prnav.render.rays import rays_per_side

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]


class WorldPoses(NamedTuple):
    """Where a model's parts are in N states, as MuJoCo computes it."""

    geom_xpos: Float64
    """Places of the geoms [m], (N, G, 3)."""
    geom_xmat: Float64
    """Their axes as columns, row by row, (N, G, 9)."""
    site_xpos: Float64
    """Places of the sites [m], (N, S, 3)."""
    site_xmat: Float64
    """Their axes, (N, S, 9)."""
    light_xpos: Float64
    """Places of the lights [m], (N, L, 3)."""
    light_xdir: Float64
    """Where they shine, (N, L, 3), of length 1."""

    @classmethod
    def of(cls, data: mujoco.MjData) -> WorldPoses:
        """One state, N = 1, from MuJoCo's own data; mj_forward or mj_kinematics, mj_comPos and mj_camlight first."""
        return cls(*(np.array(getattr(data, name), np.float64)[None] for name in cls._fields))


class Caster:
    """Readings and pictures of sensors among a model's shapes."""

    def __init__(
        self, model: mujoco.MjModel, floor: FloorAnchor = "today", rays_per_receptor: int = 16, samples: int = 4
    ) -> None:
        """Caster of a compiled model.

        Args:
            model: what is drawn. Sizes, colours and lights are read now; poses come with each call.
            floor: where the textures of planes begin; "mujoco-3.11" is how they lay at the time of the paper.
            rays_per_receptor: rays averaged in a receptor, a square number; they stand for equal squares of its patch.
            samples: points of each such square at which it is looked what lies there, 1 or 4. Colours are computed
                once for each shape in it, as multisampling does, which smooths edges at little cost.

        Raises:
            RenderError: the model has what the caster cannot draw, or a setting is not valid.
        """
        looks = build_appearance(model, floor)
        self._scene = Scene(looks.shapes, looks.lights, looks.textures, looks.sky, looks.near, looks.far, looks.mirror)
        self._counts = (model.ngeom, model.nsite, model.nlight)
        self._side = rays_per_side(rays_per_receptor)
        if samples not in SAMPLES:
            raise RenderError(f"samples of a ray are {samples!r}; valid: {', '.join(map(str, SAMPLES))}")
        self._samples = samples
        self._rooms: dict[tuple[int, int], list[tuple[Work, Strip]]] = {}  # not in use, by grid and side

    def read(
        self, poses: WorldPoses, places: ArrayLike, axes: ArrayLike, fovs: ArrayLike, grid: int = 4, threads: int = 1
    ) -> Float32:
        """Readings, 0 to 1, (N, K, grid, grid, 3), row 0 at the top.

        Args:
            poses: where the model's parts are.
            places: sensors' places in the world [m], (N, K, 3).
            axes: their right, up and back as columns, (N, K, 3, 3); they look along their -z.
            fovs: full fields of view [rad], (N, K) or (K,).
            grid: receptors per row.
            threads: how many compute side by side; the readings are the same whatever their number.

        A reading is 0 where a pose is not finite.

        Raises:
            RenderError: a wrong shape, or a field of view outside (0, pi).
        """
        return self._cast(poses, places, axes, fovs, grid, self._side, threads)

    def image(
        self,
        poses: WorldPoses,
        places: ArrayLike,
        axes: ArrayLike,
        fovs: ArrayLike,
        size: int = 84,
        rays_per_pixel: int = 1,
        threads: int = 1,
    ) -> Float32:
        """Square pictures, 0 to 1, (N, K, size, size, 3); arguments as in :meth:`read`."""
        return self._cast(poses, places, axes, fovs, size, rays_per_side(rays_per_pixel), threads)

    def _cast(
        self,
        poses: WorldPoses,
        places: ArrayLike,
        axes: ArrayLike,
        fovs: ArrayLike,
        grid: int,
        side: int,
        threads: int,
    ) -> Float32:
        places_NK3 = np.asarray(places, np.float64)
        if places_NK3.ndim != 3 or places_NK3.shape[2] != 3:
            raise RenderError(f"places of sensors have shape {places_NK3.shape}; it must be (N, K, 3)")
        states, sensors = places_NK3.shape[:2]
        axes_NK33 = _shaped(axes, (states, sensors, 3, 3), "axes of sensors")
        fovs_NK = np.broadcast_to(np.asarray(fovs, np.float64), (states, sensors))
        finite = np.isfinite(fovs_NK)
        if not ((fovs_NK[finite] > 0.0) & (fovs_NK[finite] < np.pi)).all():
            wrong = fovs_NK[finite & ~((fovs_NK > 0.0) & (fovs_NK < np.pi))][0]
            raise RenderError(f"a field of view is {wrong:g} rad; it must lie between 0 and pi")
        if not isinstance(grid, int) or grid < 1:
            raise RenderError(f"receptors per row are {grid!r}; it must be a whole number of at least 1")
        parts = tuple(
            _shaped(value, (states, count, width), name)
            for name, value, count, width in zip(
                WorldPoses._fields, poses, np.repeat(self._counts, 2), (3, 9, 3, 9, 3, 3), strict=True
            )
        )
        out = np.empty((states, sensors, grid, grid, 3), np.float32)
        halves_NK = _shaped(np.tan(0.5 * np.ascontiguousarray(fovs_NK)), (states, sensors), "fields of view")
        places_NK3 = _shaped(places_NK3, (states, sensors, 3), "places of sensors")

        def work(start: int, stop: int) -> None:
            key = grid, side
            try:
                work, strip = self._rooms.setdefault(key, []).pop()
            except IndexError:
                work, strip = new_work(self._scene), new_strip(grid, side, self._samples)
            read_states(
                self._scene, work, *parts, places_NK3, axes_NK33, halves_NK,
                strip, grid, side, self._samples, start, stop, out,
            )  # fmt: skip
            self._rooms[key].append((work, strip))

        threads = max(1, min(threads, states))
        if threads == 1:
            work(0, states)
        else:
            bounds = np.linspace(0, states, threads + 1).astype(int)
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(work, bounds[:-1], bounds[1:]))
        return out


def _shaped(value: ArrayLike, shape: tuple[int, ...], what: str) -> Float64:
    """The value as the kernels take it: in one piece and read-only, so that they are compiled once."""
    array = np.ascontiguousarray(value, np.float64)
    if array.size != math.prod(shape) or array.shape[: len(shape) - 1] != shape[:-1]:
        raise RenderError(f"{what} have shape {array.shape}; it must be {shape}")
    array = array.reshape(shape).view()
    array.flags.writeable = False
    return array
