"""The colour of a ray: what it meets, how that is lit and shadowed, what it mirrors, and what veils it."""

from __future__ import annotations

import numpy as np
from numba import njit

from prnav.domains.control.casting.lighting import ALL_LIGHTS, FIRST_PASS, lit, plane_cell
from prnav.domains.control.casting.solids import INF, PLANE, enter, holds, normal
from prnav.domains.control.casting.texels import plane_color, sky_color

KEPT = 16
"""Vertices of each plane whose light is kept while a sensor's rays are computed."""


@njit(nogil=True, error_model="numpy", forceinline=True)
def meet(shape, row, a, b):
    """Depth at which the ray through (a, b) enters a shape, seen as its row of ``views`` tells; inf if it does not."""
    return enter(
        shape,
        row[0],
        row[1],
        row[2],
        row[9] + a * row[3] + b * row[6],
        row[10] + a * row[4] + b * row[7],
        row[11] + a * row[5] + b * row[8],
    )


@njit(nogil=True, error_model="numpy", forceinline=True)
def nearest(shapes, views, order, seen, a, b, near, far):
    """The first shape that a ray through (a, b) meets between two depths, -1 for none, and the depth."""
    best = -1
    for i in range(seen):
        s = order[i]
        row = views[s]
        if row[12] > far:
            break
        if a < row[13] or a > row[14] or b < row[15] or b > row[16]:
            continue
        t = meet(shapes[s], row, a, b)
        if near <= t < far:
            best, far = s, t
    return best, far


@njit(nogil=True, error_model="numpy", forceinline=True)
def _is_shadowed(scene, work, number, s, px, py, pz):
    """Whether something stands between a place of the world on shape s and a light."""
    light, lamp = scene.lights[number], work.lamps[number]
    x, y, z = px - lamp[0], py - lamp[1], pz - lamp[2]
    # shadows fall within a square around the light's axis, as in the renderer's shadow map
    u, v = x * lamp[3] + y * lamp[4] + z * lamp[5], x * lamp[6] + y * lamp[7] + z * lamp[8]
    if not light.directional:
        depth = x * lamp[9] + y * lamp[10] + z * lamp[11]
        if depth <= 0.0:
            return False
        u, v = u / depth, v / depth
    if abs(u) > light.reach or abs(v) > light.reach:
        return False
    end = INF if light.directional else 1.0
    for other in range(len(scene.shapes)):
        shape, box = scene.shapes[other], work.lamp_boxes[number, other]
        if u < box[0] or u > box[1] or v < box[2] or v > box[3] or other == s or not shape.casts:
            continue
        m, beam = work.poses[other], work.beams[other, number]
        x, y, z = px - m[0], py - m[1], pz - m[2]
        ox, oy, oz = m[3] * x + m[6] * y + m[9] * z, m[4] * x + m[7] * y + m[10] * z, m[5] * x + m[8] * y + m[11] * z
        lx, ly, lz = beam[0], beam[1], beam[2]
        if not light.directional:
            lx, ly, lz = lx - ox, ly - oy, lz - oz
        t = enter(shape, ox, oy, oz, lx, ly, lz)
        if 0.0 < t < end or (t <= 0.0 and holds(shape, ox, oy, oz)):
            return True
    return False


@njit(nogil=True, error_model="numpy")
def _light_vertex(shape, lights, beams, x, y, ex, ey, ez, glow):
    """Write the light at a plane's vertex into ``glow`` (L + 1, 3)."""
    for group in range(len(lights)):  # row 0 is the first pass
        if group == 0 or lights[group].shadows:
            glow[group, 0], glow[group, 1], glow[group, 2] = lit(
                shape, lights, FIRST_PASS if group == 0 else group, beams, x, y, 0.0, 0.0, 0.0, 1.0, ex, ey, ez, 1.0
            )


@njit(nogil=True, error_model="numpy", forceinline=True)
def _glow(scene, work, stamp, s, column, row, x, y, ex, ey, ez):
    """Where the light at a vertex of plane s is kept; it is computed if it is not."""
    slot = (column + 4 * row) % KEPT
    number = (stamp * 1024 + row) * 1024 + column
    if work.kept[s, slot] != number:
        work.kept[s, slot] = number
        _light_vertex(scene.shapes[s], scene.lights, work.beams[s], x, y, ex, ey, ez, work.glow[s, slot])
    return slot


