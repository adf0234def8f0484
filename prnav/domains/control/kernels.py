"""Compiled loops of the caster: rays through sensors' pixels, met by shapes, lit, and averaged per receptor.

All in one file, so that the compiler's cache sees every change. Each ray is computed by itself, in float64 and in one
order, so a reading never depends on the batch, the order or the number of threads. Everything about a shape happens in
its own frame, where spheres, capsules, cylinders and ellipsoids are centred and upright and planes lie at z = 0.

Letters: o a ray's origin, d its direction (1 long along the optical axis, so that its parameter t is the depth), q the
place it meets, n a normal. Rows of ``view`` hold, per shape, a sensor in the shape's frame: 0-2 origin, 3-5 right and
6-8 up as long as half the image is wide, 9-11 forward, 12 the least depth. Rows of ``facet`` hold what light is
computed at: 0 weight, 1-3 place, 4-6 normal.
"""

from __future__ import annotations

import numpy as np
from numba import njit

PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6

ALL_LIGHTS, FIRST_PASS = -2, -1
"""Which lights shine: all; those that cast no shadow; or, from 0, one of them alone."""

BEHIND_ALPHA = 0.3
"""Factor on the opacity of a plane seen from behind."""

OPAQUE = 0.995
"""Shapes of at least this opacity hide what is behind them."""

FAINT = 1e-4
"""Highlights below this share of their colour are left out."""

INF = np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def power(base, exponent):
    """Power with the usual case, a whole exponent, by squaring."""
    whole = int(exponent)
    if whole != exponent or whole > 1024 or whole < 0:
        return base**exponent
    result = 1.0
    while whole > 0:
        if whole & 1:
            result *= base
        base *= base
        whole >>= 1
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _enter_quadric(a, b, c):
    """Smaller root of a t^2 + 2 b t + c, inf if there is none."""
    disc = b * b - a * c
    if disc < 0.0 or a <= 0.0:
        return INF
    return (-b - np.sqrt(disc)) / a


@njit(cache=True, nogil=True, error_model="numpy")
def enter(kind, sx, sy, sz, ox, oy, oz, dx, dy, dz):
    """Ray parameter where a ray enters a closed shape, or meets a plane within its borders; inf if it does not.

    It may be negative. A ray that starts inside a shape has entered it before: t < 0. Faces seen from inside are
    culled, so nothing else counts.
    """
    if kind == PLANE:
        if dz == 0.0:
            return INF
        t = -oz / dz
        if abs(ox + t * dx) > sx or abs(oy + t * dy) > sy:
            return INF
        return t
    if kind == SPHERE:
        return _enter_quadric(
            dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - sx * sx
        )
    if kind == CAPSULE:
        a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - sx * sx
        if a > 0.0:
            disc = b * b - a * c
            if disc < 0.0:
                return INF
            t = (-b - np.sqrt(disc)) / a
            z = oz + t * dz
            if abs(z) <= sy:
                return t
            oz -= sy if z > 0.0 else -sy
        else:
            if c > 0.0:
                return INF
            oz -= sy if dz < 0.0 else -sy
        return _enter_quadric(a + dz * dz, b + oz * dz, ox * ox + oy * oy + oz * oz - sx * sx)
    if kind == ELLIPSOID:
        ox, oy, oz, dx, dy, dz = ox / sx, oy / sy, oz / sz, dx / sx, dy / sy, dz / sz
        return _enter_quadric(
            dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - 1.0
        )
    near, far = -INF, INF
    if kind == CYLINDER:
        a, b, c = dx * dx + dy * dy, ox * dx + oy * dy, ox * ox + oy * oy - sx * sx
        disc = b * b - a * c
        if a > 0.0:
            if disc < 0.0:
                return INF
            root = np.sqrt(disc)
            near, far = (-b - root) / a, (-b + root) / a
        elif c > 0.0:
            return INF
        sz = sy
    else:
        for axis in range(2):
            o, d, s = (ox, dx, sx) if axis == 0 else (oy, dy, sy)
            if d != 0.0:
                middle, half = -o / d, s / abs(d)
                near, far = max(near, middle - half), min(far, middle + half)
            elif abs(o) > s:
                return INF
    if dz != 0.0:
        middle, half = -oz / dz, sz / abs(dz)
        near, far = max(near, middle - half), min(far, middle + half)
    elif abs(oz) > sz:
        return INF
    return near if near < far else INF


