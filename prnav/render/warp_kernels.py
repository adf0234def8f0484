# mypy: ignore-errors
# (kernels are Python to read, but their types are Warp's, which a checker of Python does not know)
"""Warp kernels of the GPU engine: rays, hits, shading and patch means in one launch.

One thread per receptor runs through its rays in order, so a reading's sum is the same whatever else is in the batch.
The arithmetic is that of :mod:`prnav.render.kernels`, with float32 views; Warp compiles it for CUDA and for its CPU
device. A view's row holds its origin, right, up and forward axes, and a sphere's centre and radius. What a kernel needs
of a scene lies in one row of an array of structs, so a batch may mix scenes.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from prnav.aliases import Untyped
from prnav.render.kernels import LEVEL_BIAS
from prnav.render.surface_record import SURFACE

wp.set_module_options({"enable_backward": False})

FAR = wp.constant(1.0e30)
_LEVEL_BIAS = wp.constant(float(LEVEL_BIAS))
_MISS = wp.constant(-1)
_SPHERE = wp.constant(-2)


@wp.struct
class WarpSurface:
    """A triangle's record, field by field that of :data:`prnav.render.surface_record.SURFACE`."""

    u: wp.float32
    v: wp.float32
    u1: wp.float32
    v1: wp.float32
    u2: wp.float32
    v2: wp.float32
    texels: wp.float32
    density: wp.float32
    offset: wp.int32
    width: wp.int32
    height: wp.int32
    coarsest: wp.int32
    color0: wp.int32
    color1: wp.int32
    color2: wp.int32
    tinted: wp.int32


@wp.struct
class WarpScene:
    """What rays and shading need of a scene."""

    mesh: wp.uint64
    surfaces: wp.array(dtype=WarpSurface)
    texels: wp.array(dtype=wp.uint32)


@wp.struct
class Hit:
    """What a ray meets first: triangle (-1 nothing, -2 the sphere), its ray parameter, weights of corners 1 and 2."""

    triangle: wp.int32
    depth: wp.float32
    s: wp.float32
    t: wp.float32
    facing: wp.float32


@wp.func
def _corner(views: wp.array2d(dtype=wp.float32), view: int, first: int) -> wp.vec3:
    return wp.vec3(views[view, first], views[view, first + 1], views[view, first + 2])


@wp.func
def _direction(views: wp.array2d(dtype=wp.float32), view: int, a: float, b: float) -> wp.vec3:
    return _corner(views, view, 9) + a * _corner(views, view, 3) + b * _corner(views, view, 6)


@wp.func
def _sphere_depth(centre: wp.vec3, radius: float, origin: wp.vec3, direction: wp.vec3) -> float:
    """Ray parameter at which a ray meets a sphere; FAR on a miss and for a radius of 0."""
    if radius <= 0.0:
        return FAR
    squared = wp.dot(direction, direction)
    offset = centre - origin
    along = wp.dot(offset, direction) / squared
    apart = offset - along * direction  # from the ray's closest point to the centre: no digits are cancelled
    inside = radius * radius - wp.dot(apart, apart)
    if inside < 0.0:
        return FAR
    half = wp.sqrt(inside / squared)
    depth = along - half
    if depth <= 0.0:
        depth = along + half
    if depth <= 0.0:
        depth = FAR
    return depth


@wp.func
def _cast(scene: WarpScene, views: wp.array2d(dtype=wp.float32), view: int, direction: wp.vec3) -> Hit:
    hit = Hit()
    hit.triangle = _MISS
    hit.depth = FAR
    origin = _corner(views, view, 0)
    found = wp.mesh_query_ray(scene.mesh, origin, direction, FAR)
    if found.result:
        hit.triangle = found.face
        hit.depth = found.t
        hit.s = found.v  # Warp gives the weights of corners 0 and 1
        hit.t = 1.0 - found.u - found.v
        hit.facing = wp.abs(wp.dot(found.normal, direction))
    ball = _sphere_depth(_corner(views, view, 12), views[view, 15], origin, direction)
    if ball < hit.depth:
        hit.triangle = _SPHERE
        hit.depth = ball
    return hit


@wp.func
def _channels(packed: wp.int32) -> wp.vec3:
    return wp.vec3(float(packed & 255), float((packed >> 8) & 255), float((packed >> 16) & 255))


