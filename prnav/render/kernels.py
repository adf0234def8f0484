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
def face_surfaces(faces, uvs, face_texture, colors, table, coarsest, surface, tag):
    """Write what shading needs of each triangle into one record.

    surface (F, 7) float32: u, v of corner 0, differences of corners 1 and 2 to it, doubled area in texels of level 0.
    tag (F, 3) int32: row of the texture table, 1 where some corner's colour is not white, coarsest level allowed.
    """
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        row = face_texture[f]
        u1, v1 = uvs[b, 0] - uvs[a, 0], uvs[b, 1] - uvs[a, 1]
        u2, v2 = uvs[c, 0] - uvs[a, 0], uvs[c, 1] - uvs[a, 1]
        # whole turns of a repeated texture are dropped: they would only cost digits
        surface[f, 0] = uvs[a, 0] - np.floor(uvs[a, 0])
        surface[f, 1] = uvs[a, 1] - np.floor(uvs[a, 1])
        surface[f, 2], surface[f, 3], surface[f, 4], surface[f, 5] = u1, v1, u2, v2
        surface[f, 6] = abs(np.float64(u1) * v2 - np.float64(u2) * v1) * table[row, 1] * table[row, 2]
        tinted = 0
        for corner in range(3):
            for channel in range(3):
                if colors[faces[f, corner], channel] != 255:
                    tinted = 1
        tag[f, 0] = row
        tag[f, 1] = tinted
        tag[f, 2] = coarsest[f]


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
    count,
    patches,
    pixel_area,
    direction,
    triangle,
    bary_u,
    bary_v,
    depth,
    normal,
    surface,
    tag,
    faces,
    colors,
    texels,
    table,
    background,
    sphere_color,
    sums,
):
    """Add the colour (0 to 255) of each ray to its patch in ``sums`` (M * patches, 3); ``count`` rays per patch.

    The texture level is the one whose texels are about as large as the ray's pixel where it meets the triangle: a
    pixel of area ``pixel_area`` (M,) on the image plane at distance 1 covers ``pixel_area t^2 / |n . d|`` of the
    surface (unit normal n, direction d of length 1 along the axis).
    """
    quarter = np.float32(0.25)
    one = np.float32(1.0)
    scale = np.float32(1.0 / 255.0)
    for i in range(len(triangle)):
        patch = (start + i) // count
        target = sums[patch]
        area = pixel_area[patch // patches]
        f = triangle[i]
        if f == SPHERE:
            target[0] += sphere_color[0]
            target[1] += sphere_color[1]
            target[2] += sphere_color[2]
            continue
        if f < 0:
            target[0] += background[0]
            target[1] += background[1]
            target[2] += background[2]
            continue
        s, t = bary_u[i], bary_v[i]
        texture = tag[f, 0]
        offset = table[texture, 0]
        width, height = table[texture, 1], table[texture, 2]
        if width * height > 1:
            u = surface[f, 0] + s * surface[f, 2] + t * surface[f, 4]
            v = surface[f, 1] + s * surface[f, 3] + t * surface[f, 5]
            u -= np.floor(u)
            v -= np.floor(v)
            facing = abs(
                normal[i, 0] * direction[i, 0] + normal[i, 1] * direction[i, 1] + normal[i, 2] * direction[i, 2]
            )
            covered = area * depth[i] * depth[i] * surface[f, 6] / facing  # texels of level 0
            covered *= np.float32(LEVEL_BIAS)
            level = tag[f, 2]
            while covered > one and level > 0:
                covered *= quarter
                level -= 1
                offset += width * height
                width = max(1, width >> 1)
                height = max(1, height >> 1)
            x = min(np.int64(u * np.float32(width)), width - 1)
            y = min(np.int64(v * np.float32(height)), height - 1)
            offset += y * width + x
        red = np.float32(texels[offset, 0])
        green = np.float32(texels[offset, 1])
        blue = np.float32(texels[offset, 2])
        if tag[f, 1] != 0:
            r = one - s - t
            a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
            red *= (r * colors[a, 0] + s * colors[b, 0] + t * colors[c, 0]) * scale
            green *= (r * colors[a, 1] + s * colors[b, 1] + t * colors[c, 1]) * scale
            blue *= (r * colors[a, 2] + s * colors[b, 2] + t * colors[c, 2]) * scale
        target[0] += red
        target[1] += green
        target[2] += blue
