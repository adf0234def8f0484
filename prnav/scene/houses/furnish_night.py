"""Rooms to sleep, wash and keep things in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from prnav.scene.houses import pieces, pieces_more, pieces_wet
from prnav.scene.houses.furnish_day import seat, work_place
from prnav.scene.houses.shapes import Frame

if TYPE_CHECKING:
    from prnav.scene.houses.furnish import Furnisher


def bedroom(f: Furnisher) -> None:
    """A bed and what stands around it; some small ones are children's."""
    rng, big = f.rng, f.square > 1050
    child = not big and rng.chance(45)
    if child and rng.chance(40):
        if f.put(pieces_more.crib, 1300, 700, 950, corner=60) is not None:
            f.put(pieces_more.armchair, 750, 800, 920, front=300, corner=40)
    else:
        _bed(f, big)
    f.put(pieces.wardrobe, rng.choice((1000, 1500, 2000)) if big else 1000, 600, 2200, front=600, corner=60)
    f.heater(60)
    if child:
        f.put(pieces_more.toy_box, 800, 450, 560, front=300)
        f.shelves(60)
    if rng.chance(60):
        f.put(pieces.dresser, rng.choice((800, 1000, 1200)), 450, 1000, front=500)
    if rng.chance(35 if big else 50):
        work_place(f, 1200)
    elif big and rng.chance(45):
        spot = f.put(pieces_more.dressing_table, 1100, 450, 1400, front=600)
        if spot is not None:
            seat(f, pieces_more.pouf, spot.frame, 330, 380, 440, 440)
    if f.square > 1700:
        _sitting_corner(f)
    if f.square > 2400:
        f.put(pieces.wardrobe, 2000, 600, 2200, front=600, corner=60)
        f.put(pieces.bookshelf, 1000, 320, 2100, front=450)
        f.middle_rug(2400, 1700)
    f.plants(40)
    f.floor_lamp(30)
    f.pictures(rng.between(1, 3) + (f.square > 1800))
    f.clock(20)


def _sitting_corner(f: Furnisher) -> None:
    spot = f.put(pieces_more.armchair, 750, 800, 920, front=500, corner=60, window=60)
    if spot is not None:
        f.put(pieces_more.armchair, 750, 800, 920, front=400, corner=40)
        f.put(pieces_more.pouf, 460, 460, 400)


def _bed(f: Furnisher, big: bool) -> None:
    rng = f.rng
    w = rng.choice((1400, 1600, 1800)) if big else rng.choice((900, 900, 1000, 1400))
    d = 2050
    beside = 500 if w >= 1400 and rng.chance(85) else 0
    spot = f.space.wall_spot(w + 2 * beside, d, 1200, front=300, window=-60)
    if spot is None and beside:
        beside = 0
    if spot is None:
        spot = f.space.wall_spot(w, d, 1200, window=-40)
    if spot is None:
        w = 900
        spot = f.space.wall_spot(w, 2000, 1200)
    if spot is None:
        return
    frame = spot.frame.at(beside, 0, 0)
    if beside:
        for x in (0, beside + w):
            f.draw(pieces.nightstand, spot.frame.at(x + 25, 0, 0), 450, 400)
        _free_sides(f, spot.frame, w, d, beside)
    if rng.chance(65):
        f.rug(-400, d * 2 // 5, frame, w + 800, d * 4 // 5)
    f.draw(pieces.bed, frame, w, d)
    if big and rng.chance(50):
        foot = frame.at((w - 1200) // 2, 0, d + 40)
        if f.settle(foot.rect(0, 0, 1200, 400)):
            f.draw(pieces_more.bench, foot, 1200, 400)


def _free_sides(f: Furnisher, frame: Frame, w: int, d: int, beside: int) -> None:
    """People get in beside the bed: the floor there is free again."""
    floor = f.space.floor
    for side in (frame.rect(0, 450, beside, d), frame.rect(beside + w, 450, 2 * beside + w, d)):
        floor.taken &= ~floor.mask(side)
        floor.keep(side)
    floor.take(frame.rect(0, 0, 2 * beside + w, 450), frame.rect(beside, 0, beside + w, d))


def bath(f: Furnisher) -> None:
    """A tub or a shower, a toilet and basins."""
    rng, big = f.rng, f.square > 900
    tub = f.put(pieces_wet.bathtub, 1700, 750, 600, corner=100) if rng.chance(85 if big else 60) else None
    if tub is None or rng.chance(80 if big else 30):
        f.put(pieces_wet.shower, 900, 900, 2060, corner=300)
    f.put(pieces_wet.toilet, 420, 680, 830, front=450, margin=80)
    for _ in range(2 if f.square > 1100 else 1):
        _basin(f)
    if rng.chance(35):
        f.put(pieces_wet.washer, 600, 600, 900, front=400, corner=40)
    if rng.chance(50):
        f.put(pieces_more.laundry_basket, 420, 420, 600, corner=60)
    if rng.chance(60):
        f.put(pieces_more.waste_bin, 260, 260, 320, corner=40)
    f.heater(50)
    if big:
        f.put(pieces.dresser, 800, 400, 900, front=400)
        f.plants(50)
    for _ in range(2 if big else 1):
        frame = f.hang(500, 30, 1420, 530) if rng.chance(75) else None
        if frame is not None:
            pieces_wet.towel(f.pen(frame), rng, f.style)
    if rng.chance(70):
        f.middle_rug(*((1400, 900) if big else (800, 550)))
    f.pictures(rng.between(0, 1) + big)


def _basin(f: Furnisher) -> None:
    wide = f.rng.choice((600, 800, 1000))
    spot = f.space.wall_spot(wide, 480, 900, front=500)
    if spot is None:
        wide = 500
        spot = f.space.wall_spot(wide, 420, 900, front=400)
    if spot is None:
        return
    f.draw(pieces_wet.basin, spot.frame, wide, 480 if wide > 500 else 420)
    if f.space.wall_is_free(spot.side, spot.start, spot.start + wide, 1150, 1900):
        f.space.hang(spot.side, spot.start, spot.start + wide, 1150, 1900)
        pieces_wet.mirror(f.pen(f.inner.frame(spot.side).at(spot.start, 1150, 0)), wide, 700)


def storage(f: Furnisher) -> None:
    """Shelves, and what is needed for the household."""
    rng = f.rng
    for _ in range(rng.between(1, 3) + f.square // 900):
        f.put(pieces_wet.shelf_rack, rng.choice((900, 1200)), 400, 2000, front=500)
    if rng.chance(60):
        f.put(pieces_wet.washer, 600, 600, 900, front=500, corner=40)
    if rng.chance(60):
        f.put(pieces_more.laundry_basket, 420, 420, 600)
    if rng.chance(40):
        f.put(pieces_more.trolley, 600, 400, 850)
    frame = f.hang(900, 170, 1600, 1000) if rng.chance(45) else None
    if frame is not None:
        pieces_more.coat_rack(f.pen(frame), rng, 900, f.home, f.style)