@njit(nogil=True, error_model="numpy", forceinline=True)
def _surface(scene, work, camera, stamp, s, t, a, b, pixel):
    """Colour of shape s where a ray through (a, b) meets it at depth t: what it mirrors apart."""
    shape, row = scene.shapes[s], work.views[s]
    ex, ey, ez = row[0], row[1], row[2]
    dz = row[11] + a * row[5] + b * row[8]
    x = ex + t * (row[9] + a * row[3] + b * row[6])
    y = ey + t * (row[10] + a * row[4] + b * row[7])
    z = ez + t * dz
    flat = shape.kind == PLANE
    nx, ny, nz, w0, w1, w2 = 0.0, 0.0, 1.0, 1.0, 0.0, 0.0
    v0, v1, v2 = 0, 0, 0
    glow = work.glow
    if flat:
        column, line, x0, x1, y0, y1, u, v = plane_cell(shape, x, y)
        if u + v <= 1.0:
            w0, w1, w2 = 1.0 - u - v, u, v
            v0 = _glow(scene, work, stamp, s, column, line, x0, y0, ex, ey, ez)
        else:
            w0, w1, w2 = u + v - 1.0, 1.0 - v, 1.0 - u
            v0 = _glow(scene, work, stamp, s, column + 1, line + 1, x1, y1, ex, ey, ez)
        v1 = _glow(scene, work, stamp, s, column + 1, line, x1, y0, ex, ey, ez)
        v2 = _glow(scene, work, stamp, s, column, line + 1, x0, y1, ex, ey, ez)
        red = w0 * glow[s, v0, 0, 0] + w1 * glow[s, v1, 0, 0] + w2 * glow[s, v2, 0, 0]
        green = w0 * glow[s, v0, 0, 1] + w1 * glow[s, v1, 0, 1] + w2 * glow[s, v2, 0, 1]
        blue = w0 * glow[s, v0, 0, 2] + w1 * glow[s, v1, 0, 2] + w2 * glow[s, v2, 0, 2]
    else:
        nx, ny, nz = normal(shape, x, y, z)
        red, green, blue = lit(shape, scene.lights, FIRST_PASS, work.beams[s], x, y, z, nx, ny, nz, ex, ey, ez, 1.0)
    for number in range(1, len(scene.lights)):
        if not scene.lights[number].shadows:
            continue
        if flat:
            r = w0 * glow[s, v0, number, 0] + w1 * glow[s, v1, number, 0] + w2 * glow[s, v2, number, 0]
            g = w0 * glow[s, v0, number, 1] + w1 * glow[s, v1, number, 1] + w2 * glow[s, v2, number, 1]
            b2 = w0 * glow[s, v0, number, 2] + w1 * glow[s, v1, number, 2] + w2 * glow[s, v2, number, 2]
        else:
            r, g, b2 = lit(shape, scene.lights, number, work.beams[s], x, y, z, nx, ny, nz, ex, ey, ez, 1.0)
        if r + g + b2 > 0.0 and not _is_shadowed(
            scene, work, number, s,
            camera[0] + t * (camera[9] + a * camera[3] + b * camera[6]),
            camera[1] + t * (camera[10] + a * camera[4] + b * camera[7]),
            camera[2] + t * (camera[11] + a * camera[5] + b * camera[8]),
        ):  # fmt: skip
            red, green, blue = red + r, green + g, blue + b2
    if shape.texture >= 0:
        r, g, b2 = plane_color(shape, scene.textures, x, y, pixel * t / np.sqrt(abs(dz)))
        red, green, blue = red * r, green * g, blue * b2
    return red, green, blue


@njit(nogil=True, error_model="numpy")
def _light_plain_vertex(shape, lights, beams, x, y, ex, ey, ez, factor, glow):
    """Write the light of all lights at a plane's vertex into ``glow`` (3,)."""
    glow[0], glow[1], glow[2] = lit(shape, lights, ALL_LIGHTS, beams, x, y, 0.0, 0.0, 0.0, 1.0, ex, ey, ez, factor)


@njit(nogil=True, error_model="numpy", forceinline=True)
def _plain_glow(scene, work, stamp, s, column, row, x, y, ex, ey, ez, factor):
    """The same as :func:`_glow` for the light of all lights."""
    slot = (column + 4 * row) % KEPT
    number = (stamp * 1024 + row) * 1024 + column
    if work.plain_kept[s, slot] != number:
        work.plain_kept[s, slot] = number
        _light_plain_vertex(
            scene.shapes[s], scene.lights, work.beams[s], x, y, ex, ey, ez, factor, work.plain_glow[s, slot]
        )
    return slot


