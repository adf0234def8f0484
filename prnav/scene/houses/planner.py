"""From a seed to the plan of a home: how large, how many storeys, which rooms, doors and windows."""

from __future__ import annotations

from dataclasses import replace

from prnav.scene.houses.config import HouseConfig
from prnav.scene.houses.layout import Cells, one_storey
from prnav.scene.houses.layout_storeys import two_storeys
from prnav.scene.houses.openings import doors, entrance, outer_walls, windows
from prnav.scene.houses.plan import Room, Storey
from prnav.scene.houses.rng import Rng

TWO_STOREYS_FROM = 120
"""Smallest floor area of a home on two storeys [m2]."""
ONE_STOREY_UP_TO = 190
"""Largest floor area of a home on one storey [m2]."""
_QUANTILES = ((0, 0), (400, 60), (700, 150), (900, 370), (1000, 1000))


def make_plan(rng: Rng, config: HouseConfig) -> tuple[Storey, ...]:
    """The storeys of a home, from the ground up."""
    area = _area(rng.fork("area"), config)
    levels = config.storeys or _storeys(rng.fork("storeys"), area)
    thickness = rng.choice((100, 100, 120, 150))
    if levels == 1:
        height = rng.choice((2500, 2550, 2600, 2700, 2800))
        rooms = _rooms(one_storey(rng, area), thickness)
        return (_openings(rng, Storey(0, height, thickness, rooms, ()), area),)
    cells_low, cells_high, stairs, height = two_storeys(rng, area, thickness)
    low, high = _rooms(cells_low, thickness), _rooms(cells_high, thickness)
    ground = Storey(0, height, thickness, low, (), 0, stairs_up=stairs)
    upper = Storey(stairs.rise, height, thickness, high, (), len(low), stairs_down=stairs)
    return _openings(rng, ground, area), _openings(rng, upper, area)


def _area(rng: Rng, config: HouseConfig) -> int:
    """Most homes are small, a few are large: a share of the range from a table of quantiles, per mille."""
    share = rng.below(1000)
    for (u0, v0), (u1, v1) in zip(_QUANTILES, _QUANTILES[1:], strict=False):
        if share < u1:
            part = v0 + (v1 - v0) * (share - u0) // (u1 - u0)
            return config.min_area + (config.max_area - config.min_area) * part // 1000
    raise AssertionError("the quantiles end at 1000")


def _storeys(rng: Rng, area: int) -> int:
    if area < TWO_STOREYS_FROM:
        return 1
    return 2 if area > ONE_STOREY_UP_TO or rng.chance(75) else 1


def _rooms(cells: Cells, thickness: int) -> tuple[Room, ...]:
    return tuple(
        Room(index, "hall" if kind == "corridor" else kind, cell, cell.inset(thickness // 2))
        for index, (kind, cell) in enumerate(cells)
    )


def _openings(rng: Rng, storey: Storey, area: int) -> Storey:
    rooms, ground = storey.rooms, storey.level == 0
    inner = doors(rng, rooms, area * 1_000_000)
    outer = [interval for room in rooms for interval in outer_walls(rooms, room)]
    front = entrance(rng, outer) if ground else []
    glass = windows(rng, outer, front, storey.height, ground)
    return replace(storey, openings=(*inner, *front, *glass))
