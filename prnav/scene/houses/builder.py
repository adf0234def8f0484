"""Collects quads in integer millimetres and turns them into arrays.

Positions are sums and products of integers with one final division, so that they are the same on any machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.scene.houses.shapes import Frame, Rect

Color = tuple[int, int, int]
Point = tuple[int, int, int]

_CIRCLES = {
    # cosines times 10,000 of the corners of regular polygons, in quarter steps
    8: (9239, 3827),
    12: (9659, 7071, 2588),
}


def polygon(sides: int) -> list[tuple[int, int]]:
    """Corners times 10,000 of a regular polygon whose first edge crosses the z axis, counter-clockwise in (x, z)."""
    quarter = _CIRCLES[sides]
    count = len(quarter)
    first = [(quarter[k], quarter[count - 1 - k]) for k in range(count)]
    corners = list(first)
    for _ in range(3):
        first = [(-z, x) for x, z in first]
        corners += first
    return corners


class Material(NamedTuple):
    """How a surface looks.

    Attributes:
        texture: name of a texture (see textures.py), "" for none.
        color: factor on the texture, 0..255 per channel.
        scale: millimetres of surface per texture, 0 to fit the texture once onto each face.
        glow: shines by itself, so that room light is not applied.
    """

    texture: str
    color: Color
    scale: int = 1000
    glow: bool = False

    def tinted(self, percent: int) -> Material:
        """The material with its colour scaled, at most white."""
        r, g, b = (min(255, channel * percent // 100) for channel in self.color)
        return self._replace(color=(r, g, b))


@dataclass(frozen=True)
class Geometry:
    """What a builder collected, vertex by vertex and face by face; V vertices, F triangles.

    Attributes:
        positions: millimetres, shape (V, 3) float64.
        normals: unit vectors, shape (V, 3) float64.
        uvs: shape (V, 2) float64, v down.
        colors: factors 0..255 before light, shape (V, 3) int64.
        rooms: index of the room that lights the vertex, -1 outdoors, shape (V,).
        glow: shape (V,) bool.
        faces: shape (F, 3) int32, counter-clockwise seen from the front.
        face_texture: index into ``textures``, shape (F,) int32.
        textures: names in the order of first use, the first is "" (white).
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    uvs: NDArray[np.float64]
    colors: NDArray[np.int64]
    rooms: NDArray[np.int64]
    glow: NDArray[np.bool_]
    faces: NDArray[np.int32]
    face_texture: NDArray[np.int32]
    textures: tuple[str, ...]


class Builder:
    """Collects quads; see :class:`Pen` for how to draw them."""

    def __init__(self) -> None:
        self.textures: dict[str, int] = {"": 0}
        self.placed: dict[str, int] = {}
        """Pieces of furniture by kind."""
        self._quads: dict[tuple[int, int], list[tuple[int, ...]]] = {}

    def pen(self, room: int, frame: Frame) -> Pen:
        """A pen that draws in ``frame``, lit as part of ``room``."""
        return Pen(self, room, frame)

    def add(
        self,
        room: int,
        corners: list[Point],
        material: Material,
        uv: tuple[int, int, int, int, int],
        cuts: tuple[int, int],
    ) -> None:
        """Add a quad: corners (0,0), (1,0), (1,1), (0,1); uv is (u0, u1, v at the top, v at the bottom, divisor)."""
        texture = self.textures.setdefault(material.texture, len(self.textures))
        row = (
            *corners[0],
            *corners[1],
            *corners[2],
            *corners[3],
            *uv,
            *material.color,
            room,
            int(material.glow),
            texture,
        )
        self._quads.setdefault(cuts, []).append(row)

    def finish(self) -> Geometry:
        """All quads as arrays."""
        parts: list[tuple[NDArray, ...]] = []
        start = 0
        for (nu, nv), rows in sorted(self._quads.items()):
            table = np.array(rows, dtype=np.int64)
            count = len(table)
            corners = table[:, :12].reshape(count, 4, 1, 3)
            i, j = (axis.reshape(1, -1, 1) for axis in np.meshgrid(np.arange(nu + 1), np.arange(nv + 1), indexing="ij"))
            positions = (
                corners[:, 0] * ((nu - i) * (nv - j))
                + corners[:, 1] * (i * (nv - j))
                + corners[:, 2] * (i * j)
                + corners[:, 3] * ((nu - i) * j)
            ) / (nu * nv)
            u0, u1, v0, v1, divisor = (table[:, 12 + k].reshape(-1, 1) for k in range(5))
            i, j = i[..., 0], j[..., 0]
            u = (u0 * (nu - i) + u1 * i) / (nu * divisor)
            v = (v1 * (nv - j) + v0 * j) / (nv * divisor)
            # the diagonals' product: right for trapezoids, too
            a, b = table[:, 6:9] - table[:, 0:3], table[:, 9:12] - table[:, 3:6]
            cross = np.stack(
                [
                    a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
                    a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
                    a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
                ],
                1,
            )
            cross = cross.astype(np.float64)
            length = np.sqrt(cross[:, 0] * cross[:, 0] + cross[:, 1] * cross[:, 1] + cross[:, 2] * cross[:, 2])
            normals = cross / length[:, None]
            corner = (np.arange(nu)[:, None] * (nv + 1) + np.arange(nv)).reshape(-1, 1)
            cell = corner + np.array([0, nv + 1, nv + 2, 0, nv + 2, 1])
            points = (nu + 1) * (nv + 1)
            offsets = start + points * np.arange(count).reshape(-1, 1, 1)
            faces = (offsets + cell).reshape(-1, 3)
            repeat = lambda values: np.repeat(values, points, axis=0)  # noqa: B023, E731
            parts.append(
                (
                    positions.reshape(-1, 3),
                    repeat(normals),
                    np.stack([u, v], axis=-1).reshape(-1, 2),
                    repeat(table[:, 17:20]),
                    repeat(table[:, 20]),
                    repeat(table[:, 21]).astype(bool),
                    faces.astype(np.int32),
                    np.repeat(table[:, 22], 2 * nu * nv).astype(np.int32),
                )
            )
            start += points * count
        positions, normals, uvs, colors, rooms, glow, faces, face_texture = (
            np.concatenate(column) for column in zip(*parts, strict=True)
        )
        return Geometry(positions, normals, uvs, colors, rooms, glow, faces, face_texture, tuple(self.textures))