@wp.func
def _colour(scene: WarpScene, hit: Hit, pixel_area: float) -> wp.vec3:
    """Colour of a triangle where a ray meets it, 0 to 255."""
    surface = scene.surfaces[hit.triangle]
    offset = surface.offset
    width = surface.width
    height = surface.height
    if width * height > 1:
        u = surface.u + hit.s * surface.u1 + hit.t * surface.u2
        v = surface.v + hit.s * surface.v1 + hit.t * surface.v2
        u -= wp.floor(u)
        v -= wp.floor(v)
        covered = pixel_area * hit.depth * hit.depth * surface.density / hit.facing * _LEVEL_BIAS
        level = surface.coarsest
        while covered > 1.0 and level > 0:
            covered *= 0.25
            level -= 1
            offset += width * height
            width = wp.max(1, width >> 1)
            height = wp.max(1, height >> 1)
        x = wp.min(int(u * float(width)), width - 1)
        y = wp.min(int(v * float(height)), height - 1)
        offset += y * width + x
    colour = _channels(wp.int32(scene.texels[offset]))
    if surface.tinted != 0:
        tint = (
            (1.0 - hit.s - hit.t) * _channels(surface.color0)
            + hit.s * _channels(surface.color1)
            + hit.t * _channels(surface.color2)
        )
        colour = wp.cw_mul(colour, tint) * (1.0 / 255.0)
    return colour


@wp.kernel
def read_patches(
    scenes: wp.array(dtype=WarpScene),
    scene_of_view: wp.array(dtype=wp.int32),
    views: wp.array2d(dtype=wp.float32),
    rays: wp.array2d(dtype=wp.float32),
    grid: int,
    side: int,
    background: wp.vec3,
    sphere_color: wp.vec3,
    readings: wp.array(dtype=wp.float32),
):
    """Weighted mean colour, 0 to 1, of each patch: thread i is patch i, ``readings`` (M * grid * grid * 3).

    ``rays`` (side * side, 3) are places in the patch, to the right and down, and weights.
    """
    thread = wp.tid()
    patches = grid * grid
    view = thread // patches
    patch = thread - view * patches
    scene = scenes[scene_of_view[view]]
    step = 2.0 / float(grid)
    column = float(patch % grid)
    row = float(patch // grid)
    right = _corner(views, view, 3)
    pixel = step / float(side)
    pixel_area = pixel * pixel * wp.dot(right, right)
    total = wp.vec3(0.0, 0.0, 0.0)
    for k in range(side * side):
        a = (column + rays[k, 0]) * step - 1.0
        b = 1.0 - (row + rays[k, 1]) * step
        hit = _cast(scene, views, view, _direction(views, view, a, b))
        if hit.triangle == _SPHERE:
            total += rays[k, 2] * sphere_color
        elif hit.triangle == _MISS:
            total += rays[k, 2] * background
        else:
            total += rays[k, 2] * _colour(scene, hit, pixel_area)
    mean = total / (255.0 * float(side * side))
    readings[3 * thread] = mean[0]
    readings[3 * thread + 1] = mean[1]
    readings[3 * thread + 2] = mean[2]


@wp.kernel
def trace_pixels(
    scenes: wp.array(dtype=WarpScene),
    scene_of_view: wp.array(dtype=wp.int32),
    views: wp.array2d(dtype=wp.float32),
    size: int,
    depths: wp.array(dtype=wp.float32),
    triangles: wp.array(dtype=wp.int32),
):
    """z-depth [m] (inf on a miss) and triangle (-1 nothing, -2 a sphere) at the pixel centres; thread i is pixel i."""
    thread = wp.tid()
    pixels = size * size
    view = thread // pixels
    pixel = thread - view * pixels
    a = (float(pixel % size) + 0.5) * (2.0 / float(size)) - 1.0
    b = 1.0 - (float(pixel // size) + 0.5) * (2.0 / float(size))
    hit = _cast(scenes[scene_of_view[view]], views, view, _direction(views, view, a, b))
    triangles[thread] = hit.triangle
    depths[thread] = wp.where(hit.triangle == _MISS, wp.inf, hit.depth)


def surface_array(records: np.ndarray[Untyped, Untyped], device: Untyped) -> Untyped:
    """Records of :data:`prnav.render.surface_record.SURFACE` as a Warp array of :class:`WarpSurface` on a device."""
    dtype = np.dtype(WarpSurface.numpy_dtype())
    assert dtype.itemsize == SURFACE.itemsize == 64  # the same bytes
    return wp.array(np.asarray(records).view(dtype), dtype=WarpSurface, device=device)