@njit(cache=True, nogil=True, error_model="numpy")
def normal(kind, sx, sy, sz, x, y, z):
    """Outward normal of a shape at a place on its surface."""
    if kind == PLANE:
        return 0.0, 0.0, 1.0
    if kind == CAPSULE:
        z -= min(max(z, -sy), sy)
    elif kind == ELLIPSOID:
        x, y, z = x / (sx * sx), y / (sy * sy), z / (sz * sz)
    elif kind == CYLINDER:
        top = abs(z) - sy > np.sqrt(x * x + y * y) - sx
        x, y, z = (0.0, 0.0, z) if top else (x, y, 0.0)
    elif kind == BOX:
        u, v, w = abs(x) - sx, abs(y) - sy, abs(z) - sz
        if u >= v and u >= w:
            y, z = 0.0, 0.0
        elif v >= w:
            x, z = 0.0, 0.0
        else:
            x, y = 0.0, 0.0
    length = np.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


@njit(cache=True, nogil=True, error_model="numpy")
def _cell(x, half, width, whole):
    """Borders of the cell of a plane's grid in which x lies."""
    if x < -whole:
        return -half, -whole
    if x >= whole:
        return whole, half
    low = np.floor((x + whole) / width) * width - whole
    return low, low + width


@njit(cache=True, nogil=True, error_model="numpy")
def fill_facet(shape, x, y, z, facet):
    """Write where light is computed for a place of a shape into ``facet``; how many rows."""
    if shape.kind != PLANE:
        facet[0, 0], facet[0, 1], facet[0, 2], facet[0, 3] = 1.0, x, y, z
        facet[0, 4], facet[0, 5], facet[0, 6] = normal(shape.kind, shape.sx, shape.sy, shape.sz, x, y, z)
        return 1
    x0, x1 = _cell(x, shape.sx, shape.cell_x, shape.whole_x)
    y0, y1 = _cell(y, shape.sy, shape.cell_y, shape.whole_y)
    u, v = (x - x0) / (x1 - x0), (y - y0) / (y1 - y0)
    # the cell is cut from (x0, y1) to (x1, y0)
    facet[1, 1], facet[1, 2] = x1, y0
    facet[2, 1], facet[2, 2] = x0, y1
    if u + v <= 1.0:
        facet[0, 1], facet[0, 2] = x0, y0
        facet[0, 0], facet[1, 0], facet[2, 0] = 1.0 - u - v, u, v
    else:
        facet[0, 1], facet[0, 2] = x1, y1
        facet[0, 0], facet[1, 0], facet[2, 0] = u + v - 1.0, 1.0 - v, 1.0 - u
    for row in range(3):
        facet[row, 3], facet[row, 4], facet[row, 5], facet[row, 6] = 0.0, 0.0, 0.0, 1.0
    return 3