class Pen:
    """Draws boxes, cylinders and panels in a local frame: x right, y up, z towards the viewer."""

    def __init__(self, builder: Builder, room: int, frame: Frame) -> None:
        self.builder, self.room, self.frame = builder, room, frame

    def at(self, x: int = 0, y: int = 0, z: int = 0, turns: int = 0) -> Pen:
        """A pen in a frame inside this one."""
        return Pen(self.builder, self.room, self.frame.at(x, y, z, turns))

    def quad(
        self,
        corners: list[Point],
        material: Material,
        size: tuple[int, int],
        *,
        origin: tuple[int, int] = (0, 0),
        cuts: tuple[int, int] = (1, 1),
    ) -> None:
        """A quad from its corners, counter-clockwise seen from the front and the first at the lower left.

        ``size`` is its width and height on the texture in mm, ``origin`` where its upper left corner is on it.
        """
        if material.scale:
            uv = (origin[0], origin[0] + size[0], origin[1], origin[1] + size[1], material.scale)
        else:
            uv = (0, 1, 0, 1, 1)
        self.builder.add(self.room, [self.frame.point(*corner) for corner in corners], material, uv, cuts)

    def panel(
        self,
        x0: int,
        y0: int,
        x1: int,
        y1: int,
        z: int,
        material: Material,
        *,
        step: int = 0,
        origin: tuple[int, int] | None = None,
    ) -> None:
        """An upright rectangle that faces +z; ``step`` cuts it into pieces of about that size."""
        corners = [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]
        origin = (x0, -y1) if origin is None else origin
        self.quad(corners, material, (x1 - x0, y1 - y0), origin=origin, cuts=_cuts(x1 - x0, y1 - y0, step))

    def slab(
        self, x0: int, z0: int, x1: int, z1: int, y: int, material: Material, *, up: bool = True, step: int = 0
    ) -> None:
        """A level rectangle that faces up or down; textures are laid from the frame's origin."""
        if up:
            corners = [(x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0)]
        else:
            corners = [(x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)]
        self.quad(corners, material, (x1 - x0, z1 - z0), origin=(x0, z0), cuts=_cuts(x1 - x0, z1 - z0, step))

    def box(
        self,
        x0: int,
        y0: int,
        z0: int,
        x1: int,
        y1: int,
        z1: int,
        material: Material,
        *,
        top: Material | None = None,
        front: Material | None = None,
        skip: str = "",
    ) -> None:
        """A closed box. ``skip`` leaves out faces by letter: Top, Under, Front (+z), Back, Left (-x), Right.

        A face on the floor (local y 0) is left out as well.
        """
        w, h, d = x1 - x0, y1 - y0, z1 - z0
        if "F" not in skip:
            self.panel(x0, y0, x1, y1, z1, front or material, origin=(0, 0))
        if "B" not in skip:
            self.quad([(x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)], material, (w, h))
        if "L" not in skip:
            self.quad([(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)], material, (d, h))
        if "R" not in skip:
            self.quad([(x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)], material, (d, h))
        if "T" not in skip:
            self.quad([(x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)], top or material, (w, d))
        if "U" not in skip and y0 > 0:
            self.quad([(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)], material, (w, d))

    def cylinder(
        self,
        x: int,
        z: int,
        y0: int,
        y1: int,
        radius: int,
        material: Material,
        *,
        top_radius: int | None = None,
        sides: int = 8,
        cap: Material | None = None,
        capped: bool = True,
    ) -> None:
        """An upright cylinder or cone frustum around (x, z)."""
        upper = radius if top_radius is None else top_radius
        ring = polygon(sides)
        low = [(x + a * radius // 10000, y0, z + b * radius // 10000) for a, b in ring]
        high = [(x + a * upper // 10000, y1, z + b * upper // 10000) for a, b in ring]
        edge = max(1, 6283 * max(radius, upper) // (1000 * sides))
        for k in range(sides):
            n = (k + 1) % sides
            self.quad([low[n], low[k], high[k], high[n]], material, (edge, y1 - y0), origin=((sides - 1 - k) * edge, 0))
        if not capped:
            return
        self._disc(high, cap or material, up=True)
        if y0 > 0:
            self._disc(low, material, up=False)

    def _disc(self, ring: list[Point], material: Material, *, up: bool) -> None:
        count = len(ring)
        span = abs(ring[0][0] - ring[count // 2][0]) + 1
        for k in range(count // 2 - 1):
            quad = [ring[k], ring[k + 1], ring[count - 2 - k], ring[count - 1 - k]]
            if up:
                quad.reverse()
            self.quad(quad, material, (span // 2, span // 2))


def _cuts(width: int, height: int, step: int) -> tuple[int, int]:
    if step <= 0:
        return 1, 1
    return max(1, (width + step // 2) // step), max(1, (height + step // 2) // step)


def floor_rect(pen: Pen, x0: int, z0: int, x1: int, z1: int) -> Rect:
    """World rectangle of a local one."""
    return pen.frame.rect(x0, z0, x1, z1)
