"""What the compiled loops read, and the room in which they work."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from prnav.domains.control.casting.borrow import borrowed
from prnav.domains.control.casting.tracing import KEPT
from prnav.domains.control.textures import TexturePyramids

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]


class Scene(NamedTuple):
    """What the loops read; see :class:`prnav.domains.control.appearance.Appearance`."""

    shapes: NDArray[np.void]
    lights: NDArray[np.void]
    textures: TexturePyramids
    sky: int
    near: float
    far: float
    mirror: int
    """The plane that mirrors when it is seen from its front, -1 for none."""


class Veils(NamedTuple):
    """The transparent shapes, in the order in which they are blended."""

    shape: Int64
    """Their numbers, (S,)."""
    away: Float64
    """Their distances from the camera [m], (S,)."""
    layer: Float64
    """What a ray sees of each: colour and opacity, (S, 4)."""


class Faced(NamedTuple):
    """How many shapes a camera faces."""

    seen: int
    """Opaque shapes in its image."""
    veils: int
    """Transparent shapes."""
    mirror: int
    """The one that mirrors, -1 for none."""
    mirrored: int
    """Opaque shapes in the mirrored image."""


class Work(NamedTuple):
    """Room for what the loops compute on the way; one for each thread. S shapes, L + 1 lights."""

    poses: Float64
    """Place and axes of each shape, (S, 12)."""
    beams: Float64
    """Lights in the shapes' frames: place, or direction to it, and axis, (S, L + 1, 6)."""
    lamps: Float64
    """Lights as cameras: place, right, up, forward, (L + 1, 12)."""
    lamp_boxes: Float64
    """Boxes around the shapes as the lights see them, (L + 1, S, 4)."""
    camera: Float64
    """A sensor as a camera, (12,)."""
    mirrored: Float64
    """The same mirrored, (12,)."""
    views: Float64
    """The camera in the shapes' frames, (S, 17); see :mod:`prnav.domains.control.casting.facing`."""
    mirror_views: Float64
    """The mirrored camera in them, (S, 17)."""
    order: Int64
    """Shapes in the image, (S,)."""
    mirror_order: Int64
    """Shapes in the mirrored image, (S,)."""
    alphas: Float64
    """Opacity of each shape, negative for planes seen from behind, (S,)."""
    hidden: NDArray[np.bool_]
    """Shapes that are not listed as opaque, (S,)."""
    veils: Veils
    kept: Int64
    """Vertices of each plane whose light is kept, (S, KEPT); numbers grow with each sensor."""
    glow: Float64
    """That light: of the first pass, and of each light that casts shadows, (S, KEPT, L + 1, 3)."""
    plain_kept: Int64
    """The same for the light of all lights, (S, KEPT)."""
    plain_glow: Float64
    """That light, (S, KEPT, 3)."""


class Strip(NamedTuple):
    """Samples of a row of receptors: M of them, those of a ray side by side, then line by line of rays."""

    across: Float64
    """Where they lie across the image, -1 to 1, (M,)."""
    down: Float64
    """Where they lie down the image, -1 to 1, in the topmost row of receptors, (M,)."""
    below: Float64
    """The same in the row at hand, (M,)."""
    depth: Float64
    """Of what they show [m], (M,)."""
    shape: Int64
    """What they show, -1 for the sky, (M,)."""


SAMPLES = {1: (0,), 4: (1, 3, 0, 2)}
"""For each number of samples that a ray may have: the rows in which they lie, from the leftmost to the rightmost."""


def new_strip(grid: int, side: int, samples: int) -> Strip:
    """Room for a row of ``grid`` receptors of ``side`` x ``side`` rays with ``samples`` samples each.

    A ray stands for a square of the image. Its samples have columns and rows of their own in it, and those of a
    receptor's rays are shifted against each other, so that no two samples of a receptor share a column or a row: an
    edge along the rows or columns is met by as many steps of coverage as there are samples.
    """
    line, column, sample = np.meshgrid(np.arange(side), np.arange(grid * side), np.arange(samples), indexing="ij")
    x = column + (sample + (line + 0.5) / side) / samples
    y = line + (np.array(SAMPLES[samples])[sample] + (column % side + 0.5) / side) / samples
    across, down = (2.0 * place.ravel() / (grid * side) - 1.0 for place in (x, y))
    return Strip(across, down, down.copy(), np.zeros(across.size), np.zeros(across.size, np.int64))


def new_work(scene: Scene) -> Work:
    """Room for one thread."""
    shapes, lights = len(scene.shapes), len(scene.lights)
    return Work(
        poses=np.zeros((shapes, 12)),
        beams=np.zeros((shapes, lights, 6)),
        lamps=np.zeros((lights, 12)),
        lamp_boxes=np.zeros((lights, shapes, 4)),
        camera=np.zeros(12),
        mirrored=np.zeros(12),
        views=np.zeros((shapes, 17)),
        mirror_views=np.zeros((shapes, 17)),
        order=np.zeros(shapes, np.int64),
        mirror_order=np.zeros(shapes, np.int64),
        alphas=np.zeros(shapes),
        hidden=np.zeros(shapes, np.bool_),
        veils=Veils(np.zeros(shapes, np.int64), np.zeros(shapes), np.zeros((shapes, 4))),
        kept=np.full((shapes, KEPT), -1),
        glow=np.zeros((shapes, KEPT, lights, 3)),
        plain_kept=np.full((shapes, KEPT), -1),
        plain_glow=np.zeros((shapes, KEPT, 3)),
    )


@njit(nogil=True, error_model="numpy", forceinline=True)
def borrowed_scene(scene):
    """The same scene of uncounted arrays."""
    textures = TexturePyramids(
        borrowed(scene.textures.texels), borrowed(scene.textures.table), borrowed(scene.textures.levels)
    )
    return Scene(
        borrowed(scene.shapes), borrowed(scene.lights), textures, scene.sky, scene.near, scene.far, scene.mirror
    )


@njit(nogil=True, error_model="numpy", forceinline=True)
def borrowed_work(work):
    """The same room of uncounted arrays."""
    return Work(
        borrowed(work.poses),
        borrowed(work.beams),
        borrowed(work.lamps),
        borrowed(work.lamp_boxes),
        borrowed(work.camera),
        borrowed(work.mirrored),
        borrowed(work.views),
        borrowed(work.mirror_views),
        borrowed(work.order),
        borrowed(work.mirror_order),
        borrowed(work.alphas),
        borrowed(work.hidden),
        Veils(borrowed(work.veils.shape), borrowed(work.veils.away), borrowed(work.veils.layer)),
        borrowed(work.kept),
        borrowed(work.glow),
        borrowed(work.plain_kept),
        borrowed(work.plain_glow),
    )


@njit(nogil=True, error_model="numpy", forceinline=True)
def borrowed_strip(strip):
    """The same strip of uncounted arrays."""
    return Strip(
        borrowed(strip.across),
        borrowed(strip.down),
        borrowed(strip.below),
        borrowed(strip.depth),
        borrowed(strip.shape),
    )
