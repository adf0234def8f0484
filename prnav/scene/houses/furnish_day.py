"""Rooms to live, cook, eat, work and walk through."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from prnav.scene.houses import pieces, pieces_more, pieces_wet
from prnav.scene.houses.placement import Spot
from prnav.scene.houses.shapes import Frame

if TYPE_CHECKING:
    from prnav.scene.houses.furnish import Furnisher

_SOFA = 560  # what counts below a window: the back may stand before the glass


def seat(f: Furnisher, piece: Callable[..., None], frame: Frame, x: int, z: int, w: int, d: int) -> None:
    """A seat at (x, z) in the frame of what it belongs to, looking back at it, where there is floor for it."""
    if f.settle(frame.rect(x, z, x + w, z + d)):
        f.draw(piece, frame.at(x + w, 0, z + d, 2), w, d)


def work_place(f: Furnisher, w: int) -> None:
    """A desk with its chair, rather at a window."""
    spot = f.put(pieces.desk, w, 650, 800, front=700, window=40)
    if spot is not None:
        seat(f, pieces.office_chair, spot.frame, w // 2 - 230, 480, 500, 500)
        if f.rng.chance(50):
            f.put(pieces_more.waste_bin, 260, 260, 320)


def living(f: Furnisher) -> None:
    """Sofas around a table and a television; in large rooms more places to sit, eat and play."""
    rng, big = f.rng, f.square > 1500
    wide = f.square > 2600 and rng.chance(65)
    if not (wide and _island_of_sofas(f)):
        _sofa_at_wall(f, big)
    if big and rng.chance(40):
        f.put(pieces_more.fireplace, 1300, 350, 1250, front=700, window=-200)
    chair = rng.choice((pieces.sofa, pieces_more.armchair))
    for _ in range(rng.between(1, 2) if big else rng.between(0, 1)):
        size = (850, 850) if chair is pieces.sofa else (750, 800)
        f.put(chair, *size, _SOFA if chair is pieces.sofa else 920, front=400, corner=50)
    f.heater(55)
    for _ in range(1 + (f.square > 3000)):
        if rng.chance(75):
            f.put(pieces.bookshelf, rng.choice((800, 1000, 1200)), 320, 2100, front=500)
    if f.square > 2100 and rng.chance(60):
        dining_table(f, 4)
    if big and rng.chance(30):
        spot = f.put(pieces_more.piano, 1500, 620, 1250, front=800, window=-100)
        if spot is not None:
            seat(f, pieces_more.bench, spot.frame, 400, 720, 700, 350)
    if f.square > 3200:
        _sofa_at_wall(f, True, television=False)
        dining_table(f, 6)
        f.middle_rug(3000, 2000)
        work_place(f, 1500)
    for piece, w, d, h, percent in (
        (pieces_more.display_cabinet, 1000, 420, 2050, 30), (pieces.dresser, 1200, 450, 950, 40),
        (pieces_more.aquarium, 1000, 400, 1200, 18), (pieces_more.pouf, 480, 480, 400, 40),
        (pieces_more.trolley, 600, 400, 850, 18),
    ):  # fmt: skip
        if rng.chance(percent + (25 if f.square > 3000 else 0)):
            f.put(piece, w, d, h, front=400)
    f.plants(80)
    f.plants(90 if f.square > 3000 else 40)
    f.floor_lamp(75)
    f.pictures(rng.between(2, 4) + f.square // 1500)
    f.shelves(35)
    f.clock(30)
    f.wall_lamps(rng.between(0, 2) + (f.square > 3000))


def _sofa_at_wall(f: Furnisher, big: bool, television: bool = True) -> None:
    rng = f.rng
    w, d = rng.choice((1900, 2200, 2500)) if big else rng.choice((1500, 1800)), rng.choice((850, 900))
    spot = f.put(pieces.sofa, w, d, _SOFA, front=950, margin=50)
    if spot is None:
        w, d = 1500, 850
        spot = f.put(pieces.sofa, w, d, _SOFA, front=600)
    if spot is None:
        return
    if rng.chance(80):
        f.rug(-200, d - 250, spot.frame, w + 400, 1900)
    _coffee_table(f, spot.frame, w, d)
    if television:
        _television(f, (spot.side + 2) % 4)


def _coffee_table(f: Furnisher, frame: Frame, w: int, d: int) -> None:
    table_w, table_d = f.rng.choice((900, 1000, 1200)), f.rng.choice((500, 600))
    table = frame.at((w - table_w) // 2, 0, d + 350)
    if f.settle(table.rect(0, 0, table_w, table_d)):
        f.draw(pieces.coffee_table, table, table_w, table_d)


def _television(f: Furnisher, facing: int) -> None:
    wide = f.rng.choice((1400, 1600, 1800))
    spot: Spot | None = f.space.wall_spot(wide, 420, 1250, front=500, sides=(facing,))
    if spot is None:
        wide = 1200
        spot = f.space.wall_spot(wide, 420, 1250, front=400)
    if spot is not None:
        f.draw(pieces.tv_stand, spot.frame, wide, 420)


def _island_of_sofas(f: Furnisher) -> bool:
    """A sofa in the middle of a large room, with a table and two armchairs before it."""
    rng = f.rng
    w, d, deep = rng.choice((1900, 2200)), 880, 2750
    frame = f.space.free_spot(w, deep, 700)
    if frame is None:
        return False
    floor = f.space.floor
    floor.taken &= ~floor.mask(frame.rect(0, 0, w, deep))  # walked through, but kept free of other pieces
    floor.keep(frame.rect(0, 0, w, deep))
    floor.take(frame.rect(0, 0, w, d))
    f.rug(-300, d - 350, frame, w + 600, deep - d + 500)
    f.draw(pieces.sofa, frame, w, d)
    _coffee_table(f, frame, w, d)
    for x in (0, w - 760):
        chair = frame.at(x + 750, 0, deep, 2)
        if f.settle(chair.rect(0, 0, 750, 800)):
            f.draw(pieces_more.armchair, chair, 750, 800)
    _television(f, 2 if frame.turns % 2 == 0 else 3)
    return True


def dining_table(f: Furnisher, seats: int) -> None:
    """A table with chairs away from the walls, under a lamp."""
    rng = f.rng
    square = rng.chance(35) or seats <= 2
    w, d = (900, 900) if square else (rng.choice((1200, 1400, 1600)), 800)
    frame = f.space.free_spot(w + 2 * (0 if not square else 350), d + 700, 500)
    if frame is None and not square:
        square, w, d = True, 900, 900
        frame = f.space.free_spot(1600, 1600, 450)
    if frame is None:
        return
    side = 350 if square else 0
    table = frame.at(side, 0, 350)
    if rng.chance(35):
        f.rug(-150, -150, frame, w + 2 * side + 300, d + 1000)
    f.draw(pieces.dining_table, table, w, d)
    count = 1 if square else 2 if w < 1500 else 3
    for k in range(count):
        x = w * (2 * k + 1) // (2 * count)
        f.draw(pieces.chair, table.at(x - 220, 0, -rng.between(190, 320, 10)), 440, 440)
        f.draw(pieces.chair, table.at(x + 220, 0, d + rng.between(190, 320, 10), 2), 440, 440)
    if square:
        f.draw(pieces.chair, table.at(-rng.between(190, 320, 10), 0, d // 2 + 220, 3), 440, 440)
        f.draw(pieces.chair, table.at(w + rng.between(190, 320, 10), 0, d // 2 - 220, 1), 440, 440)
    f.pendant(table, w // 2, d // 2)


def dining(f: Furnisher) -> None:
    """A table for six and cupboards."""
    rng = f.rng
    dining_table(f, 6)
    f.heater(50)
    if rng.chance(60):
        f.put(pieces_more.display_cabinet, rng.choice((1000, 1200)), 420, 2050, front=400)
    if rng.chance(70):
        f.put(pieces.dresser, rng.choice((1200, 1500)), 450, 950, front=400)
    if rng.chance(30):
        f.put(pieces_more.trolley, 600, 400, 850)
    if f.square > 2200:
        f.put(pieces_more.fireplace, 1300, 350, 1250, front=700, window=-200)
        f.put(pieces.sofa, 1800, 850, _SOFA, front=500)
    f.plants(60)
    f.pictures(rng.between(1, 3) + f.square // 1800)
    f.clock(35)
    f.wall_lamps(rng.between(0, 2))


def kitchen(f: Furnisher) -> None:
    """Counters with sink and stove, a fridge, and a table or an island."""
    rng = f.rng
    longest = max(f.inner.width, f.inner.depth)
    placed = None
    for w in (3600, 3000, 2400, 1800, 1200):
        if w <= longest - 700:
            placed = _counter(f, w)
            if placed is not None:
                break
    f.put(pieces_wet.fridge, 650, 680, 1900, front=700, corner=70, window=-100)
    if rng.chance(45):
        f.put(pieces_more.oven_tower, 600, 600, 2150, front=700, corner=60, window=-100)
    if placed is not None and rng.chance(65 if f.square < 1500 else 95):
        for w in (2400, 1800, 1200):
            if _counter(f, w, plain=True) is not None:
                break
    if f.square > 1400 and rng.chance(70):
        _island(f)
    if f.square < 1400 or f.square > 2000:
        dining_table(f, 2 if f.square < 1200 else 4)
    if rng.chance(25):
        f.put(pieces_wet.washer, 600, 600, 900, front=500, corner=40)
    if rng.chance(60):
        f.put(pieces_more.waste_bin, 300, 300, 320, corner=50)
    f.heater(30)
    f.plants(30)
    f.pictures(rng.between(0, 2) + f.square // 1600)
    f.clock(60)
    f.shelves(40)


def _island(f: Furnisher) -> None:
    w, d = f.rng.choice((1400, 1600, 1800)), 950
    frame = f.space.free_spot(w, d + 350, 650)
    if frame is None:
        return
    f.draw(pieces_more.island, frame, w, d)
    count = w // 600
    for k in range(count):
        x = w * (2 * k + 1) // (2 * count)
        f.draw(pieces_more.bar_stool, frame.at(x - 200, 0, d - 120), 400, 400)
    f.pendant(frame, w // 2, d // 2)


def _counter(f: Furnisher, w: int, plain: bool = False) -> Spot | None:
    spot = f.space.wall_spot(w, 620, 900, front=700, corner=60, window=20)
    if spot is None:
        return None
    uppers, start = [], None
    for x in range(0, w + 1, 50):
        free = x + 50 <= w and f.space.wall_is_free(spot.side, spot.start + x, spot.start + x + 50, 1400, 2200)
        if free and start is None:
            start = x
        if not free and start is not None:
            if x - start >= 400:
                uppers.append((start, x))
            start = None
    f.builder.placed["counter"] = f.builder.placed.get("counter", 0) + 1
    pieces_wet.counter(f.pen(spot.frame), f.rng, w, 620, f.home, f.style, uppers, plain)
    for low, high in uppers:
        f.space.hang(spot.side, spot.start + low, spot.start + high, 1400, 2200)
    return spot


def study(f: Furnisher) -> None:
    """A desk and books."""
    rng = f.rng
    work_place(f, rng.choice((1300, 1500, 1700)))
    for _ in range(rng.between(1, 3) + f.square // 1500):
        f.put(pieces.bookshelf, rng.choice((800, 1000, 1200)), 320, 2100, front=450)
    if rng.chance(50):
        f.put(pieces_more.filing_cabinet, 450, 550, 920, front=400)
    if rng.chance(60):
        f.put(pieces.sofa, rng.choice((850, 1500)), 850, _SOFA, front=400)
    elif rng.chance(60):
        f.put(pieces_more.armchair, 750, 800, 920, front=400, corner=40)
    if f.square > 1400:
        work_place(f, 1400)
    f.heater(50)
    if rng.chance(60):
        f.middle_rug(*((1600, 1200) if f.square < 1600 else (2600, 1800)))
    f.plants(60)
    f.floor_lamp(50)
    f.pictures(rng.between(1, 3))
    f.clock(35)
    f.shelves(30)


def hall(f: Furnisher) -> None:
    """Coats, shoes, a runner and pictures."""
    rng, inner = f.rng, f.inner
    short, long = min(inner.width, inner.depth), max(inner.width, inner.depth)
    narrow = short < 1900
    for _ in range(1 + long // 6000):
        piece, w, d, h = rng.choice(((pieces.dresser, 900, 400, 950), (pieces_more.console, 1000, 320, 900),
                                     (pieces_more.shoe_cabinet, 800, 320, 1150)))  # fmt: skip
        if rng.chance(80):
            f.put(piece, w, 250 if narrow else d, h)
    frame = f.hang(900, 170, 1600, 1000) if rng.chance(70) else None
    if frame is not None:
        pieces_more.coat_rack(f.pen(frame), rng, 900, f.home, f.style)
    if rng.chance(35):
        f.put(pieces_more.umbrella_stand, 280, 280, 900, corner=60)
    if not narrow:
        if rng.chance(50):
            f.put(pieces.wardrobe, 1000, 550, 2200, front=500, corner=40)
        if rng.chance(45):
            f.put(pieces_more.bench, 1000, 380, 500)
        if rng.chance(30):
            f.put(pieces.chair, 440, 440, 900)
    f.heater(40)
    f.plants(40 if narrow else 60)
    if rng.chance(70):
        f.middle_rug(min(long - 800, 3800), min(short - 400, 1400))
    f.pictures(rng.between(1, 3) + long // 2500)
    f.wall_lamps(rng.between(0, 1) + long // 4000)
    f.clock(25)
