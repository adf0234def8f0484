"""Furniture for living, sleeping, eating and working.

Each function draws one piece with a pen whose frame stands on the floor at the piece's back left corner: x to the
right, z towards the room. Sizes are millimetres: w along the wall, d into the room, h up.
"""

from __future__ import annotations

from prnav.scene.houses.builder import Material, Pen
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.style import BLACK, METAL, WHITE, HomeStyle, RoomStyle


def legs(pen: Pen, w: int, d: int, h: int, thick: int, material: Material, inset: int = 20) -> None:
    """Four legs up to height ``h``."""
    for x in (inset, w - inset - thick):
        for z in (inset, d - inset - thick):
            pen.box(x, 0, z, x + thick, h, z + thick, material, skip="T")


def cushion(pen: Pen, x: int, y: int, z: int, w: int, h: int, d: int, material: Material) -> None:
    """A pillow: a box with a narrower one on its front."""
    pen.box(x, y, z, x + w, y + h, z + d, material)
    pen.box(
        x + w // 8, y + h // 8, z + d, x + w - w // 8, y + h - h // 8, z + d + d // 3, material.tinted(106), skip="B"
    )


def bed(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A bed with its head at the wall, made with pillows, cushions and a rolled quilt.

    Pillows, cushions and the rolled quilt stand two of a navmesh's steps of 0.2 m above the cover, which itself is one
    level of them, and no level surface lies hidden under the roll: nothing large is left that a navmesh would take for
    floor.
    """
    head, top = rng.between(950, 1250, 50), 592
    pen.box(0, 0, 0, w, head, 60, home.wood if rng.chance(60) else room.accent)
    pen.box(0, 80, 60, w, 340, d, home.wood, skip="T")
    for x in (30, w - 110):
        for z in (80, d - 110):
            pen.box(x, 0, z, x + 80, 80, z + 80, home.wood, skip="T")
    cover = Material(f"blanket:{rng.below(3)}", room.accent.tinted(118).color, 700)
    start, back = d * rng.between(30, 38) // 100, d - rng.between(780, 840, 10)
    pen.box(20, 340, 65, w - 20, 550, d - 20, WHITE, skip="UT")
    pen.slab(20, 65, w - 20, start, 550, WHITE)
    pen.box(0, 300, start, w, top, d, cover, skip="UT")
    pen.slab(0, start, w, back + 5, top, cover)
    pen.slab(0, back + 355, w, d, top, cover)
    pen.box(0, top, start, w, top + 5, start + 230, WHITE.tinted(96), skip="U")
    count = 1 if w < 1300 else 2
    width = (w - 80) // count
    for k in range(count):  # two pillows, one on the other
        x = 40 + k * width
        pen.box(x + 20, 550, 90, x + width - 20, 685, 450, WHITE)
        pen.box(x + 20, 685, 90, x + width - 20, 815, 450, WHITE.tinted(97), skip="U")
    if w > 1450 or rng.chance(50):
        for k in range(count):
            cushion(pen, 40 + k * width + width // 6, top, 440, width * 2 // 3, 330, 110, home.fabric)
    roll(pen, 0, w, top, back, cover.tinted(rng.choice((84, 112))))


def roll(pen: Pen, x0: int, x1: int, y: int, z: int, material: Material) -> None:
    """A quilt rolled back across a bed: rounded, and too steep at its sides for a navmesh to join it to the cover."""
    profile = ((0, 0), (0, 216), (75, 255), (180, 270), (285, 255), (360, 216), (360, 0))
    for k, ((za, ya), (zb, yb)) in enumerate(zip(profile, profile[1:], strict=False)):
        corners = [(x0, y + yb, z + zb), (x1, y + yb, z + zb), (x1, y + ya, z + za), (x0, y + ya, z + za)]
        pen.quad(corners, material, (x1 - x0, 120), origin=(0, 120 * k))
    for x, turn in ((x0, False), (x1, True)):
        for k in range(3):
            (za, ya), (zb, yb) = profile[k], profile[k + 1]
            (zc, yc), (zd, yd) = profile[5 - k], profile[6 - k]
            corners = [(x, y + ya, z + za), (x, y + yd, z + zd), (x, y + yc, z + zc), (x, y + yb, z + zb)]
            if k == 2:  # the two middle points of the profile fall together
                corners = [
                    (x, y + ya, z + za),
                    (x, y + yd, z + zd),
                    (x, y + yb, z + zb),
                    (x, y + (ya + yb) // 2, z + (za + zb) // 2),
                ]
            pen.quad(corners[::-1] if turn else corners, material.tinted(88), (300, 100))


def nightstand(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A nightstand, with a lamp on it."""
    h = rng.between(450, 550, 10)
    pen.box(0, 0, 0, w, h, d, home.wood)
    for k in range(2):
        y = 60 + k * (h - 90) // 2
        pen.box(20, y, d, w - 20, y + (h - 130) // 2, d + 15, home.front, skip="B")
        pen.box(w // 2 - 40, y + (h - 130) // 4, d + 15, w // 2 + 40, y + (h - 130) // 4 + 15, d + 35, METAL, skip="B")
    if rng.chance(75):
        table_lamp(pen.at(w // 2, h, d // 2), rng, home)


def table_lamp(pen: Pen, rng: Rng, home: HomeStyle) -> None:
    """A small lamp around the frame's origin."""
    pen.cylinder(0, 0, 0, 25, 70, METAL)
    pen.cylinder(0, 0, 25, 230, 20, METAL)
    shade = Material("fabric:0", (255, 240, 205), 300, glow=True)
    pen.cylinder(0, 0, 200, 400, 140, shade, top_radius=90)


def floor_lamp(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A standing lamp."""
    x, z, h = w // 2, d // 2, rng.between(1350, 1650, 10)
    pen.cylinder(x, z, 0, 30, 150, BLACK if rng.chance(50) else METAL)
    pen.cylinder(x, z, 30, h - 200, 16, METAL, capped=False)
    pen.cylinder(x, z, h - 250, h, 190, Material("fabric:0", (255, 238, 200), 300, glow=True), top_radius=140)


def wardrobe(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A wardrobe with doors."""
    h = rng.between(1950, 2200, 50)
    front = home.front if rng.chance(60) else home.wood
    pen.box(0, 0, 0, w, h, d - 25, home.wood)
    doors = max(2, w // 500)
    mirror = rng.below(doors * 2)
    for k in range(doors):
        x0, x1 = w * k // doors + 6, w * (k + 1) // doors - 6
        pen.box(
            x0,
            80,
            d - 25,
            x1,
            h - 20,
            d,
            front,
            front=Material("mirror", (255, 255, 255), 0) if k == mirror else None,
            skip="B",
        )
        handle = x1 - 60 if k % 2 == 0 else x0 + 40
        pen.box(handle, 950, d, handle + 20, 1150, d + 25, METAL, skip="B")


def dresser(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A chest of drawers, with something on top."""
    h = rng.between(750, 950, 50)
    pen.box(0, 80, 0, w, h, d - 20, home.wood)
    legs(pen, w, d - 20, 80, 50, home.wood)
    rows, columns = 3, 2 if w > 900 else 1
    for r in range(rows):
        for c in range(columns):
            x0, x1 = w * c // columns + 15, w * (c + 1) // columns - 15
            y0, y1 = 110 + (h - 140) * r // rows, 110 + (h - 140) * (r + 1) // rows - 20
            pen.box(x0, y0, d - 20, x1, y1, d, home.front, skip="B")
            pen.box(
                (x0 + x1) // 2 - 60,
                (y0 + y1) // 2,
                d,
                (x0 + x1) // 2 + 60,
                (y0 + y1) // 2 + 18,
                d + 22,
                METAL,
                skip="B",
            )
    vase(pen.at(w // 5, h, d // 2), rng)
    if rng.chance(60):
        picture_frame(pen.at(w * 3 // 5, h, 60), rng, 260, 330, home)


def vase(pen: Pen, rng: Rng) -> None:
    """A vase around the frame's origin."""
    tone = Material("", (rng.between(60, 240), rng.between(60, 240), rng.between(60, 240)))
    h = rng.between(180, 320, 10)
    pen.cylinder(0, 0, 0, h * 6 // 10, 50, tone, top_radius=80, capped=False)
    pen.cylinder(0, 0, h * 6 // 10, h, 80, tone, top_radius=45)
    if rng.chance(60):
        pen.cylinder(0, 0, h, h + 220, 30, Material("leaves", (255, 255, 255), 300), top_radius=120)


def picture_frame(pen: Pen, rng: Rng, w: int, h: int, home: HomeStyle) -> None:
    """A framed picture; the frame's origin is its lower left back corner."""
    art = Material(f"picture:{rng.below(8)}", (255, 255, 255), 0)
    border = 30
    trim = rng.choice((BLACK, WHITE, home.dark_wood, home.wood))
    pen.box(0, 0, 0, w, h, 25, trim, skip="B")
    pen.panel(border, border, w - border, h - border, 27, art)


def sofa(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A sofa (or an armchair, where it is narrow)."""
    fabric = room.accent
    arm = rng.between(120, 200, 10)
    seat, back = rng.between(410, 430, 10), rng.between(880, 930, 10)
    pen.box(0, 60, 0, w, 300, d - 20, fabric.tinted(92))
    legs(pen, w, d - 20, 60, 50, home.dark_wood, 30)
    pen.box(arm, 300, 0, w - arm, back, 220, fabric, skip="U")
    for x in (0, w - arm):
        pen.box(x, 300, 0, x + arm, seat + 150, d - 20, fabric.tinted(97), skip="U")
    count = max(1, (w - 2 * arm) // 620)
    width = (w - 2 * arm) // count
    for k in range(count):
        x = arm + k * width
        pen.box(x + 6, 300, 200, x + width - 6, seat, d, fabric.tinted(108), skip="U")
        pen.box(x + 10, seat, 210, x + width - 10, back - 50, 330, fabric.tinted(104), skip="U")
    for k in range(count):
        if rng.chance(65):
            tone = home.fabric if rng.chance(70) else WHITE
            cushion(pen, arm + k * width + rng.between(10, max(10, width - 420), 10), seat, 340, 400, 410, 110, tone)


def coffee_table(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A low table; some are round."""
    h = rng.between(410, 470, 10)
    if rng.chance(30):
        r = min(w, d) // 2
        pen.cylinder(w // 2, d // 2, h - 40, h, r, home.dark_wood, sides=12)
        pen.cylinder(w // 2, d // 2, 0, h - 40, r * 2 // 3, home.dark_wood.tinted(85), sides=8, capped=False)
    else:
        pen.box(0, h - 45, 0, w, h, d, home.dark_wood)
        legs(pen, w, d, h - 45, 60, home.dark_wood)
        pen.box(60, 120, 60, w - 60, 145, d - 60, home.dark_wood)
    books(pen.at(w // 2 - 60, h, d // 2 - 50), rng)
    if rng.chance(50):
        vase(pen.at(w // 4, h, d // 2), rng)


def books(pen: Pen, rng: Rng) -> None:
    """A small pile of books."""
    y = 0
    for _ in range(rng.between(1, 4)):
        w, d, h = rng.between(160, 240), rng.between(120, 180), rng.between(18, 40)
        tone = Material("", (rng.between(50, 230), rng.between(50, 230), rng.between(50, 230)))
        pen.box(0, y, 0, w, y + h, d, tone)
        y += h


def tv_stand(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A low cabinet with a television."""
    h = rng.between(420, 520, 10)
    pen.box(0, 60, 0, w, h, d - 20, home.wood)
    legs(pen, w, d - 20, 60, 60, BLACK)
    doors = max(2, w // 500)
    for k in range(doors):
        pen.box(w * k // doors + 8, 80, d - 20, w * (k + 1) // doors - 8, h - 20, d, home.front, skip="B")
    tv = min(w - 100, rng.between(900, 1300, 50))
    tall = tv * 9 // 16
    x = (w - tv) // 2
    pen.box(w // 2 - 150, h, d // 2 - 100, w // 2 + 150, h + 15, d // 2 + 80, BLACK, skip="U")
    pen.box(w // 2 - 30, h + 15, d // 2 - 30, w // 2 + 30, h + 80, d // 2, BLACK, skip="U")
    pen.box(x, h + 60, d // 2 - 25, x + tv, h + 60 + tall, d // 2 + 25, BLACK)
    pen.panel(x + 15, h + 75, x + tv - 15, h + 45 + tall, d // 2 + 27, Material("screen", (255, 255, 255), 0))


def bookshelf(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """An open shelf with books."""
    h, t = rng.between(1400, 2100, 50), 25
    pen.box(0, 0, 0, w, h, 15, home.wood.tinted(80))
    pen.box(0, 0, 15, t, h, d, home.wood, skip="B")
    pen.box(w - t, 0, 15, w, h, d, home.wood, skip="B")
    rows = max(3, h // 360)
    for r in range(rows + 1):
        y = 60 + (h - 60 - t) * r // rows
        pen.box(t, y, 15, w - t, y + t, d, home.wood, skip="BLR")
        if r == rows:
            break
        space = (h - 60 - t) // rows - t
        fill = rng.below(4)
        if fill < 3:
            tall, x1 = space * rng.between(70, 92) // 100, t + (w - 2 * t) * rng.between(55, 100) // 100
            row = Material(f"books:{rng.below(4)}", (255, 255, 255), 0)
            pen.box(t, y + t, 15, x1, y + t + tall, d - 60, Material("", (140, 120, 100)), front=row, skip="BU")
        else:
            vase(pen.at(w // 2, y + t, d // 2), Rng(rng.bits()))
    pen.box(t, 0, d - 30, w - t, 60, d - 20, home.wood, skip="TUB")


def desk(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A desk with a screen, a lamp and books."""
    h = 740
    pen.box(0, h - 35, 0, w, h, d, home.wood)
    pen.box(20, 0, 20, 420, h - 35, d - 40, home.wood.tinted(92), skip="T")
    for k in range(3):
        pen.box(35, 60 + k * 210, d - 40, 405, 250 + k * 210, d - 22, home.front, skip="B")
    for z in (30, d - 80):
        pen.box(w - 70, 0, z, w - 20, h - 35, z + 50, home.wood, skip="T")
    x = w // 2
    pen.box(x - 110, h, 120, x + 110, h + 12, 290, BLACK, skip="U")
    pen.box(x - 20, h + 12, 170, x + 20, h + 140, 195, BLACK, skip="U")
    pen.box(x - 280, h + 110, 195, x + 280, h + 450, 225, BLACK)
    pen.panel(x - 265, h + 125, x + 265, h + 435, 226, Material(f"picture:{rng.below(8)}", (255, 255, 255), 0, True))
    pen.box(x - 210, h, 360, x + 210, h + 20, 490, BLACK if rng.chance(50) else WHITE, skip="U")
    books(pen.at(w - 300, h, 120), rng)
    if rng.chance(60):
        table_lamp(pen.at(170, h, 180), rng, home)


def chair(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle, wood: Material | None = None) -> None:
    """A chair that looks to +z, its back at z = 0."""
    wood = wood or home.dark_wood
    legs(pen, w, d, 430, 40, wood, 5)
    pen.box(0, 430, 0, w, 475, d, room.accent)
    for x in (5, w - 45):
        pen.box(x, 475, 5, x + 40, 880, 40, wood, skip="U")
    pen.box(45, 620, 8, w - 45, 860, 34, wood)


def office_chair(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A swivel chair."""
    x, z = w // 2, d // 2
    pen.box(x - 230, 30, z - 25, x + 230, 80, z + 25, BLACK)
    pen.box(x - 25, 30, z - 230, x + 25, 80, z + 230, BLACK)
    pen.cylinder(x, z, 80, 420, 30, METAL, capped=False)
    pen.box(20, 420, 40, w - 20, 500, d - 10, room.accent)
    pen.box(40, 560, 30, w - 40, 1000, 90, room.accent)
    pen.box(x - 30, 450, 20, x + 30, 620, 40, BLACK)


def dining_table(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A table to eat at."""
    if w == d and rng.chance(70):
        pen.cylinder(w // 2, d // 2, 705, 745, w // 2, home.wood, sides=12)
        pen.cylinder(w // 2, d // 2, 40, 705, 70, home.wood, capped=False)
        pen.cylinder(w // 2, d // 2, 0, 40, w // 4, home.wood, sides=12)
    else:
        pen.box(0, 705, 0, w, 745, d, home.wood)
        legs(pen, w, d, 705, 70, home.wood)
        pen.box(60, 630, 60, w - 60, 705, d - 60, home.wood.tinted(90), skip="TU")
    if rng.chance(70):
        bowl = Material("", (rng.between(90, 245), rng.between(90, 245), rng.between(90, 245)))
        pen.cylinder(w // 2, d // 2, 745, 820, 70, bowl, top_radius=140)
        for k in range(3):
            fruit = Material("", rng.choice(((214, 60, 40), (240, 180, 40), (120, 180, 60))))
            pen.box(w // 2 - 90 + 60 * k, 815, d // 2 - 35, w // 2 - 35 + 60 * k, 870, d // 2 + 30, fruit, skip="U")
    else:
        vase(pen.at(w // 2, 745, d // 2), rng)


def pendant(pen: Pen, rng: Rng, drop: int, home: HomeStyle) -> None:
    """A lamp that hangs from the ceiling; the frame's origin is at the ceiling."""
    shade = Material("fabric:0", (255, 242, 212), 300, glow=True)
    pen.cylinder(0, 0, -drop + 180, 0, 8, BLACK, capped=False)
    pen.cylinder(0, 0, -30, 0, 60, WHITE, capped=False)
    if rng.chance(50):
        pen.cylinder(0, 0, -drop, -drop + 200, 220, shade, top_radius=80)
    else:
        pen.cylinder(0, 0, -drop, -drop + 90, 90, shade, top_radius=170, sides=12)
        pen.cylinder(0, 0, -drop + 90, -drop + 200, 170, shade, top_radius=100, sides=12)


def ceiling_lamp(pen: Pen, rng: Rng, home: HomeStyle) -> None:
    """A flat lamp on the ceiling; the frame's origin is at the ceiling."""
    pen.cylinder(0, 0, -90, 0, 150, Material("", (255, 246, 224), 1000, glow=True), top_radius=190, sides=12)


def plant(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A plant in a pot."""
    x, z = w // 2, d // 2
    pot = Material("", rng.choice(((186, 104, 72), (240, 240, 236), (70, 74, 80), (200, 180, 150))))
    ph = rng.between(260, 380, 10)
    pen.cylinder(x, z, 0, ph, 120, pot, top_radius=170, cap=Material("", (70, 50, 36)))
    leaf = Material("leaves", (rng.between(200, 255), 255, rng.between(190, 240)), 400)
    h = rng.between(500, 1000, 10)
    pen.cylinder(x, z, ph, ph + h // 3, 16, Material("", (96, 72, 48)), capped=False)
    pen.cylinder(x, z, ph + h // 4, ph + h // 2, 70, leaf, top_radius=200)
    pen.cylinder(x, z, ph + h // 2, ph + h * 3 // 4, 210, leaf, top_radius=150)
    pen.cylinder(x, z, ph + h * 3 // 4, ph + h, 140, leaf, top_radius=30)


def rug(pen: Pen, rng: Rng, w: int, d: int, h: int) -> None:
    """A rug, ``h`` thick."""
    pen.box(0, 0, 0, w, h, d, Material("", (170, 160, 150)), top=Material(f"rug:{rng.below(8)}", (255, 255, 255), 0))
