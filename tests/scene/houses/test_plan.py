"""Floor plans: rooms fill the outline, doors join them, openings lie in walls."""

import json

import pytest

from prnav.scene.houses import HouseConfig
from prnav.scene.houses.manifest import MANIFEST
from prnav.scene.houses.plan import Opening
from prnav.scene.houses.planner import make_plan
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES

SEEDS = range(60)


@pytest.fixture(scope="module")
def homes():
    return [make_plan(Rng(seed), HouseConfig()) for seed in SEEDS]


@pytest.fixture(scope="module")
def plans(homes):
    """All storeys of all homes."""
    return [storey for storeys in homes for storey in storeys]


def test_homes_have_4_to_20_rooms_and_the_wanted_area(homes):
    areas = [sum(room.cell.area for storey in storeys for room in storey.rooms) / 1e6 for storeys in homes]
    counts = [sum(room.kind != "stairs" for storey in storeys for room in storey.rooms) for storeys in homes]
    assert min(areas) > 80 and max(areas) < 520
    assert sorted(areas)[len(areas) // 2] < 150 and max(areas) - min(areas) > 200
    assert min(counts) >= 4 and max(counts) <= 20 and max(counts) - min(counts) > 8


def test_a_quarter_of_each_split_has_two_storeys():
    homes = json.loads(MANIFEST.read_text(encoding="utf-8"))["homes"]  # another test holds it to the plans
    for split in ("train", "val", "test"):
        storeys = [home["storeys"] for home in homes if home["id"].startswith(f"prhouses/{split}/")]
        assert 4 * storeys.count(2) >= len(storeys) and set(storeys) == {1, 2}


def test_every_home_has_what_one_needs(homes):
    for storeys in homes:
        kinds = {room.kind for storey in storeys for room in storey.rooms}
        assert {"living", "kitchen", "bath", "bedroom"} <= kinds
        openings = [opening for storey in storeys for opening in storey.openings]
        assert sum(opening.kind == "entrance" for opening in openings) == 1
        assert all(opening not in storeys[-1].openings for opening in openings if opening.kind == "entrance") or (
            len(storeys) == 1
        )
        assert sum(opening.kind == "window" for opening in openings) >= 3


def test_stairs_are_in_one_place_on_both_storeys_and_can_be_climbed(homes):
    climbs = [storeys for storeys in homes if len(storeys) == 2]
    assert len(climbs) > 10
    for ground, upper in climbs:
        stairs = ground.stairs_up
        assert stairs is not None and stairs == upper.stairs_down
        assert ground.rooms[0].kind == upper.rooms[0].kind == "stairs"
        assert ground.rooms[0].inner == upper.rooms[0].inner
        assert stairs.rise == upper.level > ground.height + 200
        assert stairs.riser < 200 <= stairs.tread and stairs.landing >= 900
        inner = ground.rooms[0].inner
        assert stairs.start(inner) >= 900 and inner.length(stairs.entry) >= 1900
        for storey in (ground, upper):  # one comes in at the entry zone alone
            ways = [
                side for side in SIDES for o, _, _ in storey.openings_of(storey.rooms[0], side) if o.kind != "window"
            ]
            assert ways == [stairs.entry]
        assert all(o.kind != "window" for side in SIDES for o, _, _ in ground.openings_of(ground.rooms[0], side))


def test_closed_doors_shut_off_no_more_than_one_small_room_a_storey(homes):
    leaves = [opening.leaf for storeys in homes for storey in storeys for opening in storey.openings]
    assert {"open", "half", "closed"} <= set(leaves)
    for storeys in homes:
        area = sum(room.cell.area for storey in storeys for room in storey.rooms)
        for storey in storeys:
            reached = reachable(storey, [o for o in storey.openings if min(o.rooms) >= 0 and o.leaf != "closed"])
            shut = [room for room in storey.rooms if room.index not in reached]
            assert len(shut) <= 1
            assert all(room.kind in ("storage", "bath") and 25 * room.cell.area <= 1.05 * area for room in shut)


def reachable(storey, doors):
    reached, edge = {0}, [0]
    while edge:
        room = edge.pop()
        for door in doors:
            if room in door.rooms and sum(door.rooms) - room not in reached:
                reached.add(sum(door.rooms) - room)
                edge.append(sum(door.rooms) - room)
    return reached


def test_rooms_do_not_overlap(plans):
    for plan in plans:
        for a in plan.rooms:
            for b in plan.rooms[a.index + 1 :]:
                wide = min(a.cell.x1, b.cell.x1) - max(a.cell.x0, b.cell.x0)
                deep = min(a.cell.z1, b.cell.z1) - max(a.cell.z0, b.cell.z0)
                assert wide <= 0 or deep <= 0


def test_doors_join_all_rooms_and_are_wide_and_high_enough(plans):
    for plan in plans:
        doors = [opening for opening in plan.openings if min(opening.rooms) >= 0]
        assert reachable(plan, doors) == set(range(len(plan.rooms)))
        for door in doors:
            assert door.high - door.low >= 800 and door.top >= 2050 and door.bottom == 0
            assert door.kind != "door" or door.high - door.low <= 1000
            assert door.kind == "door" or not door.leaf


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
    with pytest.raises(ValueError, match="min_area 20 and max_area 480 must satisfy 40 <= min_area <= max_area <= 500"):
        HouseConfig(min_area=20)
    with pytest.raises(ValueError, match=r"storeys 3 is not 0 \(drawn by the area\), 1 or 2"):
        HouseConfig(storeys=3)
    with pytest.raises(ValueError, match="storeys 1 holds at most 200 m2, max_area is 480"):
        HouseConfig(storeys=1)
    with pytest.raises(ValueError, match="storeys 2 needs at least 100 m2, min_area is 88"):
        HouseConfig(storeys=2)


@pytest.mark.parametrize(("area", "storeys"), [(45, 1), (200, 1), (100, 2), (500, 2)])
def test_the_smallest_and_largest_homes_of_each_kind_have_a_plan(area, storeys):
    config = HouseConfig(min_area=area, max_area=area, storeys=storeys)
    for seed in range(12):
        assert len(make_plan(Rng(seed), config)) == storeys
