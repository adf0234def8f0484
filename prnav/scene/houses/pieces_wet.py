"""Furniture for kitchens and baths; see pieces.py for the frame."""

from __future__ import annotations

from prnav.scene.houses.builder import Material, Pen
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.style import BLACK, CERAMIC, METAL, WHITE, HomeStyle, RoomStyle

COUNTER_HEIGHT = 900
UPPER_BOTTOM = 1450
_WATER = Material("", (196, 222, 230))


def counter(
    pen: Pen,
    rng: Rng,
    w: int,
    d: int,
    home: HomeStyle,
    room: RoomStyle,
    uppers: list[tuple[int, int]],
    plain: bool,
) -> None:
    """A kitchen counter, ``plain`` or with sink and stove; ``uppers`` are intervals with cabinets above."""
    h = COUNTER_HEIGHT
    pen.box(0, 0, 0, w, 100, d - 80, BLACK, skip="TB")
    pen.box(0, 100, 0, w, h - 40, d - 40, home.front, skip="T")
    pen.box(0, h - 40, 0, w, h, d, home.counter)
    doors = max(1, w // 550)
    for k in range(doors):
        x0, x1 = w * k // doors + 6, w * (k + 1) // doors - 6
        drawers = rng.chance(40)
        rows = (110, 360, 610, h - 50) if drawers else (110, h - 50)
        for y0, y1 in zip(rows, rows[1:], strict=False):
            pen.box(x0, y0, d - 40, x1, y1 - 10, d - 20, home.front, skip="B")
            pen.box((x0 + x1) // 2 - 70, y1 - 60, d - 20, (x0 + x1) // 2 + 70, y1 - 45, d + 5, METAL, skip="B")
    if w >= 1700 and not plain:
        x = 300 + rng.between(0, max(0, w // 2 - 900), 50)
        pen.slab(x, 110, x + 500, d - 110, h + 2, METAL.tinted(80))
        pen.slab(x + 40, 150, x + 460, d - 150, h + 4, BLACK.tinted(200))
        pen.cylinder(x + 250, 80, h, h + 260, 16, METAL)
        pen.box(x + 235, h + 240, 80, x + 265, h + 265, 230, METAL)
        x = w - 900 - rng.between(0, max(0, w // 2 - 1000), 50)
        pen.slab(x, 60, x + 580, d - 60, h + 3, BLACK)
        for dx in (150, 430):
            for dz in (180, d - 190):
                pen.cylinder(x + dx, dz, h + 3, h + 8, 85, Material("", (80, 76, 76)), sides=12)
        pen.box(x + 10, 150, d - 40, x + 570, h - 150, d - 12, BLACK, front=Material("screen", (255, 255, 255), 0))
        pen.box(x + 60, h - 230, d - 12, x + 520, h - 205, d + 18, METAL, skip="B")
        if rng.chance(60):
            pen.cylinder(x + 150, 180, h + 8, h + 130, 95, METAL if rng.chance(50) else Material("", (170, 60, 50)))
    if plain or w >= 2400:
        _microwave(pen.at(w // 2 - 250 + (0 if plain else rng.between(-100, 100, 10)), h, 100), rng)
    for k in range(rng.between(1, 3)):
        jar = Material("", (rng.between(80, 240), rng.between(80, 240), rng.between(80, 240)))
        pen.cylinder(80 + 120 * k, 120, h, h + rng.between(140, 260), 45, jar)
    for x0, x1 in uppers:
        _upper(pen, x0, x1, home)


def _microwave(pen: Pen, rng: Rng) -> None:
    body = rng.choice((METAL, WHITE, BLACK))
    pen.box(0, 0, 0, 500, 315, 400, body, skip="U")
    pen.panel(25, 30, 370, 285, 402, Material("screen", (255, 255, 255), 0))
    pen.box(395, 40, 400, 415, 275, 425, METAL, skip="B")


def _upper(pen: Pen, x0: int, x1: int, home: HomeStyle) -> None:
    pen.box(x0, UPPER_BOTTOM, 0, x1, 2150, 320, home.front)
    doors = max(1, (x1 - x0) // 450)
    for k in range(doors):
        a, b = x0 + (x1 - x0) * k // doors + 5, x0 + (x1 - x0) * (k + 1) // doors - 5
        pen.box(a, UPPER_BOTTOM + 8, 320, b, 2140, 338, home.front.tinted(104), skip="B")
        pen.box(b - 45, UPPER_BOTTOM + 60, 338, b - 30, UPPER_BOTTOM + 200, 358, METAL, skip="B")


def fridge(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A fridge."""
    h = rng.between(1650, 1900, 50)
    body = METAL if rng.chance(50) else WHITE
    pen.box(0, 20, 0, w, h, d - 50, body.tinted(92))
    pen.box(20, 0, 20, w - 20, 20, d - 80, BLACK, skip="TU")
    split = rng.between(600, 1100, 50)
    for y0, y1 in ((40, split - 6), (split + 6, h - 10)):
        pen.box(4, y0, d - 50, w - 4, y1, d, body, skip="B")
        pen.box(
            40, max(y0 + 60, y0 + (y1 - y0) // 3), d, 65, min(y1 - 60, y0 + (y1 - y0) * 2 // 3), d + 35, METAL, skip="B"
        )


def toilet(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A toilet with its cistern."""
    pen.box(w // 2 - 190, 380, 0, w // 2 + 190, 800, 180, CERAMIC)
    pen.box(w // 2 - 30, 800, 60, w // 2 + 30, 815, 110, METAL, skip="U")
    pen.box(w // 2 - 110, 0, 60, w // 2 + 110, 380, d - 150, CERAMIC.tinted(95), skip="T")
    pen.cylinder(w // 2, d - 200, 180, 400, 130, CERAMIC, top_radius=195, sides=12)
    pen.box(w // 2 - 180, 370, 120, w // 2 + 180, 400, d - 200, CERAMIC)
    pen.cylinder(w // 2, d - 200, 400, 425, 190, CERAMIC.tinted(90), sides=12)


def basin(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A wash basin on a cabinet (or a pedestal, where it is narrow)."""
    h = 850
    if w >= 600:
        pen.box(20, 150, 0, w - 20, h - 100, d - 40, home.wood)
        for k in range(2):
            pen.box(w * k // 2 + 28, 165, d - 40, w * (k + 1) // 2 - 8, h - 115, d - 22, home.front, skip="B")
    else:
        pen.box(w // 2 - 90, 0, 40, w // 2 + 90, h - 100, 260, CERAMIC, skip="T")
    pen.box(0, h - 110, 0, w, h, d, CERAMIC)
    pen.slab(60, 110, w - 60, d - 50, h + 2, _WATER)
    pen.cylinder(w // 2, 60, h, h + 150, 18, METAL)
    pen.box(w // 2 - 14, h + 130, 60, w // 2 + 14, h + 155, 190, METAL)


def mirror(pen: Pen, w: int, h: int) -> None:
    """A mirror on the wall; the frame's origin is its lower left back corner."""
    pen.box(0, 0, 0, w, h, 20, METAL, skip="B", front=Material("mirror", (255, 255, 255), 0))


def bathtub(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A bath tub along the wall."""
    h, rim = 560, 70
    outside = CERAMIC if rng.chance(50) else (room.panel or CERAMIC)
    pen.box(0, 0, 0, w, h, d, outside, skip="T")
    pen.slab(0, 0, w, rim, h, CERAMIC)
    pen.slab(0, d - rim, w, d, h, CERAMIC)
    pen.slab(0, rim, rim, d - rim, h, CERAMIC)
    pen.slab(w - rim, rim, w, d - rim, h, CERAMIC)
    x0, x1, z0, z1, bottom = rim, w - rim, rim, d - rim, 180
    inside = CERAMIC.tinted(94)
    span = h - bottom
    pen.quad([(x0, bottom, z0), (x1, bottom, z0), (x1, h, z0), (x0, h, z0)], inside, (x1 - x0, span))
    pen.quad([(x1, bottom, z1), (x0, bottom, z1), (x0, h, z1), (x1, h, z1)], inside, (x1 - x0, span))
    pen.quad([(x0, bottom, z1), (x0, bottom, z0), (x0, h, z0), (x0, h, z1)], inside, (z1 - z0, span))
    pen.quad([(x1, bottom, z0), (x1, bottom, z1), (x1, h, z1), (x1, h, z0)], inside, (z1 - z0, span))
    pen.slab(x0, z0, x1, z1, bottom, _WATER)
    pen.box(w - 60, h, d // 2 - 20, w - 20, h + 130, d // 2 + 20, METAL, skip="U")
    pen.box(w - 170, h + 105, d // 2 - 15, w - 60, h + 130, d // 2 + 15, METAL)


def shower(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A shower: a tray between glass screens on all open sides, with a head above."""
    pen.box(0, 0, 0, w, 120, d, CERAMIC)
    pen.slab(60, 60, w - 60, d - 60, 122, _WATER)
    frost = Material("plaster:0", (196, 222, 226))
    for x0, z0, x1, z1 in ((0, d - 25, w, d), (0, 0, 25, d - 25), (w - 25, 0, w, d - 25)):
        pen.box(x0, 120, z0, x1, 1980, z1, frost, skip="U")
        pen.box(x0, 1980, z0, x1, 2010, z1, METAL, skip="U")
    pen.box(w // 2 - 40, 950, d, w // 2 - 15, 1250, d + 25, METAL, skip="B")
    pen.cylinder(w // 2, 60, 120, 2050, 14, METAL, capped=False)
    pen.cylinder(w // 2, 160, 2030, 2060, 110, METAL)
    pen.box(w // 2 - 12, 2040, 60, w // 2 + 12, 2065, 160, METAL)


def washer(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A washing machine."""
    pen.box(0, 0, 0, w, 850, d - 20, WHITE)
    pen.box(0, 720, d - 20, w, 850, d - 8, WHITE.tinted(90), skip="B")
    ring = pen.at(w // 2, 400, d - 20)
    for half, depth, tone in ((190, 12, METAL), (140, 20, BLACK)):
        ring.box(-half, -half * 2 // 3, 0, half, half * 2 // 3, depth, tone, skip="B")
        ring.box(-half * 2 // 3, -half, 0, half * 2 // 3, half, depth - 1, tone, skip="B")


def towel(pen: Pen, rng: Rng, room: RoomStyle) -> None:
    """A towel on a rail; the frame's origin is the rail's left end on the wall."""
    pen.box(0, 0, 40, 500, 20, 60, METAL)
    pen.box(60, -500, 35, 440, 25, 70, Material("fabric:1", room.accent.tinted(115).color, 250))


def shelf_rack(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """Storage shelves with boxes."""
    h = rng.between(1700, 2000, 50)
    for x in (0, w - 30):
        for z in (0, d - 30):
            pen.box(x, 0, z, x + 30, h, z + 30, METAL)
    rows = 4
    for r in range(rows):
        y = 120 + (h - 160) * r // (rows - 1)
        pen.box(0, y, 0, w, y + 20, d, home.wood)
        x = 40
        while x < w - 250 and r < rows - 1:
            bw, bh = rng.between(180, 380, 10), rng.between(150, 360, 10)
            if x + bw < w - 30 and rng.chance(80):
                tone = Material("", (rng.between(120, 220), rng.between(100, 190), rng.between(70, 170)))
                pen.box(x, y + 20, 60, x + bw, y + 20 + bh, d - 50, tone, skip="U")
            x += bw + 30
