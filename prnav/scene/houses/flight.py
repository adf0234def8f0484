"""Stairs: two flights side by side, a half landing between them, railings, and the walls of the stair room."""

from __future__ import annotations

from prnav.scene.houses.builder import Builder, Pen, Point
from prnav.scene.houses.plan import Room, Stairs, Storey
from prnav.scene.houses.style import HomeStyle, RoomStyle

SPINE = 80
"""Thickness of what stands between the flights [mm]."""
RAIL = 900
_NOSE = 25
_POST = 34


def build_stairs(builder: Builder, storey: Storey, room: Room, home: HomeStyle, style: RoomStyle) -> None:
    """Draw the stairs up from a storey in its stair room."""
    stairs = storey.stairs_up
    assert stairs is not None
    pen = builder.pen(storey.light(room), room.inner.frame(stairs.entry)).at(0, storey.level, 0)
    width, depth = room.inner.length(stairs.entry), room.inner.length((stairs.entry + 1) % 4)
    start, count, riser, tread = stairs.start(room.inner), stairs.steps, stairs.riser, stairs.tread
    flight = (width - SPINE) // 2
    up, back = (0, width - flight) if not stairs.mirrored else (width - flight, 0)
    spine = flight if not stairs.mirrored else width - flight - SPINE
    end = start + (count - 1) * tread
    step, face = home.dark_wood, home.trim
    for k in range(1, count + 1):  # the flight up, its last riser below the half landing
        z = start + (k - 1) * tread
        pen.box(up, (k - 1) * riser, z, up + flight, k * riser, z + tread, face, skip="FLRTU")
        if k < count:
            pen.slab(up, z - _NOSE, up + flight, z + tread, k * riser, step, step=700)
            pen.box(up, k * riser - 30, z - _NOSE, up + flight, k * riser, z, step, skip="FTLR")
    pen.slab(0, end - _NOSE, width, depth, count * riser, step, step=500)
    pen.box(up, count * riser - 30, end - _NOSE, up + flight, count * riser, end, step, skip="FTLR")
    for k in range(1, count + 1):  # the flight back
        z = start + (count - k) * tread
        low, high = (count + k - 1) * riser, (count + k) * riser
        pen.box(back, low, z - tread, back + flight, high, z, face, skip="BLRTU")
        if k < count:
            pen.slab(back, z - tread, back + flight, z + _NOSE, high, step, step=700)
            pen.box(back, high - 30, z, back + flight, high, z + _NOSE, step, skip="BTLR")
    _spine(pen, stairs, start, spine, home)
    # below the flight back: a cupboard's front; above the flight up: the edge of the upper floor
    pen.box(back, 0, start, back + flight, storey.height, start + 10, style.wall, skip="FTU")
    door = pen.at(back + flight // 2, 0, start, 2)
    half = min(320, flight // 2 - 60)
    door.box(-half - 50, 0, 0, half + 50, 1850, 15, home.trim, skip="BU")
    door.panel(-half, 0, half, 1800, 17, home.door)
    edge = storey.height
    pen.panel(up, edge, up + flight + SPINE, stairs.rise, start, home.trim, step=700)
    _gallery(
        pen,
        up - (SPINE if stairs.mirrored else 0),
        up + flight + (0 if stairs.mirrored else SPINE),
        stairs.rise,
        start - 50,
        home,
    )
    # the walls go on between the ceiling below and the floor above
    for x, turns, length in ((0, 3, depth - start), (width, 1, depth - start), (width, 2, width)):
        z = depth if turns == 3 else start if turns == 1 else depth
        pen.at(x, 0, z, turns).panel(0, edge, length, stairs.rise, 0, style.wall, step=700)


def _spine(pen: Pen, stairs: Stairs, start: int, x: int, home: HomeStyle) -> None:
    """A wall between the flights up to the flight back, a railing on it, and newel posts at both ends."""
    count, riser, tread = stairs.steps, stairs.riser, stairs.tread
    end = start + (count - 1) * tread
    for k in range(1, count):
        z = start + (count - 1 - k) * tread
        pen.box(x, 0, z, x + SPINE, (count + k) * riser + 60, z + tread, home.trim, skip="U" + ("" if k == 1 else "F"))
        top = (count + k) * riser + 60
        for offset in (tread // 4, tread * 3 // 4):
            middle = x + SPINE // 2
            rail = (count + k) * riser + RAIL - 150 - (offset - tread // 2) * riser // tread
            at = z + offset
            pen.box(middle - 12, top, at - 12, middle + 12, rail, at + 12, home.trim, skip="TU")
    low, high = count * riser + RAIL, (2 * count - 1) * riser + RAIL
    _beam(pen, x + SPINE // 2 - 30, x + SPINE // 2 + 30, (start, high), (end, low), home)
    for z, bottom, top in ((start - _POST, 0, stairs.rise + RAIL + 100), (end, 0, count * riser + RAIL + 150)):
        pen.box(x, bottom, z - 2, x + SPINE, top, z + 2 * _POST, home.dark_wood)


def _beam(pen: Pen, x0: int, x1: int, near: tuple[int, int], far: tuple[int, int], home: HomeStyle) -> None:
    """A sloping handrail between two places (z, y of its top)."""
    thick, wood = 60, home.dark_wood
    (z0, y0), (z1, y1) = near, far
    size = (z1 - z0, thick)
    a, b, c, d = (x0, y0, z0), (x1, y0, z0), (x1, y1, z1), (x0, y1, z1)

    def low(point: Point) -> Point:
        return point[0], point[1] - thick, point[2]

    pen.quad([d, c, b, a], wood, (x1 - x0, z1 - z0))
    pen.quad([low(a), low(b), low(c), low(d)], wood, (x1 - x0, z1 - z0))
    pen.quad([low(a), low(d), d, a], wood, size)
    pen.quad([low(c), low(b), b, c], wood, size)


def _gallery(pen: Pen, x0: int, x1: int, floor: int, z: int, home: HomeStyle) -> None:
    """The railing of the upper floor above the flight up."""
    count = max(2, (x1 - x0) // 120)
    for k in range(count):
        x = x0 + (x1 - x0) * (2 * k + 1) // (2 * count)
        pen.box(x - 12, floor, z - 12, x + 12, floor + RAIL - 60, z + 12, home.trim, skip="TU")
    pen.box(x0, floor + RAIL - 60, z - 30, x1, floor + RAIL, z + 30, home.dark_wood)
    pen.box(x0, floor, z - 20, x1, floor + 50, z + 20, home.trim, skip="U")