@njit(nogil=True, error_model="numpy", forceinline=True)
def _plain_surface(scene, work, views, stamp, s, t, a, b, pixel, factor):
    """Colour of shape s at depth t in the light of all lights, without shadows, its own colour times ``factor``.

    ``stamp`` is another for each sensor, and for its mirrored camera.
    """
    shape, row = scene.shapes[s], views[s]
    ex, ey, ez = row[0], row[1], row[2]
    dz = row[11] + a * row[5] + b * row[8]
    x = ex + t * (row[9] + a * row[3] + b * row[6])
    y = ey + t * (row[10] + a * row[4] + b * row[7])
    z = ez + t * dz
    if shape.kind != PLANE:
        nx, ny, nz = normal(shape, x, y, z)
        return lit(shape, scene.lights, ALL_LIGHTS, work.beams[s], x, y, z, nx, ny, nz, ex, ey, ez, factor)
    column, line, x0, x1, y0, y1, u, v = plane_cell(shape, x, y)
    if u + v <= 1.0:
        w0, w1, w2 = 1.0 - u - v, u, v
        v0 = _plain_glow(scene, work, stamp, s, column, line, x0, y0, ex, ey, ez, factor)
    else:
        w0, w1, w2 = u + v - 1.0, 1.0 - v, 1.0 - u
        v0 = _plain_glow(scene, work, stamp, s, column + 1, line + 1, x1, y1, ex, ey, ez, factor)
    v1 = _plain_glow(scene, work, stamp, s, column + 1, line, x1, y0, ex, ey, ez, factor)
    v2 = _plain_glow(scene, work, stamp, s, column, line + 1, x0, y1, ex, ey, ez, factor)
    glow = work.plain_glow
    red = w0 * glow[s, v0, 0] + w1 * glow[s, v1, 0] + w2 * glow[s, v2, 0]
    green = w0 * glow[s, v0, 1] + w1 * glow[s, v1, 1] + w2 * glow[s, v2, 1]
    blue = w0 * glow[s, v0, 2] + w1 * glow[s, v1, 2] + w2 * glow[s, v2, 2]
    if shape.texture >= 0:
        r, g, b2 = plane_color(shape, scene.textures, x, y, pixel * t / np.sqrt(abs(dz)))
        red, green, blue = red * r, green * g, blue * b2
    return red, green, blue


@njit(nogil=True, error_model="numpy")
def _veiled(scene, work, views, stamp, count, near, far, mirror, a, b, pixel, factor, red, green, blue):
    """A colour seen through the transparent shapes that a ray meets between two depths.

    They are blended twice, front to back and then back to front, as the renderer does.
    """
    for i in range(count):
        s = work.veils.shape[i]
        layer, row = work.veils.layer[i], views[s]
        layer[3] = 0.0
        dx, dy = row[9] + a * row[3] + b * row[6], row[10] + a * row[4] + b * row[7]
        dz = row[11] + a * row[5] + b * row[8]
        if s == mirror or (scene.shapes[s].kind == PLANE and (dz > 0.0) != (work.alphas[s] < 0.0)):
            continue
        t = enter(scene.shapes[s], row[0], row[1], row[2], dx, dy, dz)
        if near <= t < far:
            layer[0], layer[1], layer[2] = _plain_surface(scene, work, views, stamp, s, t, a, b, pixel, factor)
            layer[3] = abs(work.alphas[s])
    for k in range(2 * count):
        layer = work.veils.layer[k if k < count else 2 * count - 1 - k]
        red += layer[3] * (layer[0] - red)
        green += layer[3] * (layer[1] - green)
        blue += layer[3] * (layer[2] - blue)
    return red, green, blue


@njit(nogil=True, error_model="numpy", forceinline=True)
def shade(scene, work, camera, faced, stamp, s, t, a, b, pixel):
    """Colour of the ray through (a, b), which first meets shape s at depth t; the sky where s is -1."""
    if s < 0:
        red, green, blue = sky_color(
            scene.textures,
            scene.sky,
            camera[9] + a * camera[3] + b * camera[6],
            camera[10] + a * camera[4] + b * camera[7],
            camera[11] + a * camera[5] + b * camera[8],
            pixel,
        )
    else:
        red, green, blue = _surface(scene, work, camera, stamp, s, t, a, b, pixel)
        if s == faced.mirror:
            # the mirrored camera sees through the mirror at the same depth
            r, g, b2 = 0.0, 0.0, 0.0
            factor = scene.shapes[s].reflectance
            other, depth = nearest(
                scene.shapes, work.mirror_views, work.mirror_order, faced.mirrored, a, b, t, scene.far
            )
            if other >= 0:
                r, g, b2 = _plain_surface(
                    scene, work, work.mirror_views, 2 * stamp + 1, other, depth, a, b, pixel, factor
                )
            if faced.veils > 0:
                r, g, b2 = _veiled(
                    scene,
                    work,
                    work.mirror_views,
                    2 * stamp + 1,
                    faced.veils,
                    t,
                    depth,
                    s,
                    a,
                    b,
                    pixel,
                    factor,
                    r,
                    g,
                    b2,
                )
            red, green, blue = red + r, green + g, blue + b2
        red, green, blue = min(red, 1.0), min(green, 1.0), min(blue, 1.0)
    if faced.veils > 0:
        red, green, blue = _veiled(
            scene, work, work.views, 2 * stamp, faced.veils, scene.near, t, -1, a, b, pixel, 1.0, red, green, blue
        )
    return red, green, blue