@njit(cache=True, nogil=True, error_model="numpy")
def lit(shape, lights, group, beams, s, facet, count, ex, ey, ez, factor):
    """Colour of a place of a shape in the light of ``group``, without its texture: OpenGL's vertex lighting.

    Args:
        shape: what is lit.
        lights: what shines.
        group: lights that count.
        beams: lights in the shapes' frames, (S, L + 1, 6): place, or direction to it, and axis.
        s: the shape's number.
        facet: vertices around the place.
        count: how many.
        ex: eye in the shape's frame, as ey and ez.
        factor: on the shape's own colour, not on its highlights.
    """
    red, green, blue = 0.0, 0.0, 0.0
    own_r, own_g, own_b = shape.red * factor, shape.green * factor, shape.blue * factor
    first, last = (0, len(lights)) if group < 0 else (group, group + 1)
    for row in range(count):
        px, py, pz = facet[row, 1], facet[row, 2], facet[row, 3]
        nx, ny, nz = facet[row, 4], facet[row, 5], facet[row, 6]
        vx, vy, vz = ex - px, ey - py, ez - pz
        length = np.sqrt(vx * vx + vy * vy + vz * vz)
        if length > 0.0:
            vx, vy, vz = vx / length, vy / length, vz / length
        dr = dg = db = shape.emission if group < 0 else 0.0
        sr, sg, sb = 0.0, 0.0, 0.0
        for number in range(first, last):
            light = lights[number]
            if group == FIRST_PASS and light.shadows:
                continue
            strength = 1.0
            lx, ly, lz = beams[s, number, 0], beams[s, number, 1], beams[s, number, 2]
            if not light.directional:
                lx, ly, lz = lx - px, ly - py, lz - pz
                away = np.sqrt(lx * lx + ly * ly + lz * lz)
                lx, ly, lz = lx / away, ly / away, lz / away
                along = -(lx * beams[s, number, 3] + ly * beams[s, number, 4] + lz * beams[s, number, 5])
                if along < light.cutoff:
                    continue
                strength = power(max(along, 0.0), light.exponent) if light.cutoff >= -1.0 else 1.0
                strength /= light.attenuation0 + away * (light.attenuation1 + away * light.attenuation2)
            facing = nx * lx + ny * ly + nz * lz
            diffuse = max(facing, 0.0)
            dr += strength * (light.ambient_r + diffuse * light.diffuse_r)
            dg += strength * (light.ambient_g + diffuse * light.diffuse_g)
            db += strength * (light.ambient_b + diffuse * light.diffuse_b)
            if facing > 0.0 and shape.gloss > 0.0:
                bx, by, bz = lx + vx, ly + vy, lz + vz
                across = nx * bx + ny * by + nz * bz
                if across > 0.0:
                    shine = power(across / np.sqrt(bx * bx + by * by + bz * bz), shape.exponent)
                    if shine > FAINT:
                        shine *= strength * shape.gloss
                        sr += shine * light.specular_r
                        sg += shine * light.specular_g
                        sb += shine * light.specular_b
        weight = facet[row, 0]
        red += weight * min(dr * own_r + sr, 1.0)
        green += weight * min(dg * own_g + sg, 1.0)
        blue += weight * min(db * own_b + sb, 1.0)
    return red, green, blue


