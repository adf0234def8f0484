"""Compiled loops of the CPU engine: rays are made, traced by Embree, shaded and averaged, one view after another.

All in one file, so that the compiler's cache sees every change. A view's rays come in the order of a
:class:`prnav.render.ray_table.RayTable`, so a reading never depends on the batch it is computed in.

Rays are taken eight at a time: all are traced, then shaded, so that what shading reads from memory is on its way while
the next rays are traced. Embree takes a ray as fields of float32 or int32: 0-2 origin, 3 near, 4-6 direction, 7 time,
8 far, 9 mask, 10 id, 11 flags, and back come 8 the ray parameter, 12-14 the triangle's normal, 15-16 the hit's weights
of corners 1 and 2, 17 the triangle, 18 the geometry (-1 on a miss). Eight single rays lie one after another, 24 values
apart; a packet has each field eight values wide.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import carray, njit, types
from numba.extending import intrinsic

from prnav.render.surface_record import SURFACE

PACKET = 8
"""Rays taken at a time: as many float32 as an AVX register holds."""

FIELDS = 24
"""Fields of a ray and its hit (21), rounded up so that the next ray is aligned as Embree wants it."""

SPHERE = -2
"""Stands for a triangle's number where a ray met a sphere; -1 where it met nothing."""

LEVEL_BIAS = 0.5
"""Factor on the covered texels before the level is chosen: 0.5 rounds to the nearest level, 1 up, 0.25 down."""


@njit(cache=True, nogil=True, error_model="numpy")
def fill_surfaces(vertices, faces, uvs, face_texture, colors, table, coarsest, surfaces):
    """Write what shading needs of each triangle into its record; see :data:`prnav.render.surface_record.SURFACE`."""
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


@intrinsic
def _intersect_one(typing, function, scene, ray, arguments):  # noqa: D417 (typing is the compiler's)
    """Call ``rtcIntersect1`` at an address."""

    def generate(context, builder, signature, values):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * 3)
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64, types.int64), generate


@intrinsic
def _intersect_packet(typing, function, active, scene, rays, arguments):  # noqa: D417 (typing is the compiler's)
    """Call ``rtcIntersect8`` at an address."""

    def generate(context, builder, signature, values):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * 4)
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), generate


@intrinsic
def _prefetch(typing, address):  # noqa: D417 (typing is the compiler's)
    """Ask for the cache line at an address, to be read soon."""

    def generate(context, builder, signature, values):
        pointer, flag = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer, flag, flag, flag])
        function = builder.module.declare_intrinsic("llvm.prefetch", [pointer], kind)
        builder.call(function, [builder.inttoptr(values[0], pointer), flag(0), flag(3), flag(1)])
        return context.get_dummy_value()

    return types.void(types.int64), generate


