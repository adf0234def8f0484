"""The loop over states, sensors, receptors and rays."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit

from prnav.aliases import Untyped
from prnav.domains.control.casting.borrow import borrowed
from prnav.domains.control.casting.facing import (
    aim_headlight,
    face_shapes,
    find_veils,
    mirror_camera,
    turn_camera,
    write_box,
)
from prnav.domains.control.casting.room import Faced, borrowed_scene, borrowed_strip, borrowed_work
from prnav.domains.control.casting.tracing import meet, shade
from prnav.domains.control.casting.visibility import scan


@njit(nogil=True, error_model="numpy", forceinline=True)
def _place_shapes(scene, work, geom_xpos, geom_xmat, site_xpos, site_xmat, n):
    """Write the poses of the shapes in state n; whether they are finite."""
    total = 0.0
    for s in range(len(scene.shapes)):
        index = scene.shapes[s].index
        for k in range(3):
            work.poses[s, k] = site_xpos[n, index, k] if scene.shapes[s].site else geom_xpos[n, index, k]
        for k in range(9):
            work.poses[s, 3 + k] = site_xmat[n, index, k] if scene.shapes[s].site else geom_xmat[n, index, k]
        for k in range(12):
            total += work.poses[s, k]
    return np.isfinite(total)


@njit(nogil=True, error_model="numpy", forceinline=True)
def _place_lights(scene, work, light_xpos, light_xdir, n):
    """Write where the scene lights are in state n, also in the frames of the placed shapes; whether they are finite."""
    total = 0.0
    for number in range(1, len(scene.lights)):
        light, lamp = scene.lights[number], work.lamps[number]
        for k in range(3):
            lamp[k], lamp[9 + k] = light_xpos[n, light.index, k], light_xdir[n, light.index, k]
            total += lamp[k] + lamp[9 + k]
        dx, dy, dz = lamp[9], lamp[10], lamp[11]
        ux, uy, uz = (0.0, -dz, dy) if dy * dy + dz * dz > 0.01 else (-dz, 0.0, dx)
        size = np.sqrt(ux * ux + uy * uy + uz * uz)
        lamp[6], lamp[7], lamp[8] = ux / size, uy / size, uz / size
        lamp[3], lamp[4], lamp[5] = (
            dy * lamp[8] - dz * lamp[7],
            dz * lamp[6] - dx * lamp[8],
            dx * lamp[7] - dy * lamp[6],
        )
        for s in range(len(scene.shapes)):
            m, beam = work.poses[s], work.beams[s, number]
            x, y, z = lamp[0] - m[0], lamp[1] - m[1], lamp[2] - m[2]
            if light.directional:
                x, y, z = -dx, -dy, -dz
            for k in range(3):
                beam[k] = m[3 + k] * x + m[6 + k] * y + m[9 + k] * z
                beam[3 + k] = m[3 + k] * dx + m[6 + k] * dy + m[9 + k] * dz
            if light.shadows and scene.shapes[s].casts:
                write_box(scene.shapes[s], m, lamp, 1.0, light.directional, work.lamp_boxes[number, s])
    return np.isfinite(total)


@njit(nogil=True, error_model="numpy", forceinline=True)
def _place_camera(place, axes, half, camera):
    """Write a sensor as a camera; whether it is finite."""
    total = half
    for k in range(3):
        camera[k] = place[k]
        camera[3 + k], camera[6 + k], camera[9 + k] = half * axes[k, 0], half * axes[k, 1], -axes[k, 2]
        total += camera[k] + camera[3 + k] + camera[6 + k] + camera[9 + k]
    return np.isfinite(total)


@njit(nogil=True, error_model="numpy", forceinline=True)
def _face(scene, work, half):
    """Sort the placed shapes for the placed camera."""
    shapes, poses, camera = scene.shapes, work.poses, work.camera
    veils = find_veils(scene, poses, camera, work.alphas, work.hidden, work.veils)
    seen = face_shapes(shapes, poses, camera, half, scene.near, work.hidden, work.views, work.order)
    mirror, mirrored = -1, 0
    for i in range(seen):
        s = work.order[i]
        aim_headlight(poses[s], camera, work.beams[s, 0])
        if s == scene.mirror:
            mirror = s
    if mirror >= 0:
        mirror_camera(camera, poses[mirror], work.mirrored)
        work.hidden[mirror] = True
        mirrored = face_shapes(
            shapes, poses, work.mirrored, half, scene.near, work.hidden, work.mirror_views, work.mirror_order
        )
        for i in range(mirrored):
            s = work.mirror_order[i]
            aim_headlight(poses[s], camera, work.beams[s, 0])
    for i in range(veils):
        s = work.veils.shape[i]
        aim_headlight(poses[s], camera, work.beams[s, 0])
        turn_camera(poses[s], camera, work.views[s])
        if mirror >= 0:
            turn_camera(poses[s], work.mirrored, work.mirror_views[s])
    return Faced(seen, veils, mirror, mirrored)


@njit(nogil=True, error_model="numpy", forceinline=True)
def _read_strip(scene, work, strip, faced, stamp, half, grid, row, side, samples, out):
    """Write the readings of a row of receptors into ``out`` (grid, 3).

    Of what a ray's samples show, each shape is shaded once, in the midst of its samples, and counts by their number.
    """
    across, below, depth, shape = strip.across, strip.below, strip.depth, strip.shape
    wide = grid * side
    for m in range(len(below)):
        below[m] = strip.down[m] + row * (2.0 / grid)
    scan(scene, work.views, work.order, faced.seen, wide, samples, across, below, depth, shape)
    pixel = 2.0 * half / wide
    share = 1.0 / (side * side * samples)
    for column in range(grid):
        red, green, blue = 0.0, 0.0, 0.0
        for line in range(side):
            begin = (line * wide + column * side) * samples
            for corner in range(begin, begin + side * samples, samples):
                for p in range(corner, corner + samples):
                    s = shape[p]
                    if s < -1:  # counted already
                        continue
                    a, b, t, count = across[p], below[p], depth[p], 1
                    for q in range(p + 1, corner + samples):
                        if shape[q] == s:
                            shape[q] = -2
                            a, b, count = a + across[q], b + below[q], count + 1
                    if count > 1:
                        a, b = a / count, b / count
                        if s >= 0:
                            t = meet(scene.shapes[s], work.views[s], a, -b)
                            if not scene.near <= t < scene.far:  # a near plane's cut can leave no midst
                                a, b, t = across[p], below[p], depth[p]
                    r, g, b2 = shade(scene, work, work.camera, faced, stamp, s, t, a, -b, pixel)
                    red, green, blue = red + count * r, green + count * g, blue + count * b2
        out[column, 0], out[column, 1], out[column, 2] = red * share, green * share, blue * share


def _compiled(sources: str) -> Callable[..., None]:
    """The compiled loop. That it refers to a digest of all sources makes the compiler's cache see every change."""

    @njit(cache=True, nogil=True, error_model="numpy")
    def read_states(
        scene, work, geom_xpos, geom_xmat, site_xpos, site_xmat, light_xpos, light_xdir, places, axes, halves,
        strip, grid, side, samples, start, stop, out,
    ):  # fmt: skip
        """Readings of K sensors in states ``start`` to ``stop`` of N, into ``out`` (N, K, grid, grid, 3).

        Args:
            scene: what is seen.
            work: room for what is computed on the way.
            geom_xpos: places of the geoms (N, G, 3).
            geom_xmat: their axes (N, G, 9).
            site_xpos: places of the sites (N, S, 3).
            site_xmat: their axes (N, S, 9).
            light_xpos: places of the lights (N, L, 3).
            light_xdir: where they shine (N, L, 3).
            places: sensors' places in the world (N, K, 3).
            axes: their axes, columns right, up and back (N, K, 3, 3).
            halves: tangents of half their fields of view (N, K).
            strip: room for a row of receptors.
            grid: receptors per row.
            side: rays along each side of a receptor's patch.
            samples: samples of each ray.
            start: first state.
            stop: the state after the last.
            out: readings; 0 where a pose is not finite.
        """
        _ = sources
        scene, work = borrowed_scene(scene), borrowed_work(work)
        places, axes, halves, out = borrowed(places), borrowed(axes), borrowed(halves), borrowed(out)
        strip = borrowed_strip(strip)
        work.kept[:] = -1
        work.plain_kept[:] = -1
        for n in range(start, stop):
            finite = _place_shapes(scene, work, geom_xpos, geom_xmat, site_xpos, site_xmat, n)
            finite = finite and _place_lights(scene, work, light_xpos, light_xdir, n)
            for k in range(places.shape[1]):
                half = halves[n, k]
                if not (_place_camera(places[n, k], axes[n, k], half, work.camera) and finite):
                    out[n, k] = 0.0
                    continue
                faced = _face(scene, work, half)
                for row in range(grid):
                    _read_strip(
                        scene,
                        work,
                        strip,
                        faced,
                        n * places.shape[1] + k,
                        half,
                        grid,
                        row,
                        side,
                        samples,
                        out[n, k, row],
                    )

    return read_states


def _digest() -> str:
    """Digest of the sources of all compiled loops."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


read_states: Callable[..., Untyped] = _compiled(_digest())