@njit(cache=True, nogil=True, error_model="numpy")
def _texel(textures, texture, level, u, v, plane, face):
    """Bilinear reading of one level, 0 to 255: repeated on planes, held at the border of a cube's faces."""
    start, width, height = textures.table[texture, level]
    x, y = u * width - 0.5, v * height - 0.5
    left, top = int(np.floor(x)), int(np.floor(y))
    fx, fy = x - left, y - top
    if plane:
        x0, y0 = left % width, top % height
        x1, y1 = x0 + 1, y0 + 1
        x1, y1 = 0 if x1 == width else x1, 0 if y1 == height else y1
    else:
        start += face * 3 * width * width
        x0, x1 = min(max(left, 0), width - 1), min(max(left + 1, 0), width - 1)
        y0, y1 = min(max(top, 0), height - 1), min(max(top + 1, 0), height - 1)
    a, b = start + 3 * (y0 * width + x0), start + 3 * (y0 * width + x1)
    c, d = start + 3 * (y1 * width + x0), start + 3 * (y1 * width + x1)
    wa, wb, wc, wd = (1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy
    texels = textures.texels
    return (
        wa * texels[a] + wb * texels[b] + wc * texels[c] + wd * texels[d],
        wa * texels[a + 1] + wb * texels[b + 1] + wc * texels[c + 1] + wd * texels[d + 1],
        wa * texels[a + 2] + wb * texels[b + 2] + wc * texels[c + 2] + wd * texels[d + 2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _sample(textures, texture, u, v, texels, plane, face):
    """Colour 0 to 1 of a texture at (u, v), for a footprint that many texels wide."""
    level = min(max(np.log2(max(texels, 1e-30)), 0.0), textures.count[texture] - 1.0)
    fine = min(int(level), textures.count[texture] - 1)
    share = level - fine
    r, g, b = _texel(textures, texture, fine, u, v, plane, face)
    if share > 0.0:
        r2, g2, b2 = _texel(textures, texture, fine + 1, u, v, plane, face)
        r, g, b = r + share * (r2 - r), g + share * (g2 - g), b + share * (b2 - b)
    return r / 255.0, g / 255.0, b / 255.0


@njit(cache=True, nogil=True, error_model="numpy")
def sky_color(textures, sky, dx, dy, dz, pixel):
    """Colour of the sky in a direction of the world, for pixels ``pixel`` wide at distance 1."""
    if sky < 0:
        return 0.0, 0.0, 0.0
    x, y, z = dx, dz, -dy  # the cube's y is up
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, major, s, t = (0, ax, -z, -y) if x > 0.0 else (1, ax, z, -y)
    elif ay >= az:
        face, major, s, t = (2, ay, x, z) if y > 0.0 else (3, ay, x, -z)
    else:
        face, major, s, t = (4, az, x, -y) if z > 0.0 else (5, az, -x, -y)
    width = textures.table[sky, 0, 1]
    texels = 0.5 * width * pixel / (major * np.sqrt(major))
    return _sample(textures, sky, 0.5 + 0.5 * s / major, 0.5 + 0.5 * t / major, texels, False, face)


@njit(cache=True, nogil=True, error_model="numpy")
def _texture(shape, textures, x, y, width):
    """Colour of a plane's texture at (x, y) for a footprint ``width`` [m] wide; white where there is none."""
    if shape.texture < 0:
        return 1.0, 1.0, 1.0
    _, wide, high = textures.table[shape.texture, 0]
    texels = width * np.sqrt(abs(shape.u * wide * shape.v * high))
    u, v = shape.u * x + shape.u0, shape.v * y + shape.v0
    return _sample(textures, shape.texture, u - np.floor(u), v - np.floor(v), texels, True, 0)


@njit(cache=True, nogil=True, error_model="numpy")
def _meets(shapes, poses, s, ray):
    """Where a ray of the world enters shape s; inf if it does not."""
    shape = shapes[s]
    dx, dy, dz = ray[3], ray[4], ray[5]
    cx, cy, cz = poses[s, 0] - ray[0], poses[s, 1] - ray[1], poses[s, 2] - ray[2]
    along = cx * dx + cy * dy + cz * dz
    away = cx * cx + cy * cy + cz * cz - along * along
    if along < -shape.bound or away > shape.bound * shape.bound:
        return INF
    m = poses[s]
    return enter(
        shape.kind,
        shape.sx,
        shape.sy,
        shape.sz,
        -(m[3] * cx + m[6] * cy + m[9] * cz),
        -(m[4] * cx + m[7] * cy + m[10] * cz),
        -(m[5] * cx + m[8] * cy + m[11] * cz),
        m[3] * dx + m[6] * dy + m[9] * dz,
        m[4] * dx + m[7] * dy + m[10] * dz,
        m[5] * dx + m[8] * dy + m[11] * dz,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _plainly_lit(scene, poses, beams, facet, s, ray, t, factor):
    """Colour where a ray of the world meets shape s at t: lit by all lights, without shadows."""
    shape, m = scene.shapes[s], poses[s]
    x, y, z = ray[0] + t * ray[3] - m[0], ray[1] + t * ray[4] - m[1], ray[2] + t * ray[5] - m[2]
    x, y, z = m[3] * x + m[6] * y + m[9] * z, m[4] * x + m[7] * y + m[10] * z, m[5] * x + m[8] * y + m[11] * z
    ex, ey, ez = ray[6] - m[0], ray[7] - m[1], ray[8] - m[2]
    ex, ey, ez = m[3] * ex + m[6] * ey + m[9] * ez, m[4] * ex + m[7] * ey + m[10] * ez, m[5] * ex + m[8] * ey + m[11] * ez
    count = fill_facet(shape, x, y, z, facet)
    red, green, blue = lit(shape, scene.lights, ALL_LIGHTS, beams, s, facet, count, ex, ey, ez, factor)
    if shape.texture >= 0:
        slope = abs(m[5] * ray[3] + m[8] * ray[4] + m[11] * ray[5])
        r, g, b = _texture(shape, scene.textures, x, y, ray[9] * (ray[10] + t) / np.sqrt(slope))
        red, green, blue = red * r, green * g, blue * b
    return red, green, blue


@njit(cache=True, nogil=True, error_model="numpy")
def _veiled(scene, poses, beams, facet, veils, count, alphas, layers, ray, t0, t1, mirror, factor, red, green, blue):
    """A colour seen through the transparent shapes that a ray of the world meets between t0 and t1.

    They are blended twice, front to back and back to front, as the recorded renderer does.
    """
    for i in range(count):
        s = veils[i]
        layers[i, 3] = 0.0
        if s == mirror:
            continue
        t = _meets(scene.shapes, poses, s, ray)
        if t0 <= t < t1 and _is_seen(scene.shapes[s], poses[s], ray, alphas[s]):
            layers[i, 0], layers[i, 1], layers[i, 2] = _plainly_lit(
                scene, poses, beams, facet, s, ray, t, factor
            )
            layers[i, 3] = abs(alphas[s])
    for k in range(2 * count):
        i = k if k < count else 2 * count - 1 - k
        alpha = layers[i, 3]
        red += alpha * (layers[i, 0] - red)
        green += alpha * (layers[i, 1] - green)
        blue += alpha * (layers[i, 2] - blue)
    return red, green, blue


@njit(cache=True, nogil=True, error_model="numpy")
def _is_seen(shape, m, ray, alpha):
    """Whether the side of a plane that a ray meets is drawn; ``alpha`` is negative where the eye is behind it."""
    if shape.kind != PLANE:
        return True
    return (m[5] * ray[3] + m[8] * ray[4] + m[11] * ray[5] > 0.0) == (alpha < 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _holds(shape, m, ray):
    """Whether the place from which a ray of the world starts lies inside a shape."""
    x, y, z = ray[0] - m[0], ray[1] - m[1], ray[2] - m[2]
    x, y, z = m[3] * x + m[6] * y + m[9] * z, m[4] * x + m[7] * y + m[10] * z, m[5] * x + m[8] * y + m[11] * z
    if shape.kind == PLANE:
        return False
    if shape.kind == CYLINDER:
        return x * x + y * y < shape.sx * shape.sx and abs(z) < shape.sy
    if shape.kind == BOX:
        return abs(x) < shape.sx and abs(y) < shape.sy and abs(z) < shape.sz
    if shape.kind == ELLIPSOID:
        x, y, z = x / shape.sx, y / shape.sy, z / shape.sz
        return x * x + y * y + z * z < 1.0
    if shape.kind == CAPSULE:
        z -= min(max(z, -shape.sy), shape.sy)
    return x * x + y * y + z * z < shape.sx * shape.sx


@njit(cache=True, nogil=True, error_model="numpy")
def _is_shadowed(shapes, lights, poses, lamps, number, s, ray, px, py, pz):
    """Whether something stands between a place of the world on shape s and a light."""
    light = lights[number]
    lamp = lamps[number]
    lx, ly, lz = lamp[0] - px, lamp[1] - py, lamp[2] - pz
    # the shadow map is a square around the light's axis
    side, up = lx * lamp[6] + ly * lamp[7] + lz * lamp[8], lx * lamp[9] + ly * lamp[10] + lz * lamp[11]
    if light.directional:
        width = light.reach
        lx, ly, lz = -lamp[3], -lamp[4], -lamp[5]
        away = INF
    else:
        width = -light.reach * (lx * lamp[3] + ly * lamp[4] + lz * lamp[5])
        away = np.sqrt(lx * lx + ly * ly + lz * lz)
        lx, ly, lz = lx / away, ly / away, lz / away
    if abs(side) > width or abs(up) > width:
        return False
    ray[0], ray[1], ray[2], ray[3], ray[4], ray[5] = px, py, pz, lx, ly, lz
    for other in range(len(shapes)):
        if other == s or not shapes[other].casts:
            continue
        t = _meets(shapes, poses, other, ray)
        if 0.0 < t < away or (t <= 0.0 and _holds(shapes[other], poses[other], ray)):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _reflected(scene, poses, beams, facet, veils, veil_count, alphas, layers, s, ray, view, t, x, y, length, pixel):
    """Light that a mirror, plane s, adds where a ray meets it at (x, y): the images of the other shapes.

    They are lit as they stand, by all lights and without shadows, and seen from the mirrored eye; the sky has none.
    ``ray`` is the ray in the world with d of length 1, ``length`` that of d before.
    """
    m = poses[s]
    nx, ny, nz = m[5], m[8], m[11]
    height = view[s, 2]
    down = nx * ray[3] + ny * ray[4] + nz * ray[5]
    ray[6], ray[7], ray[8] = ray[0] - 2.0 * height * nx, ray[1] - 2.0 * height * ny, ray[2] - 2.0 * height * nz
    ray[0] = m[0] + m[3] * x + m[4] * y
    ray[1] = m[1] + m[6] * x + m[7] * y
    ray[2] = m[2] + m[9] * x + m[10] * y
    ray[3], ray[4], ray[5] = ray[3] - 2.0 * down * nx, ray[4] - 2.0 * down * ny, ray[5] - 2.0 * down * nz
    ray[9], ray[10] = pixel / (length * np.sqrt(length)), t * length
    best, nearest = -1, INF
    for other in range(len(scene.shapes)):
        if other != s and abs(alphas[other]) >= OPAQUE:
            at = _meets(scene.shapes, poses, other, ray)
            if 0.0 < at < nearest and _is_seen(scene.shapes[other], poses[other], ray, alphas[other]):
                best, nearest = other, at
    red, green, blue = 0.0, 0.0, 0.0
    factor = scene.shapes[s].reflectance
    if best >= 0:
        red, green, blue = _plainly_lit(scene, poses, beams, facet, best, ray, nearest, factor)
    if veil_count > 0:
        red, green, blue = _veiled(
            scene, poses, beams, facet, veils, veil_count, alphas, layers, ray, 0.0, nearest, s, factor, red, green, blue
        )
    return red, green, blue


@njit(cache=True, nogil=True, error_model="numpy")
def _ray_color(scene, work, order, seen, veil_count, mirror, sensor, a, b, pixel):
    """Colour of the ray through the point (a, b) of a sensor's image, both -1 to 1, right and up."""
    view, poses, beams, facet, ray, alphas = work.views, work.poses, work.beams, work.facet, work.ray, work.alphas
    best, nearest = -1, scene.far
    for i in range(seen):
        s = order[i]
        if view[s, 12] > nearest:
            break
        shape = scene.shapes[s]
        dx = view[s, 9] + a * view[s, 3] + b * view[s, 6]
        dy = view[s, 10] + a * view[s, 4] + b * view[s, 7]
        dz = view[s, 11] + a * view[s, 5] + b * view[s, 8]
        t = enter(shape.kind, shape.sx, shape.sy, shape.sz, view[s, 0], view[s, 1], view[s, 2], dx, dy, dz)
        if scene.near <= t < nearest:
            best, nearest = s, t
    wx = sensor[9] + a * sensor[3] + b * sensor[6]
    wy = sensor[10] + a * sensor[4] + b * sensor[7]
    wz = sensor[11] + a * sensor[5] + b * sensor[8]
    length = np.sqrt(wx * wx + wy * wy + wz * wz)
    if best < 0:
        red, green, blue = sky_color(scene.textures, scene.sky, wx, wy, wz, pixel)
    else:
        s, shape, t = best, scene.shapes[best], nearest
        ox, oy, oz = view[s, 0], view[s, 1], view[s, 2]
        dz = view[s, 11] + a * view[s, 5] + b * view[s, 8]
        x = ox + t * (view[s, 9] + a * view[s, 3] + b * view[s, 6])
        y = oy + t * (view[s, 10] + a * view[s, 4] + b * view[s, 7])
        z = oz + t * dz
        count = fill_facet(shape, x, y, z, facet)
        red, green, blue = lit(shape, scene.lights, FIRST_PASS, beams, s, facet, count, ox, oy, oz, 1.0)
        for number in range(1, len(scene.lights)):
            if scene.lights[number].shadows:
                r, g, b2 = lit(shape, scene.lights, number, beams, s, facet, count, ox, oy, oz, 1.0)
                if r + g + b2 > 0.0:
                    px, py, pz = sensor[0] + t * wx, sensor[1] + t * wy, sensor[2] + t * wz
                    if not _is_shadowed(scene.shapes, scene.lights, poses, work.lamps, number, s, ray, px, py, pz):
                        red, green, blue = red + r, green + g, blue + b2
        if shape.texture >= 0:
            r, g, b2 = _texture(shape, scene.textures, x, y, pixel * t / np.sqrt(abs(dz)))
            red, green, blue = red * r, green * g, blue * b2
        if s == mirror:
            ray[0], ray[1], ray[2] = sensor[0], sensor[1], sensor[2]
            ray[3], ray[4], ray[5] = wx / length, wy / length, wz / length
            r, g, b2 = _reflected(
                scene, poses, beams, facet, work.veils, veil_count, alphas, work.layers, s, ray, view, t, x, y, length, pixel
            )
            red, green, blue = red + r, green + g, blue + b2
        red, green, blue = min(red, 1.0), min(green, 1.0), min(blue, 1.0)
    if veil_count > 0:
        ray[0], ray[1], ray[2] = sensor[0], sensor[1], sensor[2]
        ray[3], ray[4], ray[5] = wx / length, wy / length, wz / length
        ray[6], ray[7], ray[8] = sensor[0], sensor[1], sensor[2]
        ray[9], ray[10] = pixel / (length * np.sqrt(length)), 0.0
        red, green, blue = _veiled(
            scene, poses, beams, facet, work.veils, veil_count, alphas, work.layers, ray,
            scene.near * length, nearest * length, -1, 1.0, red, green, blue,
        )  # fmt: skip
    return red, green, blue


@njit(cache=True, nogil=True, error_model="numpy")
def _place_shapes(scene, geom_xpos, geom_xmat, site_xpos, site_xmat, light_xpos, light_xdir, n, work):
    """Write poses of shapes and lights in state n; whether all of them are finite."""
    total = 0.0
    for s in range(len(scene.shapes)):
        index = scene.shapes[s].index
        xpos, xmat = (site_xpos, site_xmat) if scene.shapes[s].site else (geom_xpos, geom_xmat)
        for k in range(3):
            work.poses[s, k] = xpos[n, index, k]
            total += xpos[n, index, k]
        for k in range(9):
            work.poses[s, 3 + k] = xmat[n, index, k]
            total += xmat[n, index, k]
    for number in range(1, len(scene.lights)):
        lamp, index = work.lamps[number], scene.lights[number].index
        for k in range(3):
            lamp[k], lamp[3 + k] = light_xpos[n, index, k], light_xdir[n, index, k]
            total += lamp[k] + lamp[3 + k]
        dx, dy, dz = lamp[3], lamp[4], lamp[5]
        # any two axes across the light's own; the renderer's shadow map has these
        ux, uy, uz = (0.0, -dz, dy) if dy * dy + dz * dz > 0.01 else (-dz, 0.0, dx)
        size = np.sqrt(ux * ux + uy * uy + uz * uz)
        lamp[9], lamp[10], lamp[11] = ux / size, uy / size, uz / size
        lamp[6], lamp[7], lamp[8] = (
            dy * lamp[11] - dz * lamp[10],
            dz * lamp[9] - dx * lamp[11],
            dx * lamp[10] - dy * lamp[9],
        )
        for s in range(len(scene.shapes)):
            m, beam = work.poses[s], work.beams[s, number]
            if scene.lights[number].directional:
                x, y, z = -dx, -dy, -dz
            else:
                x, y, z = lamp[0] - m[0], lamp[1] - m[1], lamp[2] - m[2]
            for k in range(3):
                beam[k] = m[3 + k] * x + m[6 + k] * y + m[9 + k] * z
                beam[3 + k] = m[3 + k] * dx + m[6 + k] * dy + m[9 + k] * dz
    return np.isfinite(total)


@njit(cache=True, nogil=True, error_model="numpy")
def _face_shapes(scene, work, sensor, half):
    """Write the shapes as a sensor sees them; how many may be seen, how many are transparent, and the mirror or -1.

    The former come first in ``work.order``, by their least depth; the latter in ``work.veils``, as they are blended.
    """
    cosine = 1.0 / np.sqrt(1.0 + half * half)
    sine = half * cosine
    seen, veiled, mirror = 0, 0, -1
    for s in range(len(scene.shapes)):
        shape, m, row = scene.shapes[s], work.poses[s], work.views[s]
        x, y, z = sensor[0] - m[0], sensor[1] - m[1], sensor[2] - m[2]
        for k in range(3):
            row[k] = m[3 + k] * x + m[6 + k] * y + m[9 + k] * z
            for axis in range(3, 12, 3):
                row[axis + k] = m[3 + k] * sensor[axis] + m[6 + k] * sensor[axis + 1] + m[9 + k] * sensor[axis + 2]
            work.beams[s, 0, k] = -row[9 + k]
        flat = shape.kind == PLANE
        alpha = shape.alpha
        if flat and row[2] < 0.0:
            alpha *= -BEHIND_ALPHA
        work.alphas[s] = alpha
        if abs(alpha) < OPAQUE:
            away = 1e10 if flat else np.sqrt(x * x + y * y + z * z) - shape.bound
            at = veiled
            while at > 0 and work.depths[work.veils[at - 1]] > away:
                work.veils[at] = work.veils[at - 1]
                at -= 1
            work.veils[at] = s
            work.depths[s] = away
            veiled += 1
            continue
        if mirror < 0 and flat and shape.reflectance > 0.0:
            mirror = s
        depth = -(x * sensor[9] + y * sensor[10] + z * sensor[11])
        right = -(x * sensor[3] + y * sensor[4] + z * sensor[5]) / half
        up = -(x * sensor[6] + y * sensor[7] + z * sensor[8]) / half
        bound = shape.bound
        if depth + bound < scene.near or max(abs(right), abs(up)) * cosine - depth * sine > bound:
            continue
        row[12] = depth - bound
        at = seen
        while at > 0 and work.views[work.order[at - 1], 12] > row[12]:
            work.order[at] = work.order[at - 1]
            at -= 1
        work.order[at] = s
        seen += 1
    return seen, veiled, mirror


@njit(cache=True, nogil=True, error_model="numpy")
def read_states(
    scene, work, geom_xpos, geom_xmat, site_xpos, site_xmat, light_xpos, light_xdir, places, axes, halves,
    offsets, weights, grid, start, stop, out,
):  # fmt: skip
    """Readings of K sensors in states ``start`` to ``stop`` of N, into ``out`` (N, K, grid, grid, 3).

    Args:
        scene: what is seen.
        work: room for what is computed on the way.
        geom_xpos: places of the geoms (N, G, 3); geom_xmat their axes (N, G, 9); likewise for sites and lights.
        places: sensors' places in the world (N, K, 3).
        axes: their axes: columns right, up and back (N, K, 3, 3).
        halves: tangents of half their fields of view (N, K).
        offsets: where rays meet a receptor's patch (R, 2), see prnav.render.sampling.
        weights: how much they count (R,), 1 in the mean.
        grid: receptors per row.
        start: first state.
        stop: state behind the last.
        out: readings; 0 where a pose is not finite.
    """
    rays = len(offsets)
    pixel_share = 2.0 / (grid * np.sqrt(rays))
    sensor = work.sensor
    for n in range(start, stop):
        finite = _place_shapes(scene, geom_xpos, geom_xmat, site_xpos, site_xmat, light_xpos, light_xdir, n, work)
        for k in range(places.shape[1]):
            half = halves[n, k]
            total = half
            for j in range(3):
                sensor[j] = places[n, k, j]
                sensor[3 + j], sensor[6 + j], sensor[9 + j] = (
                    half * axes[n, k, j, 0],
                    half * axes[n, k, j, 1],
                    -axes[n, k, j, 2],
                )
                total += sensor[j] + sensor[3 + j] + sensor[6 + j] + sensor[9 + j]
            if not (finite and np.isfinite(total)):
                for row in range(grid):
                    for column in range(grid):
                        for channel in range(3):
                            out[n, k, row, column, channel] = 0.0
                continue
            seen, veiled, mirror = _face_shapes(scene, work, sensor, half)
            pixel = half * pixel_share
            for row in range(grid):
                for column in range(grid):
                    red, green, blue = 0.0, 0.0, 0.0
                    for i in range(rays):
                        a = (column + offsets[i, 0]) * (2.0 / grid) - 1.0
                        b = 1.0 - (row + offsets[i, 1]) * (2.0 / grid)
                        r, g, b2 = _ray_color(scene, work, work.order, seen, veiled, mirror, sensor, a, b, pixel)
                        red += weights[i] * r
                        green += weights[i] * g
                        blue += weights[i] * b2
                    out[n, k, row, column, 0] = red / rays
                    out[n, k, row, column, 1] = green / rays
                    out[n, k, row, column, 2] = blue / rays
