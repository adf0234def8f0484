"""Floor plans: rooms fill the outline, doors join them, openings lie in walls."""

import pytest

from prnav.scene.houses import HouseConfig
from prnav.scene.houses.plan import Opening, make_plan
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES

SEEDS = range(60)


@pytest.fixture(scope="module")
def plans():
    return [make_plan(Rng(seed), HouseConfig())[0] for seed in SEEDS]


def test_homes_have_4_to_14_rooms_and_the_wanted_area(plans):
    areas = [sum(room.cell.area for room in plan.rooms) / 1e6 for plan in plans]
    assert min(areas) > 36 and max(areas) < 175
    assert {len(plan.rooms) for plan in plans} <= set(range(4, 15))
    assert max(areas) - min(areas) > 60


def test_every_home_has_what_one_needs(plans):
    for plan in plans:
        assert {"living", "kitchen", "bath", "bedroom"} <= {room.kind for room in plan.rooms}
        assert sum(opening.kind == "entrance" for opening in plan.openings) == 1
        assert sum(opening.kind == "window" for opening in plan.openings) >= 3


def test_rooms_do_not_overlap(plans):
    for plan in plans:
        for a in plan.rooms:
            for b in plan.rooms[a.index + 1 :]:
                wide = min(a.cell.x1, b.cell.x1) - max(a.cell.x0, b.cell.x0)
                deep = min(a.cell.z1, b.cell.z1) - max(a.cell.z0, b.cell.z0)
                assert wide <= 0 or deep <= 0


def test_doors_join_all_rooms_and_are_wide_and_high_enough(plans):
    for plan in plans:
        reached, edge = {0}, [0]
        doors = [opening for opening in plan.openings if min(opening.rooms) >= 0]
        while edge:
            room = edge.pop()
            for door in doors:
                if room in door.rooms:
                    other = sum(door.rooms) - room
                    if other not in reached:
                        reached.add(other)
                        edge.append(other)
        assert reached == set(range(len(plan.rooms)))
        for door in doors:
            assert door.high - door.low >= 800 and door.top >= 2050 and door.bottom == 0
            assert door.kind != "door" or door.high - door.low <= 1000


def test_openings_lie_in_their_rooms_walls_apart_from_each_other(plans):
    for plan in plans:
        seen: list[Opening] = []
        for room in plan.rooms:
            for side in SIDES:
                found = plan.openings_of(room, side)
                seen += [opening for opening, _, _ in found]
                for opening, low, high in found:
                    assert 0 < low < high < room.inner.length(side)
                    assert 0 <= opening.bottom < opening.top < plan.height
                for (_, _, end), (_, start, _) in zip(found, found[1:], strict=False):
                    assert start > end
        wanted = sum(1 + (min(opening.rooms) >= 0) for opening in plan.openings)
        assert len(seen) == wanted


def test_config_says_what_is_valid():
    with pytest.raises(ValueError, match="min_area 20 and max_area 150 must satisfy 40 <= min_area <= max_area <= 200"):
        HouseConfig(min_area=20)
