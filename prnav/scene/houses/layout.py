"""How a storey is cut into rooms: which kinds, and one rectangular cell for each. Lengths are millimetres.

Layouts are drawn at random and the best of many draws is taken; :func:`badness` says what is good.
"""

from __future__ import annotations

from prnav.scene.houses.openings import tree_costs
from prnav.scene.houses.plan import GRID, Room, snap
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import Rect

Cells = list[tuple[str, Rect]]

# target areas [m2] per kind, in a home of ordinary size
AREAS = {
    "living": 23, "kitchen": 11, "dining": 12, "bedroom": 13, "bath": 6, "study": 9, "hall": 7, "storage": 5,
    "corridor": 8, "stairs": 9,
}  # fmt: skip
_DAY = ("living", "kitchen", "dining", "study")
_DRAWS = 60

# shortest side [mm] and longest ratio of sides [percent] that a room of a kind should have
_SHAPES = {
    "living": (3300, 170), "kitchen": (2300, 210), "dining": (2700, 180), "bedroom": (2500, 180), "bath": (1700, 230),
    "study": (2200, 190), "hall": (1500, 320), "storage": (1500, 260), "corridor": (1150, 900), "stairs": (1900, 400),
}  # fmt: skip


def programme(rng: Rng, area: int) -> list[str]:
    """Kinds of the rooms of a home on one storey."""
    kinds = ["living", "kitchen", "bath", "bedroom"]
    left = area - 53 if rng.chance(82) else min(area - 53, rng.between(0, 26))  # some homes have few, large rooms
    for kind, chance in (
        ("bedroom", 90), ("study", 50), ("bath", 70), ("dining", 60), ("bedroom", 90), ("storage", 60), ("study", 60),
        ("bedroom", 80), ("bath", 60),
    ):  # fmt: skip
        if left >= AREAS[kind] and rng.chance(chance):
            kinds.append(kind)
            left -= AREAS[kind]
    return kinds


def programmes(rng: Rng, area: int) -> tuple[list[str], list[str]]:
    """Kinds of the rooms of both storeys of a home of this total area, stairs and hall not named."""
    ground, upper = ["living", "kitchen", "bath"], ["bedroom", "bath", "bedroom"]
    half = area * 100 // (2 * (100 if area < 220 else 100 + (area - 220) // 4))  # big homes have bigger rooms, too
    left = half - 17 - sum(AREAS[kind] for kind in ground)
    for kind, chance in (("dining", 70), ("study", 55), ("storage", 60), ("bedroom", 45), ("bath", 40), ("living", 60),
                         ("study", 40), ("bedroom", 60), ("storage", 50)):  # fmt: skip
        if left >= AREAS[kind] * 8 // 10 and len(ground) < 8 and rng.chance(chance):
            ground.append(kind)
            left -= AREAS[kind]
    left = half - 17 - sum(AREAS[kind] for kind in upper)
    for kind, chance in (("bedroom", 85), ("study", 45), ("bath", 60), ("bedroom", 75), ("storage", 45),
                         ("living", 30), ("bedroom", 75), ("bath", 50), ("study", 50)):  # fmt: skip
        if left >= AREAS[kind] * 8 // 10 and len(upper) < 8 and rng.chance(chance):
            upper.append(kind)
            left -= AREAS[kind]
    return ground, upper


def one_storey(rng: Rng, area: int) -> Cells:
    """The best of many layouts of a home on one storey."""
    kinds = programme(rng, area)
    cells = min((cut_outline(rng, kinds, area) for _ in range(_DRAWS)), key=lambda cells: badness(cells, area))
    assert all(min(cell.width, cell.depth) >= 1150 for _, cell in cells), f"no layout of {kinds} in {area} m2"
    return cells


