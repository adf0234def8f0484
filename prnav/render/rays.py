"""Pinhole rays of sensors: from body, pose and field of view to one ray per pixel of a square image.

A sensor's image plane stands at distance 1 ahead of it and spans ``2 tan(fov / 2)`` each way; its pixels are equal
squares of that plane (not equal angles). A photoreceptor grid of B x B patches with s x s rays each is the image of
(B s) x (B s) pixels, its rays through the pixel centres. A ray's direction has length 1 along the optical axis, so
the ray parameter of a hit is the hit's z-depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav import frames
from prnav.arguments import floats
from prnav.errors import RenderError
from prnav.render.sampling import Sampling

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Views:
    """Square pinhole images in the world frame: M views, each with its own field of view.

    The ray through the image point (a, b) in [-1, 1]^2, a to the right and b up, is
    ``origin + t (forward + a right + b up)``; ``t`` is the z-depth [m].
    """

    origin: Float64
    """Optical centres [m], shape (M, 3)."""
    right: Float64
    """Right axis times tan(fov / 2), shape (M, 3)."""
    up: Float64
    """Up axis times tan(fov / 2), shape (M, 3)."""
    forward: Float64
    """Optical axes, unit vectors, shape (M, 3)."""

    def __len__(self) -> int:
        return len(self.origin)

    def take(self, rows: NDArray[np.int64]) -> Views:
        """Views of the given rows."""
        return Views(self.origin[rows], self.right[rows], self.up[rows], self.forward[rows])


def sensor_views(positions: ArrayLike, yaws: ArrayLike, designs: ArrayLike) -> Views:
    """Views of all sensors of all agents, agent by agent: M = N K.

    Args:
        positions: agents' feet [m], shape (N, 3).
        yaws: agents' headings [rad], shape (N,).
        designs: sensor poses in the body frame, shape (N, K, 7): x, y, z [m], yaw, pitch, roll, fov [rad].

    A sensor's rotation in the body is Ry(yaw) Rx(pitch) Rz(roll): positive pitch looks up, positive roll turns its
    image clockwise (the sensor itself tilts to its left).

    Raises:
        RenderError: a wrong shape, a value that is not finite, or a field of view outside (0, pi).
    """
    positions_N3, yaws_N, designs_NK7 = check_poses(positions, yaws, designs)
    # contiguous arrays, because numpy's sines of strided ones may differ in the last bit: a row must not feel its batch
    x, y, z, yaw, pitch, roll, fov = np.ascontiguousarray(np.moveaxis(designs_NK7, -1, 0))
    c, s = np.cos(yaws_N)[:, None], np.sin(yaws_N)[:, None]
    origin = positions_N3[:, None] + np.stack([c * x + s * z, y, c * z - s * x], axis=-1)
    heading = yaws_N[:, None] + yaw  # both turn about the vertical axis
    right, up, forward = frames.sensor_axes(heading, pitch, roll)
    scale = np.tan(0.5 * fov)[..., None]
    return Views(*(np.ascontiguousarray(a.reshape(-1, 3)) for a in (origin, right * scale, up * scale, forward)))


MOST = 1e9
"""Largest number of a pose [m or rad]; what is beyond is no place but a fault."""


def check_poses(positions: ArrayLike, yaws: ArrayLike, designs: ArrayLike) -> tuple[Float64, Float64, Float64]:
    """The three arrays of :func:`sensor_views` as float64.

    Raises:
        RenderError: as there.
    """
    positions_N3 = floats(positions, "positions", RenderError)
    yaws_N = floats(yaws, "yaws", RenderError).copy()
    designs_NK7 = floats(designs, "designs", RenderError)
    if designs_NK7.ndim != 3 or designs_NK7.shape[-1] != 7:
        raise RenderError(
            f"designs have shape {designs_NK7.shape}; they must be (N, K, 7): x, y, z, yaw, pitch, roll, fov of "
            f"K sensors for each of N agents"
        )
    n = len(designs_NK7)
    if positions_N3.shape != (n, 3):
        raise RenderError(f"positions have shape {positions_N3.shape}; with {n} designs they must be ({n}, 3)")
    if yaws_N.shape != (n,):
        raise RenderError(f"yaws have shape {yaws_N.shape}; with {n} designs they must be ({n},)")
    for name, array in (("positions", positions_N3), ("yaws", yaws_N), ("designs", designs_NK7)):
        if not np.isfinite(array).all():
            agent = int(np.argwhere(~np.isfinite(array))[0, 0])
            raise RenderError(f"{name} of agent {agent} are not finite; give numbers for every agent")
        if array.size and np.abs(array).max() > MOST:
            agent = int(np.argwhere(np.abs(array) > MOST)[0, 0])
            raise RenderError(f"{name} of agent {agent} hold a number beyond {MOST:g}; valid: metres and radians")
    fov = designs_NK7[..., 6]
    if fov.size and not (fov.min() > 0.0 and fov.max() < math.pi):
        agent, sensor = np.argwhere((fov <= 0.0) | (fov >= math.pi))[0]
        value = fov[agent, sensor]
        hint = "; is it in degrees? designs are in radians" if 1.0 <= value < 180.0 else ""
        raise RenderError(
            f"field of view of agent {agent}, sensor {sensor} is {value:g} rad; it must lie between 0 and pi{hint}"
        )
    return positions_N3, yaws_N, designs_NK7


def rays_per_side(rays_per_receptor: int) -> int:
    """Side of the square of rays: s for s x s rays per receptor.

    Raises:
        RenderError: not a perfect square of at least 1.
    """
    side = math.isqrt(rays_per_receptor) if isinstance(rays_per_receptor, int) and rays_per_receptor > 0 else 0
    if side == 0 or side * side != rays_per_receptor:
        raise RenderError(
            f"rays_per_receptor is {rays_per_receptor!r}; it must be a square of a whole number: 1, 4, 9, 16, 25, ..."
        )
    return side


def view_rays(views: Views, grid: int, sampling: Sampling = Sampling()) -> tuple[Float64, Float64]:  # noqa: B008 (frozen)
    """Rays of all receptors: origins and directions of shape (M, B, B, rays, 3), rows from the top.

    A direction is 1 long along the optical axis. ``view_rays(views, size)`` are the rays of a picture's pixels.
    """
    offsets = sampling.offsets
    corner = np.arange(grid)
    a = (corner[None, :, None] + offsets[:, 0]) * (2.0 / grid) - 1.0
    b = 1.0 - (corner[:, None, None] + offsets[:, 1]) * (2.0 / grid)
    a, b = (x[None, ..., None] for x in np.broadcast_arrays(a, b))
    right, up, forward = (axis[:, None, None, None] for axis in (views.right, views.up, views.forward))
    directions = forward + a * right + b * up
    return np.broadcast_to(views.origin[:, None, None, None], directions.shape), directions


def patch_rays(
    positions: ArrayLike, yaws: ArrayLike, designs: ArrayLike, grid: int, rays_per_receptor: int, pattern: str = "grid"
) -> tuple[Float64, Float64]:
    """Rays of every receptor of every agent: origins and directions of shape (N, K, B, B, s * s, 3)."""
    sampling = Sampling(rays_per_side(rays_per_receptor), pattern)
    rays = view_rays(sensor_views(positions, yaws, designs), grid, sampling)
    agents, sensors = np.shape(designs)[:2]
    origins, directions = (array.reshape(agents, sensors, *array.shape[1:]) for array in rays)
    return origins, directions
