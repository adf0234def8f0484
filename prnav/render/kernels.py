"""Compiled loops of the CPU engine: rays of a range of pixels, and their shading into patch means.

All in one file, so that the compiler's cache sees every change. Float32 throughout, one ray after another, so a
reading never depends on the batch it is computed in.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SPHERE = -2
"""Stands for a triangle's number where a ray met a sphere; -1 where it met nothing."""

LEVEL_BIAS = 0.5
"""Factor on the covered texels before the level is chosen: 0.5 rounds to the nearest level, 1 up, 0.25 down."""


@njit(cache=True, nogil=True, error_model="numpy")
def fill_rays(origin, right, up, forward, grid, side, offsets, start, ray_origin, ray_direction):
    """Write the rays ``start ...`` into (n, 3) float32 arrays.

    Rays are counted over views, then patches row by row, then a patch's offsets: rays that are neighbours in time are
    neighbours in space, and a patch's rays come together. With side 1 they are the pixels of a picture, row by row.
    """
    step = 2.0 / grid
    count = side * side
    view, patch, k = start // (grid * grid * count), start // count % (grid * grid), start % count
    for i in range(len(ray_origin)):
        a = (patch % grid + offsets[k, 0]) * step - 1.0
        b = 1.0 - (patch // grid + offsets[k, 1]) * step
        for axis in range(3):
            ray_origin[i, axis] = origin[view, axis]
            ray_direction[i, axis] = forward[view, axis] + a * right[view, axis] + b * up[view, axis]
        k += 1
        if k == count:
            k = 0
            patch += 1
            if patch == grid * grid:
                patch = 0
                view += 1


@njit(cache=True, nogil=True, error_model="numpy")
def fill_surfaces(vertices, faces, uvs, face_texture, colors, table, coarsest, surfaces):
    """Write what shading needs of each triangle into its record; see :data:`prnav.render.surfaces.SURFACE`."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        row = face_texture[f]
        u1, v1 = uvs[b, 0] - uvs[a, 0], uvs[b, 1] - uvs[a, 1]
        u2, v2 = uvs[c, 0] - uvs[a, 0], uvs[c, 1] - uvs[a, 1]
        s = surfaces[f]
        # whole turns of a repeated texture are dropped: they would only cost digits
        s.u = uvs[a, 0] - np.floor(uvs[a, 0])
        s.v = uvs[a, 1] - np.floor(uvs[a, 1])
        s.u1, s.v1, s.u2, s.v2 = u1, v1, u2, v2
        texels = abs(np.float64(u1) * v2 - np.float64(u2) * v1) * table[row, 1] * table[row, 2]
        x1 = np.float64(vertices[b, 0]) - vertices[a, 0]
        y1 = np.float64(vertices[b, 1]) - vertices[a, 1]
        z1 = np.float64(vertices[b, 2]) - vertices[a, 2]
        x2 = np.float64(vertices[c, 0]) - vertices[a, 0]
        y2 = np.float64(vertices[c, 1]) - vertices[a, 1]
        z2 = np.float64(vertices[c, 2]) - vertices[a, 2]
        nx, ny, nz = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
        s.texels = texels
        s.density = texels / max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-30)
        s.offset, s.width, s.height = table[row, 0], table[row, 1], table[row, 2]
        s.coarsest = coarsest[f]
        s.color0 = colors[a, 0] | colors[a, 1] << 8 | colors[a, 2] << 16
        s.color1 = colors[b, 0] | colors[b, 1] << 8 | colors[b, 2] << 16
        s.color2 = colors[c, 0] | colors[c, 1] << 8 | colors[c, 2] << 16
        white = 0xFFFFFF
        s.tinted = 0 if s.color0 == white and s.color1 == white and s.color2 == white else 1


@njit(cache=True, nogil=True, error_model="numpy")
def hit_spheres(start, rays_per_view, spheres, origin, direction, triangle, depth):
    """Where a ray meets its view's sphere (M, 4) first, write the depth there and ``SPHERE`` for the triangle.

    From inside, a sphere is seen from inside. A radius of 0 is no sphere.
    """
    for i in range(len(triangle)):
        view = (start + i) // rays_per_view
        radius = spheres[view, 3]
        if radius <= 0.0:
            continue
        length = along = apart = 0.0
        for axis in range(3):
            offset = spheres[view, axis] - origin[view, axis]
            d = np.float64(direction[i, axis])
            length += d * d
            along += d * offset
            apart += offset * offset
        discriminant = along * along - length * (apart - radius * radius)
        if discriminant < 0.0:
            continue
        root = np.sqrt(discriminant)
        t = along - root
        if t <= 0.0:
            t = along + root
        if t > 0.0 and t < length * depth[i]:
            depth[i] = t / length
            triangle[i] = SPHERE


@njit(cache=True, nogil=True, error_model="numpy")
def shade(
    start,
    weights,
    patches,
    pixel_area,
    direction,
    triangle,
    bary_u,
    bary_v,
    depth,
    normal,
    surfaces,
    texels,
    background,
    sphere_color,
    sums,
):
    """Add the colour (0 to 255) of each ray, times its weight, to its patch in ``sums`` (M * patches, 3).

    The texture level is the one whose texels are about as large as the ray's pixel where it meets the triangle: a
    pixel of area ``pixel_area`` (M,) on the image plane at distance 1 covers ``pixel_area t^2 / |n . d|`` of the
    surface (unit normal n, direction d of length 1 along the axis). ``normal`` (n, 3) is as long as twice the
    triangle's area.
    """
    count = len(weights)
    quarter = np.float32(0.25)
    one = np.float32(1.0)
    scale = np.float32(1.0 / 255.0)
    patch, k = start // count, start % count - 1
    area = pixel_area[patch // patches]
    target = sums[patch]
    for i in range(len(triangle)):
        k += 1
        if k == count:
            k = 0
            patch += 1
            target = sums[patch]
            area = pixel_area[patch // patches]
        weight = weights[k]
        f = triangle[i]
        if f == SPHERE:
            target[0] += weight * sphere_color[0]
            target[1] += weight * sphere_color[1]
            target[2] += weight * sphere_color[2]
            continue
        if f < 0:
            target[0] += weight * background[0]
            target[1] += weight * background[1]
            target[2] += weight * background[2]
            continue
        surface = surfaces[f]
        s, t = bary_u[i], bary_v[i]
        offset = int(surface.offset)
        width, height = int(surface.width), int(surface.height)
        if width * height > 1:
            u = surface.u + s * surface.u1 + t * surface.u2
            v = surface.v + s * surface.v1 + t * surface.v2
            u -= np.floor(u)
            v -= np.floor(v)
            facing = abs(
                normal[i, 0] * direction[i, 0] + normal[i, 1] * direction[i, 1] + normal[i, 2] * direction[i, 2]
            )
            covered = area * depth[i] * depth[i] * surface.texels / facing  # texels of level 0
            covered *= np.float32(LEVEL_BIAS)
            level = surface.coarsest
            while covered > one and level > 0:
                covered *= quarter
                level -= 1
                offset += width * height
                width = max(1, width >> 1)
                height = max(1, height >> 1)
            x = min(int(u * np.float32(width)), width - 1)
            y = min(int(v * np.float32(height)), height - 1)
            offset += y * width + x
        texel = texels[offset]
        red = np.float32(texel & 255)
        green = np.float32(texel >> 8 & 255)
        blue = np.float32(texel >> 16 & 255)
        if surface.tinted != 0:
            r = one - s - t
            a, b, c = surface.color0, surface.color1, surface.color2
            red *= (r * np.float32(a & 255) + s * np.float32(b & 255) + t * np.float32(c & 255)) * scale
            green *= (
                r * np.float32(a >> 8 & 255) + s * np.float32(b >> 8 & 255) + t * np.float32(c >> 8 & 255)
            ) * scale
            blue *= (
                r * np.float32(a >> 16 & 255) + s * np.float32(b >> 16 & 255) + t * np.float32(c >> 16 & 255)
            ) * scale
        target[0] += weight * red
        target[1] += weight * green
        target[2] += weight * blue