def badness(cells: Cells, area: int) -> int:
    """How far a layout is from what people build; 0 is best."""
    result = 0
    wanted = sum(AREAS[kind] for kind, _ in cells)
    scale = max(100, min(220, 100 * area // wanted))
    for kind, cell in cells:
        short, long = min(cell.width, cell.depth), max(cell.width, cell.depth)
        shortest, ratio = _SHAPES[kind]
        result += max(0, shortest - short) * (20 if short < 1700 and kind != "corridor" else 1)
        result += max(0, 100 * long // short - ratio) * 6
        if kind == "corridor":
            result += max(0, long - 9000) // 2
        elif kind != "stairs":
            result += (
                max(0, AREAS[kind] * 700_000 - cell.area) // 5000
                + max(0, cell.area - AREAS[kind] * scale * 17_000) // 9000
            )
    rooms = tuple(
        Room(k, "hall" if kind == "corridor" else kind, cell, cell.inset(60)) for k, (kind, cell) in enumerate(cells)
    )
    result += sum(max(0, cost - 20) * 60 for cost in tree_costs(rooms))
    total = sum(cell.area for _, cell in cells)
    return result + abs(total - area * 1_000_000) // 20_000


def cut_outline(rng: Rng, kinds: list[str], area: int) -> Cells:
    """Kinds and cells of the rooms. Not every draw is good: the caller checks the widths."""
    total = area * 1_000_000
    ratio = rng.between(105, 170)  # length to depth in percent
    depth = snap(root(total * 100 // ratio))
    length = snap(total // depth)
    day = rng.shuffled([kind for kind in kinds if kind in _DAY])
    night = rng.shuffled([kind for kind in kinds if kind not in _DAY])
    day.sort(key=lambda kind: kind == "study")
    wing = len(kinds) >= 6 and rng.chance(45)
    style = "hub" if len(kinds) <= 4 else rng.weighted((("corridor", 75), ("hub", 25)))
    cells: Cells = []
    if wing:  # an L: one group of rooms moves into a wing of its own
        moved = [day.pop() for _ in range(len(day) - 2)] + [night.pop() for _ in range(max(0, len(night) - 3))]
        moved = moved or [night.pop()]
        share = total * sum(AREAS[kind] for kind in moved) // sum(AREAS[kind] for kind in kinds)
        depth = snap(root((total - share) * 100 // ratio))
        length = snap((total - share) // depth)
        wing_length = min(length, snap(max(2800, root(share * rng.between(60, 160) // 100))))
        wing_depth = max(2500, snap(share // wing_length))
        x0 = 0 if rng.chance(50) else length - wing_length
        cells += treemap(rng, moved, Rect(x0, depth, x0 + wing_length, depth + wing_depth))
    main = Rect(0, 0, length, depth)
    if style == "corridor" and depth >= 6000 and len(day) + len(night) >= 4:
        cells += _corridor(rng, day, night, main)
    else:
        hall = ["hall"] if area > 60 and rng.chance(60) else []
        cells += treemap(rng, day + hall + night, main)
    if rng.chance(50):
        cells = [(kind, Rect(-c.x1, c.z0, -c.x0, c.z1)) for kind, c in cells]
    if rng.chance(50):
        cells = [(kind, Rect(c.z0, c.x0, c.z1, c.x1)) for kind, c in cells]
    # centred on the origin, on the grid
    x = snap((min(c.x0 for _, c in cells) + max(c.x1 for _, c in cells)) // 2)
    z = snap((min(c.z0 for _, c in cells) + max(c.z1 for _, c in cells)) // 2)
    return [(kind, Rect(c.x0 - x, c.z0 - z, c.x1 - x, c.z1 - z)) for kind, c in cells]


def root(value: int) -> int:
    """Integer square root, rounded down."""
    root = 1 << ((value.bit_length() + 1) // 2)
    while (better := (root + value // root) // 2) < root:
        root = better
    return root


def _corridor(rng: Rng, day: list[str], night: list[str], rect: Rect) -> Cells:
    """A corridor between two bands of rooms; often the day rooms take one whole end of the home."""
    cells: Cells = []
    if day and len(night) >= 3 and rng.chance(60):
        share = sum(AREAS[kind] for kind in day)
        part = rect.width * share // (share + sum(AREAS[kind] for kind in night) + 7)
        cut = rect.x0 + snap(min(max(part, 3200), rect.width - 4000))
        cells += treemap(rng, day, Rect(rect.x0, rect.z0, cut, rect.z1))
        rect = Rect(cut, rect.z0, rect.x1, rect.z1)
        rest = night
    else:
        rest = day + night
    width = rng.between(1200, 1650, GRID)
    middle = snap(rect.z0 + rect.depth * rng.between(44, 56) // 100)
    upper, lower = Rect(rect.x0, rect.z0, rect.x1, middle - snap(width // 2)), None
    lower = Rect(rect.x0, upper.z1 + width, rect.x1, rect.z1)
    cells.append(("corridor", Rect(rect.x0, upper.z1, rect.x1, lower.z0)))
    # the kinds go to the band with more room left
    bands: tuple[list[str], list[str]] = ([], [])
    for kind in sorted(rest, key=lambda kind: -AREAS[kind]):
        loads = [sum(AREAS[k] for k in band) for band in bands]
        bands[0 if loads[0] <= loads[1] else 1].append(kind)
    for band, strip in zip(bands, (upper, lower), strict=True):
        cells += slices(rng, rng.shuffled(band), strip)
    return cells


def slices(rng: Rng, kinds: list[str], rect: Rect) -> Cells:
    """Rooms side by side along x."""
    if not kinds:
        return [("storage", rect)]
    weights = [AREAS[kind] * rng.between(90, 115) for kind in kinds]
    spare = rect.width - len(kinds) * 2000
    cells, x, used = [], rect.x0, 0
    for k, kind in enumerate(kinds):
        used += weights[k]
        end = rect.x1 if k == len(kinds) - 1 else rect.x0 + snap(2000 * (k + 1) + spare * used // sum(weights))
        cells.append((kind, Rect(x, rect.z0, end, rect.z1)))
        x = end
    return cells


def treemap(rng: Rng, kinds: list[str], rect: Rect) -> Cells:
    """Rooms from cutting a rectangle again and again, across its longer side, by their areas."""
    if len(kinds) == 1:
        return [(kinds[0], rect)]
    areas = [AREAS[kind] for kind in kinds]
    options = [k for k in range(1, len(kinds)) if 30 <= 100 * sum(areas[:k]) // sum(areas) <= 72] or [len(kinds) // 2]
    k = rng.choice(options)
    percent = 100 * sum(areas[:k]) // sum(areas) + rng.between(-5, 5)
    if rect.width * 100 > rect.depth * rng.between(85, 115):
        cut = rect.x0 + snap(rect.width * percent // 100)
        parts = Rect(rect.x0, rect.z0, cut, rect.z1), Rect(cut, rect.z0, rect.x1, rect.z1)
    else:
        cut = rect.z0 + snap(rect.depth * percent // 100)
        parts = Rect(rect.x0, rect.z0, rect.x1, cut), Rect(rect.x0, cut, rect.x1, rect.z1)
    return treemap(rng, kinds[:k], parts[0]) + treemap(rng, kinds[k:], parts[1])