@intrinsic
def _pointer(typing, address):  # noqa: D417 (typing is the compiler's)
    """An address as a pointer, for ``carray``."""

    def generate(context, builder, signature, values):
        return builder.inttoptr(values[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.int64), generate


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sphere_depth(sphere, origin, dx, dy, dz):
    """Ray parameter at which a ray first meets a sphere (4,), inf on a miss; from inside, it is seen from inside."""
    x, y, z = sphere[0] - origin[0], sphere[1] - origin[1], sphere[2] - origin[2]
    length = dx * dx + dy * dy + dz * dz
    along = dx * x + dy * y + dz * z
    discriminant = along * along - length * (x * x + y * y + z * z - sphere[3] * sphere[3])
    if discriminant < 0.0:
        return np.inf
    root = np.sqrt(discriminant)
    t = along - root
    if t <= 0.0:
        t = along + root
    return t / length if t > 0.0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _trace(tracing, scene, records, lanes, fields, active, met, view, views, a, b, first):
    """Trace ``lanes`` rays of a view, at most ``PACKET``, from the ``first`` one of the table on, into the buffer.

    What each ray meets first goes to ``met`` (PACKET,): a triangle, ``SPHERE``, or -1 for nothing; its depth is in the
    buffer. ``records`` is the address of the triangles' records for shading, which are asked for as they are met.
    """
    intersect, packet, buffer = tracing
    origin, right, up, forward, spheres = views
    sphere = spheres[view]
    field, ray = (PACKET, 1) if packet else (1, FIELDS)
    rays = buffer.ctypes.data
    arguments = rays + 4 * FIELDS * PACKET
    for lane in range(lanes):
        x, y = a[first + lane], b[first + lane]
        at = lane * ray
        for axis in range(3):
            buffer[at + axis * field] = origin[view, axis]
            buffer[at + (4 + axis) * field] = forward[view, axis] + x * right[view, axis] + y * up[view, axis]
        buffer[at + 3 * field] = np.float32(0.0)
        buffer[at + 8 * field] = np.float32(np.inf)
        fields[at + 9 * field] = -1
        fields[at + 18 * field] = -1
        if not packet:
            _intersect_one(intersect, scene, rays + 4 * at, arguments)  # type: ignore[call-arg]
            if fields[at + 18 * field] != -1:
                _prefetch(records + 64 * np.int64(fields[at + 17 * field]))
    if packet:
        for lane in range(PACKET):
            active[lane] = -1 if lane < lanes else 0
        _intersect_packet(intersect, active.ctypes.data, scene, rays, arguments)  # type: ignore[call-arg]
    for lane in range(lanes):
        at = lane * ray
        met[lane] = -1 if fields[at + 18 * field] == -1 else fields[at + 17 * field]
        if sphere[3] > 0.0:
            dx, dy, dz = buffer[at + 4 * field], buffer[at + 5 * field], buffer[at + 6 * field]
            ball = _sphere_depth(sphere, origin[view], np.float64(dx), np.float64(dy), np.float64(dz))
            if ball < buffer[at + 8 * field]:
                buffer[at + 8 * field] = ball
                met[lane] = SPHERE


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _texel_of(surface, s, t, covered):
    """Texel of a triangle at the corner weights s and t, of the level whose texels are about as large as the pixel.

    ``covered`` are the texels of level 0 within the ray's pixel, times :data:`LEVEL_BIAS`.
    """
    offset = int(surface.offset)
    width, height = int(surface.width), int(surface.height)
    if width * height > 1:
        u = surface.u + s * surface.u1 + t * surface.u2
        v = surface.v + s * surface.v1 + t * surface.v2
        u -= np.floor(u)
        v -= np.floor(v)
        level = surface.coarsest
        while covered > np.float32(1.0) and level > 0:
            covered *= np.float32(0.25)
            level -= 1
            offset += width * height
            width = max(1, width >> 1)
            height = max(1, height >> 1)
        x = min(int(u * np.float32(width)), width - 1)
        y = min(int(v * np.float32(height)), height - 1)
        offset += y * width + x
    return offset


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add_colour(sums, row, weight, texel, surface, s, t):
    """Add a texel's colour (0 to 255), tinted by the triangle's corners, times a weight to a row of ``sums`` (n, 3)."""
    red = np.float32(texel & 255)
    green = np.float32(texel >> 8 & 255)
    blue = np.float32(texel >> 16 & 255)
    if surface.tinted != 0:
        scale = np.float32(1.0 / 255.0)
        r = np.float32(1.0) - s - t
        a, b, c = surface.color0, surface.color1, surface.color2
        red *= (r * np.float32(a & 255) + s * np.float32(b & 255) + t * np.float32(c & 255)) * scale
        green *= (r * np.float32(a >> 8 & 255) + s * np.float32(b >> 8 & 255) + t * np.float32(c >> 8 & 255)) * scale
        blue *= (r * np.float32(a >> 16 & 255) + s * np.float32(b >> 16 & 255) + t * np.float32(c >> 16 & 255)) * scale
    sums[row, 0] += weight * red
    sums[row, 1] += weight * green
    sums[row, 2] += weight * blue


@njit(cache=True, nogil=True, error_model="numpy")
def read_patches(
    tracing, scenes, scene_of_view, order, views, table, pixel_area, background, sphere_color, patches, sums
):
    """Add the colour (0 to 255) of each ray of each view, times its weight, to its patch in ``sums`` (M * patches, 3).

    Args:
        tracing: address of Embree's function, whether it takes packets, and :func:`prnav.render.embree.ray_buffer`'s
            memory for the rays.
        scenes: per scene the address of Embree's scene, and address and length of its
            :class:`prnav.render.surfaces.Surfaces`' records and texels, (S, 5) int64.
        scene_of_view: row of ``scenes``, (M,).
        order: in which views are traced, those of a scene together, (M,).
        views: origins [m] and axes right, up, forward, (M, 3) each, and spheres (M, 4), of radius 0 for none.
        table: the fields of a :class:`prnav.render.ray_table.RayTable`.
        pixel_area: of each view's rays on the image plane at distance 1, (M,). A pixel covers
            ``pixel_area t^2 / |n . d|`` of a surface at depth t (unit normal n, direction d of length 1 along the
            axis); Embree's normal is as long as twice the triangle's area.
        background: colour of misses, 0 to 255, (3,).
        sphere_color: 0 to 255, (3,).
        patches: of a view.
        sums: what is added to.
    """
    _, packet, buffer = tracing
    a, b, patch, weight = table
    field, ray = (PACKET, 1) if packet else (1, FIELDS)
    fields = buffer.view(np.int32)
    active, met = np.empty(PACKET, dtype=np.int32), np.empty(PACKET, dtype=np.int32)
    place = np.empty(PACKET, dtype=np.int64)
    for view in order:
        scene, records, triangles, colours, count = scenes[scene_of_view[view]]
        surfaces = carray(_pointer(records), (triangles,), SURFACE)  # type: ignore[call-arg]
        texels = carray(_pointer(colours), (count,), np.uint32)
        area = pixel_area[view] * np.float32(LEVEL_BIAS)
        for first in range(0, len(a), PACKET):
            lanes = min(PACKET, len(a) - first)
            _trace(tracing, scene, records, lanes, fields, active, met, view, views, a, b, first)
            for lane in range(lanes):
                if met[lane] < 0:
                    continue
                at = lane * ray
                surface, depth = surfaces[met[lane]], buffer[at + 8 * field]
                dx, dy, dz = buffer[at + 4 * field], buffer[at + 5 * field], buffer[at + 6 * field]
                nx, ny, nz = buffer[at + 12 * field], buffer[at + 13 * field], buffer[at + 14 * field]
                covered = area * depth * depth * surface.texels / abs(nx * dx + ny * dy + nz * dz)
                place[lane] = _texel_of(surface, buffer[at + 15 * field], buffer[at + 16 * field], covered)
            for lane in range(lanes):
                row = view * patches + patch[first + lane]
                w = weight[first + lane]
                if met[lane] >= 0:
                    s, t = buffer[lane * ray + 15 * field], buffer[lane * ray + 16 * field]
                    _add_colour(sums, row, w, texels[place[lane]], surfaces[met[lane]], s, t)
                else:
                    plain = sphere_color if met[lane] == SPHERE else background
                    sums[row, 0] += w * plain[0]
                    sums[row, 1] += w * plain[1]
                    sums[row, 2] += w * plain[2]


@njit(cache=True, nogil=True, error_model="numpy")
def trace_pixels(tracing, scenes, scene_of_view, order, views, table, triangles, depths):
    """Write the triangle (-1 on a miss, ``SPHERE``) and z-depth [m] (inf on a miss) that each ray meets, (M, P).

    The arguments are those of :func:`read_patches`.
    """
    _, packet, buffer = tracing
    a, b, patch, _ = table
    field, ray = (PACKET, 1) if packet else (1, FIELDS)
    fields = buffer.view(np.int32)
    active, met = np.empty(PACKET, dtype=np.int32), np.empty(PACKET, dtype=np.int32)
    for view in order:
        scene, records = scenes[scene_of_view[view], 0], scenes[scene_of_view[view], 1]
        for first in range(0, len(a), PACKET):
            lanes = min(PACKET, len(a) - first)
            _trace(tracing, scene, records, lanes, fields, active, met, view, views, a, b, first)
            for lane in range(lanes):
                triangles[view, patch[first + lane]] = met[lane]
                depths[view, patch[first + lane]] = buffer[lane * ray + 8 * field]
