"""The colour of a ray: what it meets, how that is lit and shadowed, what it mirrors, and what veils it."""

from __future__ import annotations

import numpy as np
from numba import njit

from prnav.domains.control.casting.lighting import ALL_LIGHTS, FIRST_PASS, lit, plane_triangle
from prnav.domains.control.casting.solids import INF, PLANE, enter, holds, normal
from prnav.domains.control.casting.texels import plane_color, sky_color


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
        t = enter(
            shapes[s],
            row[0],
            row[1],
            row[2],
            row[9] + a * row[3] + b * row[6],
            row[10] + a * row[4] + b * row[7],
            row[11] + a * row[5] + b * row[8],
        )
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


@njit(nogil=True, error_model="numpy", forceinline=True)
def _glow(scene, work, s, x, y, ex, ey, ez):
    """Where a plane's light is kept for its triangle around (x, y), computed if it is not; weights of the corners."""
    shape = scene.shapes[s]
    number, w0, w1, w2 = plane_triangle(shape, x, y, work.corners)
    if work.triangle[s] != number:
        work.triangle[s] = number
        for group in range(len(scene.lights)):  # row 0: the first pass
            if group > 0 and not scene.lights[group].shadows:
                continue
            for k in range(3):
                glow = work.glow[s, group, k]
                glow[0], glow[1], glow[2] = lit(
                    shape, scene.lights, FIRST_PASS if group == 0 else group, work.beams[s],
                    work.corners[k, 0], work.corners[k, 1], 0.0, 0.0, 0.0, 1.0, ex, ey, ez, 1.0,
                )  # fmt: skip
    return w0, w1, w2


@njit(nogil=True, error_model="numpy", forceinline=True)
def _surface(scene, work, camera, s, t, a, b, pixel):
    """Colour of shape s where a ray through (a, b) meets it at depth t: what it mirrors apart."""
    shape, row = scene.shapes[s], work.views[s]
    ex, ey, ez = row[0], row[1], row[2]
    dz = row[11] + a * row[5] + b * row[8]
    x = ex + t * (row[9] + a * row[3] + b * row[6])
    y = ey + t * (row[10] + a * row[4] + b * row[7])
    z = ez + t * dz
    flat = shape.kind == PLANE
    nx, ny, nz, w0, w1, w2 = 0.0, 0.0, 1.0, 1.0, 0.0, 0.0
    if flat:
        w0, w1, w2 = _glow(scene, work, s, x, y, ex, ey, ez)
        glow = work.glow[s, 0]
        red = w0 * glow[0, 0] + w1 * glow[1, 0] + w2 * glow[2, 0]
        green = w0 * glow[0, 1] + w1 * glow[1, 1] + w2 * glow[2, 1]
        blue = w0 * glow[0, 2] + w1 * glow[1, 2] + w2 * glow[2, 2]
    else:
        nx, ny, nz = normal(shape, x, y, z)
        red, green, blue = lit(
            shape, scene.lights, FIRST_PASS, work.beams[s], x, y, z, nx, ny, nz, ex, ey, ez, 1.0
        )
    for number in range(1, len(scene.lights)):
        if not scene.lights[number].shadows:
            continue
        if flat:
            glow = work.glow[s, number]
            r = w0 * glow[0, 0] + w1 * glow[1, 0] + w2 * glow[2, 0]
            g = w0 * glow[0, 1] + w1 * glow[1, 1] + w2 * glow[2, 1]
            b2 = w0 * glow[0, 2] + w1 * glow[1, 2] + w2 * glow[2, 2]
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


@njit(nogil=True, error_model="numpy", forceinline=True)
def _plain_surface(scene, work, views, s, t, a, b, pixel, factor):
    """The same in the light of all lights, without shadows, its own colour times ``factor``."""
    shape, row, beams = scene.shapes[s], views[s], work.beams[s]
    ex, ey, ez = row[0], row[1], row[2]
    dz = row[11] + a * row[5] + b * row[8]
    x = ex + t * (row[9] + a * row[3] + b * row[6])
    y = ey + t * (row[10] + a * row[4] + b * row[7])
    z = ez + t * dz
    if shape.kind != PLANE:
        nx, ny, nz = normal(shape, x, y, z)
        return lit(shape, scene.lights, ALL_LIGHTS, beams, x, y, z, nx, ny, nz, ex, ey, ez, factor)
    _, w0, w1, w2 = plane_triangle(shape, x, y, work.corners)
    red, green, blue = 0.0, 0.0, 0.0
    for k in range(3):
        weight = w0 if k == 0 else w1 if k == 1 else w2
        cx, cy = work.corners[k, 0], work.corners[k, 1]
        r, g, b2 = lit(shape, scene.lights, ALL_LIGHTS, beams, cx, cy, 0.0, 0.0, 0.0, 1.0, ex, ey, ez, factor)
        red, green, blue = red + weight * r, green + weight * g, blue + weight * b2
    if shape.texture >= 0:
        r, g, b2 = plane_color(shape, scene.textures, x, y, pixel * t / np.sqrt(abs(dz)))
        red, green, blue = red * r, green * g, blue * b2
    return red, green, blue


@njit(nogil=True, error_model="numpy")
def _veiled(scene, work, views, count, near, far, mirror, a, b, pixel, factor, red, green, blue):
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
            layer[0], layer[1], layer[2] = _plain_surface(scene, work, views, s, t, a, b, pixel, factor)
            layer[3] = abs(work.alphas[s])
    for k in range(2 * count):
        layer = work.veils.layer[k if k < count else 2 * count - 1 - k]
        red += layer[3] * (layer[0] - red)
        green += layer[3] * (layer[1] - green)
        blue += layer[3] * (layer[2] - blue)
    return red, green, blue


@njit(nogil=True, error_model="numpy", forceinline=True)
def shade(scene, work, camera, faced, s, t, a, b, pixel):
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
        red, green, blue = _surface(scene, work, camera, s, t, a, b, pixel)
        if s == faced.mirror:
            # the mirrored camera sees through the mirror at the same depth
            r, g, b2 = 0.0, 0.0, 0.0
            factor = scene.shapes[s].reflectance
            other, depth = nearest(
                scene.shapes, work.mirror_views, work.mirror_order, faced.mirrored, a, b, t, scene.far
            )
            if other >= 0:
                r, g, b2 = _plain_surface(scene, work, work.mirror_views, other, depth, a, b, pixel, factor)
            if faced.veils > 0:
                r, g, b2 = _veiled(
                    scene, work, work.mirror_views, faced.veils, t, depth, s, a, b, pixel, factor, r, g, b2
                )
            red, green, blue = red + r, green + g, blue + b2
        red, green, blue = min(red, 1.0), min(green, 1.0), min(blue, 1.0)
    if faced.veils > 0:
        red, green, blue = _veiled(
            scene, work, work.views, faced.veils, scene.near, t, -1, a, b, pixel, 1.0, red, green, blue
        )
    return red, green, blue
