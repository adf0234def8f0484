"""More furniture, and what hangs on walls; see pieces.py for the frame."""

from __future__ import annotations

from prnav.scene.houses.builder import Color, Material, Pen, polygon
from prnav.scene.houses.pieces import legs, vase
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.style import BLACK, CERAMIC, METAL, WHITE, HomeStyle, RoomStyle

_TOYS: tuple[Color, ...] = ((220, 60, 50), (240, 190, 50), (60, 130, 200), (90, 170, 90), (180, 90, 170))
_GLASS = Material("mirror", (225, 235, 240), 0)


def curtain(pen: Pen, w: int, h: int, fabric: Material) -> None:
    """One side of a pair of curtains, hanging down from the frame's origin at its upper left corner."""
    folds = max(3, w // 60)
    for k in range(folds):
        x0, x1 = w * k // folds, w * (k + 1) // folds
        depth, tone = (75, 100) if k % 2 == 0 else (48, 84)
        pen.box(x0, -h, 25, x1, 0, depth, fabric.tinted(tone), skip="TUB")


def curtain_rod(pen: Pen, w: int) -> None:
    """A rod along x from the frame's origin."""
    pen.box(-60, 0, 40, w + 60, 25, 65, BLACK)
    for x in (-85, w + 60):
        pen.box(x, -10, 30, x + 25, 35, 75, METAL)
    for x in (20, w - 40):
        pen.box(x, 0, 0, x + 20, 20, 40, METAL, skip="B")


def radiator(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A ribbed radiator on the wall."""
    count = w // 70
    for k in range(count):
        pen.box(k * w // count + 6, 110, 10, (k + 1) * w // count - 6, 600, d, WHITE, skip="B")
    pen.box(0, 130, 15, w, 165, d - 15, WHITE.tinted(92), skip="B")
    pen.box(0, 545, 15, w, 580, d - 15, WHITE.tinted(92), skip="B")
    pen.box(w - 30, 0, 30, w - 12, 130, 48, METAL, skip="T")


def wall_clock(pen: Pen, rng: Rng, home: HomeStyle) -> None:
    """A round clock of 0.36 m; the frame's origin is its centre on the wall."""
    rim, dial = rng.choice((BLACK, home.dark_wood, METAL)), Material("", (246, 244, 236))
    _plate(pen, 180, 30, rim, rim=True)
    _plate(pen, 158, 33, dial)
    pen.panel(-6, -10, 6, 95, 38, BLACK)
    pen.panel(-10, -7, 70, 7, 39, BLACK)


def _plate(pen: Pen, radius: int, z: int, material: Material, rim: bool = False) -> None:
    """A round plate that faces +z around the frame's origin."""
    ring = [(a * radius // 10000, b * radius // 10000, z) for a, b in polygon(12)]
    for k in range(5):
        pen.quad([ring[k], ring[k + 1], ring[10 - k], ring[11 - k]], material, (radius, radius // 2))
    for (ax, ay, _), (bx, by, _) in zip(ring, [*ring[1:], ring[0]], strict=True):
        if rim:
            pen.quad([(ax, ay, 0), (bx, by, 0), (bx, by, z), (ax, ay, z)], material.tinted(85), (radius // 2, z))


def wall_shelf(pen: Pen, rng: Rng, w: int, home: HomeStyle) -> None:
    """A board with books and a vase; the frame's origin is its lower left corner on the wall."""
    pen.box(0, 0, 0, w, 28, 220, home.wood, skip="B")
    for x in (60, w - 90):
        pen.box(x, -110, 0, x + 24, 0, 24, METAL, skip="TB")
    end = w * rng.between(45, 60) // 100
    row = Material(f"books:{rng.below(4)}", (255, 255, 255), 0)
    pen.box(40, 28, 30, end, 250, 190, Material("", (140, 120, 100)), front=row, skip="BU")
    vase(pen.at(w - 120, 28, 110), Rng(rng.bits()))


def wall_lamp(pen: Pen, rng: Rng, home: HomeStyle) -> None:
    """A lamp on the wall; the frame's origin is its middle."""
    pen.box(-45, -60, 0, 45, 60, 20, METAL, skip="B")
    pen.box(-12, -12, 20, 12, 12, 90, METAL, skip="B")
    pen.cylinder(0, 110, 0, 170, 60, Material("fabric:0", (255, 240, 205), 300, glow=True), top_radius=90)


def coat_rack(pen: Pen, rng: Rng, w: int, home: HomeStyle, room: RoomStyle) -> None:
    """A board with hooks, coats and a bag; the frame's origin is its lower left corner on the wall."""
    pen.box(0, 0, 0, w, 140, 22, home.wood, skip="B")
    pen.box(0, 140, 0, w, 160, 200, home.wood, skip="B")
    count = max(3, w // 220)
    for k in range(count):
        x = w * (2 * k + 1) // (2 * count)
        pen.box(x - 10, 50, 22, x + 10, 75, 80, METAL, skip="B")
        if rng.chance(65):
            tone = rng.choice((home.fabric, room.accent, BLACK.tinted(190), Material("fabric:1", (120, 100, 80), 300)))
            long = rng.between(650, 950, 10)
            pen.box(x - 95, -long, 24, x + 95, 40, 130, tone.tinted(rng.between(80, 110)), skip="B")
            pen.box(x - 130, -long + 250, 30, x - 95, 0, 105, tone.tinted(75), skip="B")
            pen.box(x + 95, -long + 250, 30, x + 130, 0, 105, tone.tinted(75), skip="B")


def shoe_cabinet(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A shallow cabinet with flaps, keys and post on it."""
    h = rng.between(950, 1150, 50)
    pen.box(0, 60, 0, w, h, d - 18, home.wood)
    legs(pen, w, d - 18, 60, 35, BLACK, 10)
    for k in range(3):
        y = 75 + k * (h - 90) // 3
        pen.box(10, y, d - 18, w - 10, y + (h - 90) // 3 - 12, d, home.front, skip="B")
        pen.box(w // 2 - 45, y + (h - 90) // 3 - 60, d, w // 2 + 45, y + (h - 90) // 3 - 45, d + 15, METAL, skip="B")
    pen.cylinder(w // 4, d // 2, h, h + 45, 50, CERAMIC, top_radius=80)
    pen.box(w // 2, h, 60, w // 2 + 220, h + 8, 200, WHITE, skip="U")


def console(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A narrow table with a lower board."""
    pen.box(0, 790, 0, w, 830, d, home.dark_wood)
    legs(pen, w, d, 790, 40, home.dark_wood, 8)
    pen.box(30, 180, 20, w - 30, 205, d - 20, home.dark_wood)
    vase(pen.at(w // 4, 830, d // 2), rng)
    pen.box(w // 2, 205, 40, w // 2 + 300, 400, d - 40, Material("carpet:0", (190, 150, 100), 200), skip="U")
    pen.box(w * 2 // 3, 830, d // 3, w * 2 // 3 + 180, 850, d // 3 + 130, home.fabric)


def bench(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A bench with a cushion."""
    pen.box(0, 390, 0, w, 430, d, home.wood)
    legs(pen, w, d, 390, 55, home.wood, 15)
    pen.box(15, 430, 15, w - 15, 485, d - 15, room.accent, skip="U")


def pouf(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A round stool of cloth."""
    tone = rng.choice((home.fabric, room.accent))
    pen.cylinder(w // 2, d // 2, 0, 190, w * 42 // 100, tone.tinted(88), top_radius=w // 2, capped=False, sides=12)
    pen.cylinder(w // 2, d // 2, 190, 380, w // 2, tone, top_radius=w * 40 // 100, sides=12)


def armchair(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """An open armchair: a wooden frame with a seat and a back of cloth."""
    wood, cloth = home.dark_wood, rng.choice((home.fabric, room.accent))
    for x in (0, w - 55):
        pen.box(x, 0, d - 90, x + 55, 600, d - 40, wood)
        pen.box(x, 0, 40, x + 55, 600, 90, wood)
        pen.box(x - 8, 600, 20, x + 63, 632, d - 20, wood)
    pen.box(55, 260, 50, w - 55, 420, d - 20, cloth)
    pen.box(60, 420, 40, w - 60, 920, 170, cloth.tinted(94), skip="U")
    pen.box(60, 330, 20, w - 60, 900, 42, wood)


def piano(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """An upright piano."""
    body = BLACK if rng.chance(60) else home.dark_wood
    pen.box(0, 0, 0, w, 1220, 330, body)
    pen.box(0, 600, 330, w, 720, d, body)
    pen.slab(70, 370, w - 70, d - 30, 724, Material("", (246, 244, 236)), up=True)
    for k in range(18):
        if k % 7 in (2, 6):
            continue
        x = 90 + (w - 200) * k // 18
        pen.box(x, 724, 370, x + (w - 200) * 55 // 1800, 734, 470, BLACK, skip="UB")
    for x in (20, w - 90):
        pen.box(x, 0, d - 90, x + 70, 600, d - 20, body, skip="T")
    pen.box(w // 2 - 230, 860, 330, w // 2 + 230, 1090, 345, WHITE.tinted(96), skip="B")
    pen.box(w // 2 - 60, 60, 330, w // 2 + 60, 80, 380, Material("", (200, 160, 70)), skip="B")


def fireplace(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A chimney breast with a fire in it and things on the mantelpiece."""
    stone = Material("brick", (206, 150, 124), 900) if rng.chance(50) else Material("marble", (232, 228, 220), 900)
    side, top = (w - 700) // 2, 760
    pen.box(0, 0, 0, side, 1120, d, stone)
    pen.box(w - side, 0, 0, w, 1120, d, stone)
    pen.box(side, top, 0, w - side, 1120, d, stone, skip="TLR")
    pen.box(-60, 1120, 0, w + 60, 1180, d + 70, home.dark_wood)
    soot = Material("", (46, 40, 38))
    pen.panel(side, 0, w - side, top, 30, soot)
    pen.quad([(side, 0, d), (side, 0, 30), (side, top, 30), (side, top, d)], soot, (d, top))
    pen.quad([(w - side, 0, 30), (w - side, 0, d), (w - side, top, d), (w - side, top, 30)], soot, (d, top))
    for k in range(3):
        x = w // 2 - 200 + 130 * k
        pen.box(x, 20 + 50 * (k % 2), 90, x + 150, 100 + 50 * (k % 2), d - 60, Material("wood:1", (110, 72, 48), 300))
    pen.cylinder(w // 2, d // 2, 90, 330, 130, Material("", (255, 176, 70), 1000, glow=True), top_radius=25)
    pen.cylinder(w // 2 + 20, d // 2 + 20, 90, 250, 80, Material("", (255, 220, 120), 1000, glow=True), top_radius=12)
    vase(pen.at(80, 1180, d // 2), rng)
    vase(pen.at(w - 110, 1180, d // 2), rng)


def island(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A kitchen island with an overhanging top, fruit and a board on it; people sit at its high-z side."""
    pen.box(0, 0, 0, w, 90, d - 250, BLACK, skip="T")
    pen.box(0, 90, 0, w, 860, d - 250, home.front, skip="T")
    for k in range(max(1, w // 500)):
        count = max(1, w // 500)
        x0, x1 = w * k // count + 8, w * (k + 1) // count - 8
        pen.quad([(x1, 110, -15), (x0, 110, -15), (x0, 840, -15), (x1, 840, -15)], home.front.tinted(106), (500, 730))
        pen.box((x0 + x1) // 2 - 60, 770, -40, (x0 + x1) // 2 + 60, 785, -15, METAL)
    pen.box(-30, 860, -30, w + 30, 905, d, home.counter)
    for x in (20, w - 80):
        pen.box(x, 0, d - 110, x + 60, 860, d - 50, home.wood, skip="T")
    bowl = Material("", (rng.between(90, 245), rng.between(90, 245), rng.between(90, 245)))
    pen.cylinder(w // 3, d // 2, 905, 975, 80, bowl, top_radius=150)
    for k in range(3):
        pen.box(w // 3 - 90 + 60 * k, 970, d // 2 - 30, w // 3 - 40 + 60 * k, 1020, d // 2 + 25,
                Material("", rng.choice(((214, 60, 40), (240, 180, 40), (120, 180, 60)))), skip="U")  # fmt: skip
    pen.box(w * 2 // 3, 905, d // 2 - 150, w * 2 // 3 + 260, 925, d // 2 + 80, home.wood.tinted(112), skip="U")


def bar_stool(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A high stool with a short back at z = d."""
    x, z = w // 2, d // 2
    pen.cylinder(x, z, 0, 25, 170, METAL, sides=12)
    pen.cylinder(x, z, 25, 640, 24, METAL, capped=False)
    pen.cylinder(x, z, 640, 700, 180, room.accent, sides=12)
    pen.box(x - 150, 720, z + 130, x + 150, 900, z + 165, room.accent)


def oven_tower(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A tall kitchen cabinet with an oven at chest height."""
    pen.box(0, 0, 0, w, 90, d - 70, BLACK, skip="T")
    pen.box(0, 90, 0, w, 2150, d - 20, home.front)
    for y0, y1 in ((100, 690), (1400, 2140)):
        pen.box(6, y0, d - 20, w - 6, y1, d, home.front.tinted(106), skip="B")
        pen.box(w - 70, y0 + 60, d, w - 52, y0 + 260, d + 22, METAL, skip="B")
    pen.box(8, 700, d - 20, w - 8, 1390, d, METAL, skip="B")
    pen.panel(50, 760, w - 50, 1180, d + 2, Material("screen", (255, 255, 255), 0))
    pen.box(50, 1210, d, w - 50, 1230, d + 40, METAL, skip="B")
    for k in range(4):
        pen.box(60 + k * (w - 150) // 3, 1290, d, 90 + k * (w - 150) // 3, 1320, d + 20, BLACK, skip="B")


def display_cabinet(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A cabinet with crockery on open shelves above doors."""
    h, low = rng.between(1850, 2050, 50), 780
    pen.box(0, 0, 0, w, low, d, home.dark_wood)
    for k in range(2):
        x0, x1 = w * k // 2 + 12, w * (k + 1) // 2 - 12
        pen.box(x0, 60, d, x1, low - 40, d + 15, home.front, skip="B")
        pen.box(x1 - 60 if k == 0 else x0 + 40, low // 2, d + 15, x1 - 40 if k == 0 else x0 + 60, low // 2 + 90,
                d + 35, METAL, skip="B")  # fmt: skip
    deep = d * 2 // 3
    pen.panel(0, low, w, h, 12, home.dark_wood.tinted(75))
    for x in (0, w - 28):
        pen.box(x, low, 12, x + 28, h, deep, home.dark_wood, skip="B")
    for r in range(4):
        y = low + 40 + (h - low - 70) * r // 3
        pen.box(28, y, 12, w - 28, y + 24, deep, home.dark_wood, skip="BLR")
        if r == 3:
            break
        for k in range(max(2, w // 230)):
            x = 28 + (w - 56) * (2 * k + 1) // (2 * max(2, w // 230))
            tone = Material("", rng.choice(((246, 244, 238), (180, 200, 214), (214, 150, 110), (140, 170, 150))))
            kind = rng.below(3)
            if kind == 0:
                pen.cylinder(x, deep // 2, y + 24, y + rng.between(110, 190), 40, tone, top_radius=62)
            elif kind == 1:
                for level in range(rng.between(2, 5)):
                    pen.box(x - 75, y + 24 + level * 14, deep // 2 - 70, x + 75, y + 34 + level * 14, deep // 2 + 70,
                            tone, skip="U")  # fmt: skip
            else:
                pen.box(x - 80, y + 24, 40, x + 80, y + 190, 55, tone, skip="U")


def dressing_table(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A dressing table with a mirror and bottles."""
    pen.box(0, 640, 0, w, 740, d, home.wood)
    legs(pen, w, d, 640, 45, home.wood, 10)
    for k in range(2):
        x0 = 20 + k * (w - 20) // 2
        pen.box(x0, 655, d, x0 + w // 2 - 30, 725, d + 14, home.front, skip="B")
        pen.box(x0 + w // 4 - 25, 682, d + 14, x0 + w // 4 + 15, 698, d + 30, METAL, skip="B")
    pen.box(w // 2 - 280, 800, 0, w // 2 + 280, 1400, 30, home.wood, skip="B", front=_GLASS)
    pen.box(w // 2 - 30, 740, 0, w // 2 + 30, 800, 30, home.wood)
    for k in range(rng.between(3, 5)):
        tone = Material("", (rng.between(120, 245), rng.between(90, 220), rng.between(120, 230)))
        pen.cylinder(90 + 75 * k, 120 + 40 * (k % 2), 740, 740 + rng.between(70, 150), 22, tone)


def filing_cabinet(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A cabinet of drawers with a printer on it."""
    body = rng.choice((METAL, WHITE, home.wood))
    h = 700
    pen.box(0, 20, 0, w, h, d - 15, body.tinted(92))
    for k in range(3):
        y = 30 + k * 222
        pen.box(6, y, d - 15, w - 6, y + 212, d, body, skip="B")
        pen.box(w // 2 - 60, y + 150, d, w // 2 + 60, y + 168, d + 20, BLACK, skip="B")
    pen.box(30, h, 60, w - 30, h + 190, d - 60, BLACK.tinted(150), skip="U")
    pen.box(60, h + 190, 90, w - 60, h + 215, d - 150, WHITE, skip="U")


def toy_box(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """An open chest full of toys."""
    h, tone = 420, Material("", rng.choice(_TOYS))
    pen.box(0, 0, 0, w, h, d, home.wood, front=tone, skip="T")
    for k in range(rng.between(5, 8)):
        x, z, size = rng.between(20, w - 160, 10), rng.between(20, d - 150, 10), rng.between(90, 140, 10)
        y = h - rng.between(40, 110)
        toy = Material("", rng.choice(_TOYS))
        if k % 3 == 0:
            pen.cylinder(x + 70, z + 70, y, y + size + 60, 60, toy, top_radius=30)
        else:
            pen.box(x, y, z, x + size, y + size + 40, z + size, toy, skip="U")
    pen.slab(0, 0, w, d, h - 60, home.wood.tinted(70))


def crib(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A child's bed with bars."""
    wood = WHITE if rng.chance(50) else home.wood
    for x in (0, w - 50):
        for z in (0, d - 50):
            pen.box(x, 0, z, x + 50, 950, z + 50, wood)
    pen.box(50, 300, 30, w - 50, 440, d - 30, WHITE.tinted(96))
    pen.box(w // 3, 440, 40, w - 60, 470, d - 40, room.accent, skip="U")
    for z in (12, d - 38):
        pen.box(50, 880, z, w - 50, 920, z + 26, wood)
        pen.box(50, 260, z, w - 50, 300, z + 26, wood)
        for k in range(1, w // 100):
            x = 50 + (w - 100) * k // (w // 100)
            pen.box(x - 9, 300, z + 4, x + 9, 880, z + 22, wood, skip="TU")
    for x in (10, w - 40):
        pen.box(x, 260, 50, x + 30, 920, d - 50, wood)


def laundry_basket(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A wicker basket with clothes."""
    wicker = Material("carpet:0", (206, 170, 120), 150)
    pen.cylinder(w // 2, d // 2, 0, 520, w * 38 // 100, wicker, top_radius=w // 2 - 10, sides=12, cap=home.fabric)
    pen.box(w // 4, 515, d // 3, w * 3 // 4, 575, d * 3 // 4, room.accent.tinted(115), skip="U")


def waste_bin(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A waste bin."""
    tone = rng.choice((METAL, BLACK, home.fabric))
    pen.cylinder(w // 2, d // 2, 0, 300, w * 36 // 100, tone, top_radius=w // 2 - 5, cap=BLACK.tinted(130))


def aquarium(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A lit fish tank on a cabinet."""
    pen.box(0, 0, 0, w, 700, d, home.dark_wood)
    for k in range(2):
        pen.box(w * k // 2 + 10, 40, d, w * (k + 1) // 2 - 10, 680, d + 14, home.front, skip="B")
    water = Material("", (96, 190, 214), 1000, glow=True)
    pen.box(15, 700, 15, w - 15, 1120, d - 15, water, skip="U")
    pen.box(15, 700, d - 15, w - 15, 760, d - 12, Material("", (206, 186, 140)), skip="B")
    for k in range(4):
        x = 60 + (w - 160) * k // 4
        y = 800 + 70 * (k * 3 % 4)
        pen.panel(x, y, x + 70, y + 35, d - 11, Material("", rng.choice(_TOYS)))
        pen.panel(x + 20, 760, x + 38, 760 + rng.between(80, 240), d - 12, Material("leaves", (200, 255, 200), 200))
    pen.box(0, 1120, 0, w, 1160, d, BLACK)


def trolley(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A serving trolley with bottles."""
    for x in (0, w - 22):
        for z in (0, d - 22):
            pen.box(x, 40, z, x + 22, 820, z + 22, METAL, skip="T")
            pen.box(x, 0, z, x + 22, 40, z + 22, BLACK, skip="T")
    for y in (200, 500, 800):
        pen.box(0, y, 0, w, y + 20, d, home.wood)
        for k in range(rng.between(2, 3)):
            tone = Material("", rng.choice(((60, 96, 60), (120, 60, 40), (200, 190, 150), (70, 100, 140))))
            x, z = 90 + (w - 160) * k // 3, d // 2 - 40 + 70 * (k % 2)
            pen.cylinder(x, z, y + 20, y + 150, 36, tone, top_radius=30)
            pen.cylinder(x, z, y + 150, y + 220, 12, tone)


def umbrella_stand(pen: Pen, rng: Rng, w: int, d: int, home: HomeStyle, room: RoomStyle) -> None:
    """A stand with umbrellas."""
    pen.cylinder(w // 2, d // 2, 0, 480, w * 40 // 100, METAL, cap=BLACK)
    for k in range(2):
        tone = rng.choice((home.fabric, room.accent))
        pen.cylinder(w // 2 - 40 + 80 * k, d // 2, 480, 780, 26, tone, top_radius=14)
        pen.box(w // 2 - 52 + 80 * k, 780, d // 2 - 12, w // 2 - 28 + 80 * k, 880, d // 2 + 12, home.dark_wood)


def hood(pen: Pen, w: int) -> None:
    """An extractor hood; the frame's origin is its lower left back corner on the wall."""
    pen.box(0, 0, 0, w, 90, 480, METAL)
    pen.box(w // 2 - 140, 90, 0, w // 2 + 140, 700, 260, METAL, skip="BU")
