"""Baked light: a brightness per vertex from the surface's direction, corners, windows, lamps and furniture.

There are no shadows cast by rays; the aim is what a coarse sensor sees: gradients towards corners, brighter surfaces
near windows, darker floor under and beside furniture. Only +, -, *, / and square roots of float64 are used, element
by element, which IEEE 754 rounds the same everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.scene.houses.builder import Geometry
from prnav.scene.houses.shapes import Rect

DAYLIGHT = (236.0, 246.0, 258.0)
LAMPLIGHT = (262.0, 242.0, 212.0)
AMBIENT = (150.0, 149.0, 148.0)
OUTDOORS = (0.72, 1.0, 0.86)  # sides facing x, up, sides facing z


@dataclass(frozen=True)
class Lamp:
    """A source of light: a window (with a direction it shines in) or a lamp (without); lengths in mm."""

    position: tuple[int, int, int]
    direction: tuple[int, int, int] | None
    strength: float
    """Square of the distance [mm2] at which the light has the brightness of a white wall in full daylight."""


@dataclass(frozen=True)
class RoomLight:
    """What lights one room.

    Attributes:
        inner: floor rectangle.
        level: height of the floor.
        height: of the room.
        lamps: windows and lamps.
        cover: how much of the floor around a place is covered by furniture, 0..1, shape (X, Z).
        cell: size of ``cover``'s cells.
    """

    inner: Rect
    level: int
    height: int
    lamps: tuple[Lamp, ...]
    cover: NDArray[np.float64]
    cell: int


def bake(geometry: Geometry, rooms: list[RoomLight]) -> NDArray[np.uint8]:
    """Vertex colours after light, shape (V, 3) uint8."""
    colors = geometry.colors.astype(np.float64)
    light = np.full_like(colors, 255.0)
    for index, room in enumerate(rooms):
        chosen = np.flatnonzero((geometry.rooms == index) & ~geometry.glow)
        light[chosen] = _room_light(geometry.positions[chosen], geometry.normals[chosen], room)
    outdoor = np.flatnonzero((geometry.rooms < 0) & ~geometry.glow)
    normals = np.abs(geometry.normals[outdoor])
    shade = normals[:, 0] * OUTDOORS[0] + normals[:, 1] * OUTDOORS[1] + normals[:, 2] * OUTDOORS[2]
    light[outdoor] = np.minimum(shade, 1.0)[:, None] * 235.0
    # a soft shoulder keeps bright places from turning flat white
    light = np.where(light > 200.0, 200.0 + (light - 200.0) * 55.0 / (55.0 + (light - 200.0)), light)
    light = np.where(geometry.glow[:, None], 255.0, light)
    return np.clip(np.floor(colors * light / 255.0 + 0.5), 0.0, 255.0).astype(np.uint8)


def _room_light(positions: NDArray[np.float64], normals: NDArray[np.float64], room: RoomLight) -> NDArray[np.float64]:
    x, y, z = positions[:, 0], positions[:, 1] - room.level, positions[:, 2]
    nx, ny, nz = normals[:, 0], normals[:, 1], normals[:, 2]
    inner = room.inner
    # corners: a surface loses light to the planes it faces along, near where they meet
    planes = (
        (x - inner.x0, nx, 0.3), (inner.x1 - x, -nx, 0.3), (z - inner.z0, nz, 0.3), (inner.z1 - z, -nz, 0.3),
        (y, ny, 0.36), (room.height - y, -ny, 0.22),
    )  # fmt: skip
    open_share = np.ones_like(x)
    for distance, facing, weight in planes:
        near = np.clip(1.0 - np.maximum(distance, 0.0) / 900.0, 0.0, 1.0)
        open_share = open_share * (1.0 - weight * near * near * np.where(facing < 0.7, 1.0, 0.0))
    # furniture above and beside a place on the floor
    column = np.clip(np.floor((x - inner.x0) / room.cell), 0, room.cover.shape[0] - 1).astype(np.int64)
    row = np.clip(np.floor((z - inner.z0) / room.cell), 0, room.cover.shape[1] - 1).astype(np.int64)
    on_floor = (y < 40.0) & (ny > 0.7)
    open_share = np.where(on_floor, open_share * (1.0 - 0.6 * room.cover[column, row]), open_share)
    facing_share = 0.88 + 0.12 * ny + 0.05 * nx
    result = np.stack([value * open_share * facing_share for value in AMBIENT], axis=1)
    for lamp in room.lamps:
        dx, dy, dz = lamp.position[0] - x, lamp.position[1] - positions[:, 1], lamp.position[2] - z
        square = dx * dx + dy * dy + dz * dz
        distance = np.sqrt(square) + 1.0
        toward = np.clip((dx * nx + dy * ny + dz * nz) / distance * 0.75 + 0.25, 0.0, 1.0)
        if lamp.direction is not None:
            ex, ey, ez = lamp.direction
            toward = toward * np.clip(-(dx * ex + dy * ey + dz * ez) / distance * 0.8 + 0.2, 0.0, 1.0)
        strength = toward * open_share * lamp.strength / (square + lamp.strength * 0.8 + 250_000.0)
        tint = LAMPLIGHT if lamp.direction is None else DAYLIGHT
        result = result + strength[:, None] * np.array(tint)
    return result
