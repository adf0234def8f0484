"""Floor plans: rooms, and the doors and windows in the walls between them. Lengths are millimetres.

The outline (a rectangle, or an L of two) is cut by straight lines into one rectangular cell per room. Walls stand
centred on the cells' borders: a room's inner rectangle is its cell less half a wall's thickness. Everything lies on a
grid of 50 mm, half thicknesses excepted.
"""

from __future__ import annotations

from dataclasses import dataclass

from prnav.scene.houses.config import HouseConfig
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES, Rect

GRID = 50
DOOR_HEIGHT = 2050
FRAME_WIDTH = 70
_DRAWS = 60


@dataclass(frozen=True)
class Room:
    """One room: its kind, the cell it was cut from, and the floor inside its walls."""

    index: int
    kind: str
    cell: Rect
    inner: Rect


@dataclass(frozen=True)
class Opening:
    """A hole in the walls between two rooms (or a room and the outside, -1).

    Attributes:
        kind: "door", "wide" (an opening without a door), "window" or "entrance" (a closed front door).
        axis: the wall runs along "x" or along "z".
        line: the wall's centre line, a z for axis "x" and an x for axis "z".
        low: where the opening starts along the wall.
        high: where it ends.
        bottom: height of the sill.
        top: height of the lintel.
        rooms: the room at the lower and at the higher side of the line.
    """

    kind: str
    axis: str
    line: int
    low: int
    high: int
    bottom: int
    top: int
    rooms: tuple[int, int]


@dataclass(frozen=True)
class Storey:
    """One storey.

    Attributes:
        level: height of the floor.
        height: from floor to ceiling.
        thickness: of the walls between rooms.
        rooms: by index.
        openings: doors and windows.
    """

    level: int
    height: int
    thickness: int
    rooms: tuple[Room, ...]
    openings: tuple[Opening, ...]

    def openings_of(self, room: Room, side: int) -> list[tuple[Opening, int, int]]:
        """Openings in one wall of a room with their intervals in that side's frame."""
        line = (room.cell.z0, room.cell.x1, room.cell.z1, room.cell.x0)[side]
        axis = "x" if side % 2 == 0 else "z"
        place = 1 if side in (0, 3) else 0
        found = []
        for opening in self.openings:
            if opening.axis == axis and opening.line == line and opening.rooms[place] == room.index:
                found.append((opening, *room.inner.along(side, opening.low, opening.high)))
        return sorted(found, key=lambda item: item[1])


# target areas [m2] per kind
_AREAS = {
    "living": 23, "kitchen": 11, "dining": 12, "bedroom": 13, "bath": 6, "study": 9, "hall": 7, "storage": 5,
}  # fmt: skip
_DAY = ("living", "kitchen", "dining", "study")


def make_plan(rng: Rng, config: HouseConfig) -> tuple[Storey, ...]:
    """The storeys of a home, from the ground up."""
    area = rng.between(config.min_area, config.max_area)
    kinds = _programme(rng, area)
    thickness = rng.choice((100, 100, 120, 150))
    height = rng.choice((2500, 2550, 2600, 2700, 2800))
    cells = min((_layout(rng, kinds, area) for _ in range(_DRAWS)), key=lambda cells: _badness(cells, area))
    assert all(min(cell.width, cell.depth) >= 1150 for _, cell in cells), f"no layout of {kinds} in {area} m2"
    rooms = tuple(
        Room(index, "hall" if kind == "corridor" else kind, cell, cell.inset(thickness // 2))
        for index, (kind, cell) in enumerate(cells)
    )
    doors = _doors(rng, rooms)
    outer = [interval for room in rooms for interval in outer_walls(rooms, room)]
    entrance = _entrance(rng, rooms, outer)
    windows = _windows(rng, rooms, outer, entrance, height)
    return (Storey(0, height, thickness, rooms, (*doors, *entrance, *windows)),)


# shortest side [mm] and longest ratio of sides [percent] that a room of a kind should have
_SHAPES = {
    "living": (3300, 170), "kitchen": (2300, 210), "dining": (2700, 180), "bedroom": (2500, 180), "bath": (1700, 230),
    "study": (2200, 190), "hall": (1500, 320), "storage": (1500, 260), "corridor": (1150, 900),
}  # fmt: skip


def _badness(cells: list[tuple[str, Rect]], area: int) -> int:
    """How far a layout is from what people build; 0 is best."""
    result = 0
    for kind, cell in cells:
        short, long = min(cell.width, cell.depth), max(cell.width, cell.depth)
        shortest, ratio = _SHAPES[kind]
        result += max(0, shortest - short) * (20 if short < 1700 and kind != "corridor" else 1)
        result += max(0, 100 * long // short - ratio) * 6
        if kind == "corridor":
            result += max(0, long - 9000) // 2
        else:
            result += (
                max(0, _AREAS[kind] * 700_000 - cell.area) // 5000
                + max(0, cell.area - _AREAS[kind] * 1_700_000) // 9000
            )
    rooms = tuple(Room(k, "hall" if kind == "corridor" else kind, cell, cell) for k, (kind, cell) in enumerate(cells))
    result += sum(max(0, cost - 20) * 60 for cost in _tree_costs(rooms))
    total = sum(cell.area for _, cell in cells)
    return result + abs(total - area * 1_000_000) // 20_000


def _programme(rng: Rng, area: int) -> list[str]:
    kinds = ["living", "kitchen", "bath", "bedroom"]
    left = area - 53
    for kind, chance in (
        ("bedroom", 90), ("study", 50), ("bath", 70), ("dining", 60), ("bedroom", 90), ("storage", 60), ("study", 60),
        ("bedroom", 80), ("bath", 60),
    ):  # fmt: skip
        if left >= _AREAS[kind] and rng.chance(chance):
            kinds.append(kind)
            left -= _AREAS[kind]
    return kinds


def _snap(value: int) -> int:
    return (value + GRID // 2) // GRID * GRID


def _layout(rng: Rng, kinds: list[str], area: int) -> list[tuple[str, Rect]]:
    """Kinds and cells of the rooms. Not every draw is good: the caller checks the widths."""
    total = area * 1_000_000
    ratio = rng.between(105, 170)  # length to depth in percent
    depth = _snap(_root(total * 100 // ratio))
    length = _snap(total // depth)
    day = rng.shuffled([kind for kind in kinds if kind in _DAY])
    night = rng.shuffled([kind for kind in kinds if kind not in _DAY])
    day.sort(key=lambda kind: kind == "study")
    wing = len(kinds) >= 6 and rng.chance(45)
    style = "hub" if len(kinds) <= 4 else rng.weighted((("corridor", 75), ("hub", 25)))
    cells: list[tuple[str, Rect]] = []
    if wing:  # an L: one group of rooms moves into a wing of its own
        moved = [day.pop() for _ in range(len(day) - 2)] + [night.pop() for _ in range(max(0, len(night) - 3))]
        moved = moved or [night.pop()]
        share = total * sum(_AREAS[kind] for kind in moved) // sum(_AREAS[kind] for kind in kinds)
        depth = _snap(_root((total - share) * 100 // ratio))
        length = _snap((total - share) // depth)
        wing_length = min(length, _snap(max(2800, _root(share * rng.between(60, 160) // 100))))
        wing_depth = max(2500, _snap(share // wing_length))
        x0 = 0 if rng.chance(50) else length - wing_length
        cells += _treemap(rng, moved, Rect(x0, depth, x0 + wing_length, depth + wing_depth))
    main = Rect(0, 0, length, depth)
    if style == "corridor" and depth >= 6000 and len(day) + len(night) >= 4:
        cells += _corridor(rng, day, night, main)
    else:
        hall = ["hall"] if area > 60 and rng.chance(60) else []
        cells += _treemap(rng, day + hall + night, main)
    if rng.chance(50):
        cells = [(kind, Rect(-c.x1, c.z0, -c.x0, c.z1)) for kind, c in cells]
    if rng.chance(50):
        cells = [(kind, Rect(c.z0, c.x0, c.z1, c.x1)) for kind, c in cells]
    # centred on the origin, on the grid
    x = _snap((min(c.x0 for _, c in cells) + max(c.x1 for _, c in cells)) // 2)
    z = _snap((min(c.z0 for _, c in cells) + max(c.z1 for _, c in cells)) // 2)
    return [(kind, Rect(c.x0 - x, c.z0 - z, c.x1 - x, c.z1 - z)) for kind, c in cells]


def _root(value: int) -> int:
    root = 1 << ((value.bit_length() + 1) // 2)
    while (better := (root + value // root) // 2) < root:
        root = better
    return root


def _corridor(rng: Rng, day: list[str], night: list[str], rect: Rect) -> list[tuple[str, Rect]]:
    """A corridor between two bands of rooms; often the day rooms take one whole end of the home."""
    cells: list[tuple[str, Rect]] = []
    if day and len(night) >= 3 and rng.chance(60):
        share = sum(_AREAS[kind] for kind in day)
        part = rect.width * share // (share + sum(_AREAS[kind] for kind in night) + 7)
        cut = rect.x0 + _snap(min(max(part, 3200), rect.width - 4000))
        cells += _treemap(rng, day, Rect(rect.x0, rect.z0, cut, rect.z1))
        rect = Rect(cut, rect.z0, rect.x1, rect.z1)
        rest = night
    else:
        rest = day + night
    width = rng.between(1200, 1650, GRID)
    middle = _snap(rect.z0 + rect.depth * rng.between(44, 56) // 100)
    upper, lower = Rect(rect.x0, rect.z0, rect.x1, middle - _snap(width // 2)), None
    lower = Rect(rect.x0, upper.z1 + width, rect.x1, rect.z1)
    cells.append(("corridor", Rect(rect.x0, upper.z1, rect.x1, lower.z0)))
    # the kinds go to the band with more room left
    bands: tuple[list[str], list[str]] = ([], [])
    for kind in sorted(rest, key=lambda kind: -_AREAS[kind]):
        loads = [sum(_AREAS[k] for k in band) for band in bands]
        bands[0 if loads[0] <= loads[1] else 1].append(kind)
    for band, strip in zip(bands, (upper, lower), strict=True):
        cells += _slices(rng, rng.shuffled(band), strip)
    return cells


def _slices(rng: Rng, kinds: list[str], rect: Rect) -> list[tuple[str, Rect]]:
    if not kinds:
        return [("storage", rect)]
    weights = [_AREAS[kind] * rng.between(90, 115) for kind in kinds]
    spare = rect.width - len(kinds) * 2000
    cells, x, used = [], rect.x0, 0
    for k, kind in enumerate(kinds):
        used += weights[k]
        end = rect.x1 if k == len(kinds) - 1 else rect.x0 + _snap(2000 * (k + 1) + spare * used // sum(weights))
        cells.append((kind, Rect(x, rect.z0, end, rect.z1)))
        x = end
    return cells


def _treemap(rng: Rng, kinds: list[str], rect: Rect) -> list[tuple[str, Rect]]:
    if len(kinds) == 1:
        return [(kinds[0], rect)]
    areas = [_AREAS[kind] for kind in kinds]
    options = [k for k in range(1, len(kinds)) if 30 <= 100 * sum(areas[:k]) // sum(areas) <= 72] or [len(kinds) // 2]
    k = rng.choice(options)
    percent = 100 * sum(areas[:k]) // sum(areas) + rng.between(-5, 5)
    if rect.width * 100 > rect.depth * rng.between(85, 115):
        cut = rect.x0 + _snap(rect.width * percent // 100)
        parts = Rect(rect.x0, rect.z0, cut, rect.z1), Rect(cut, rect.z0, rect.x1, rect.z1)
    else:
        cut = rect.z0 + _snap(rect.depth * percent // 100)
        parts = Rect(rect.x0, rect.z0, rect.x1, cut), Rect(rect.x0, cut, rect.x1, rect.z1)
    return _treemap(rng, kinds[:k], parts[0]) + _treemap(rng, kinds[k:], parts[1])


_COSTS = {
    # how unlikely a door between two kinds is; pairs not named cost 6
    ("hall", "living"): 1, ("hall", "kitchen"): 1, ("hall", "bedroom"): 1, ("bath", "hall"): 1, ("hall", "study"): 1,
    ("dining", "hall"): 1, ("hall", "storage"): 1, ("hall", "hall"): 1, ("kitchen", "living"): 1,
    ("dining", "living"): 1, ("dining", "kitchen"): 1, ("living", "study"): 2, ("bedroom", "living"): 3,
    ("bath", "bedroom"): 4, ("bath", "living"): 5, ("kitchen", "storage"): 2, ("living", "storage"): 3,
    ("bedroom", "dining"): 5, ("bedroom", "study"): 5, ("bedroom", "bedroom"): 9, ("bath", "kitchen"): 9,
    ("bath", "bath"): 12, ("bath", "storage"): 12, ("bath", "dining"): 9, ("bedroom", "storage"): 6,
}  # fmt: skip


def _shared(a: Rect, b: Rect) -> _Wall | None:
    """Axis, line and interval of the wall between two cells, and whether ``a`` is at its lower side."""
    low, high = max(a.z0, b.z0), min(a.z1, b.z1)
    if high > low and (a.x1 == b.x0 or b.x1 == a.x0):
        return "z", a.x1 if a.x1 == b.x0 else a.x0, low, high, a.x1 == b.x0
    low, high = max(a.x0, b.x0), min(a.x1, b.x1)
    if high > low and (a.z1 == b.z0 or b.z1 == a.z0):
        return "x", a.z1 if a.z1 == b.z0 else a.z0, low, high, a.z1 == b.z0
    return None


_Wall = tuple[str, int, int, int, bool]


def _edges(rooms: tuple[Room, ...]) -> list[tuple[int, Room, Room, _Wall]]:
    """Pairs of rooms with a wall between them that is long enough for a door, and ten times their cost."""
    edges = []
    for a in rooms:
        for b in rooms[a.index + 1 :]:
            wall = _shared(a.cell, b.cell)
            if wall is not None and wall[3] - wall[2] >= 1300:
                pair = (a.kind, b.kind) if a.kind <= b.kind else (b.kind, a.kind)
                edges.append((10 * _COSTS.get(pair, 6), a, b, wall))
    return edges


def _tree_costs(rooms: tuple[Room, ...]) -> list[int]:
    """Costs of the doors of the cheapest spanning tree, 1000 where a room cannot be reached."""
    group = list(range(len(rooms)))
    costs = []
    for cost, a, b, _ in sorted(_edges(rooms), key=lambda edge: edge[0]):
        if group[a.index] != group[b.index]:
            group = [group[a.index] if g == group[b.index] else g for g in group]
            costs.append(cost)
    return costs + [1000] * (len(set(group)) - 1)


def _doors(rng: Rng, rooms: tuple[Room, ...]) -> list[Opening]:
    """A spanning tree of doors (cheapest pairs first) and some more that close loops."""
    edges = [(cost + rng.below(8), a, b, wall) for cost, a, b, wall in _edges(rooms)]
    edges.sort(key=lambda edge: (edge[0], edge[1].index, edge[2].index))
    group = list(range(len(rooms)))
    doors = []
    for cost, a, b, wall in edges:
        joined = group[a.index] != group[b.index]
        private = "bath" in (a.kind, b.kind) or "storage" in (a.kind, b.kind)
        loop = rng.chance(55 if cost < 30 else 15 if cost < 50 else 0)
        if not joined and (private or not loop):
            continue
        group = [group[a.index] if g == group[b.index] else g for g in group]
        doors.append(_door(rng, a, b, wall))
    assert len(set(group)) == 1, "every room touches another"
    return doors


def _door(rng: Rng, a: Room, b: Room, wall: _Wall) -> Opening:
    axis, line, low, high, a_first = wall
    low, high = low + 200, high - 200  # half a wall, a frame and a hand
    space = high - low
    open_kinds = {"living", "kitchen", "dining", "hall"}
    if space >= 1600 and {a.kind, b.kind} <= open_kinds and rng.chance(40):
        kind, width = "wide", rng.between(1300, min(space, 2400), GRID)
    else:
        kind, width = "door", rng.between(800, min(space, 1000), GRID)
    start = rng.weighted(((low, 35), (high - width, 35), (rng.between(low, high - width, GRID), 30)))
    top = DOOR_HEIGHT + (rng.between(0, 200, GRID) if kind == "wide" else 0)
    return Opening(
        kind, axis, line, start, start + width, 0, top, (a.index, b.index) if a_first else (b.index, a.index)
    )


def outer_walls(rooms: tuple[Room, ...], room: Room) -> list[tuple[Room, int, int, int]]:
    """Parts of a room's walls that face outdoors: room, side, and the interval in world coordinates."""
    result = []
    for side in SIDES:
        cell = room.cell
        along = (cell.x0, cell.x1) if side % 2 == 0 else (cell.z0, cell.z1)
        line = (cell.z0, cell.x1, cell.z1, cell.x0)[side]
        free = [along]
        for other in rooms:
            wall = _shared(cell, other.cell) if other.index != room.index else None
            if wall is None or wall[1] != line or wall[0] != ("x" if side % 2 == 0 else "z"):
                continue
            if wall[4] != (side in (1, 2)):
                continue
            pieces = [((lo, min(hi, wall[2])), (max(lo, wall[3]), hi)) for lo, hi in free]
            free = [part for pair in pieces for part in pair if part[1] > part[0]]
        result += [(room, side, lo, hi) for lo, hi in free]
    return result


def _outer_opening(kind: str, wall: tuple[Room, int, int, int], low: int, high: int, bottom: int, top: int) -> Opening:
    room, side = wall[0], wall[1]
    line = (room.cell.z0, room.cell.x1, room.cell.z1, room.cell.x0)[side]
    rooms = (-1, room.index) if side in (0, 3) else (room.index, -1)
    return Opening(kind, "x" if side % 2 == 0 else "z", line, low, high, bottom, top, rooms)


def _entrance(rng: Rng, rooms: tuple[Room, ...], outer: list[tuple[Room, int, int, int]]) -> list[Opening]:
    for kinds in (("hall",), ("living",), ("kitchen", "dining")):
        walls = [wall for wall in outer if wall[0].kind in kinds and wall[3] - wall[2] >= 1300]
        if walls:
            wall = rng.choice(walls)
            start = rng.between(wall[2] + 200, wall[3] - 1150, GRID)
            return [_outer_opening("entrance", wall, start, start + 950, 0, DOOR_HEIGHT)]
    return []


_WINDOWS = {
    # kind: widths, sill heights, chance in percent
    "living": ((1400, 2400), (400, 800), 95), "kitchen": ((1000, 1600), (1050, 1100), 90),
    "dining": ((1200, 2000), (700, 900), 95), "bedroom": ((1000, 1800), (800, 950), 92),
    "study": ((1000, 1500), (850, 950), 92), "bath": ((500, 800), (1350, 1500), 75),
    "hall": ((600, 1000), (900, 1100), 50), "storage": ((500, 600), (1500, 1500), 25),
}  # fmt: skip


def _windows(
    rng: Rng, rooms: tuple[Room, ...], outer: list[tuple[Room, int, int, int]], taken: list[Opening], height: int
) -> list[Opening]:
    windows = []
    for wall in outer:
        room, side, low, high = wall
        widths, sills, chance = _WINDOWS[room.kind]
        low, high = low + 300, high - 300
        pieces = max(1, (high - low) // 3000)
        for k in range(pieces):
            lo, hi = low + (high - low) * k // pieces, low + (high - low) * (k + 1) // pieces
            width = min(rng.between(*widths, GRID), (hi - lo) // GRID * GRID)
            start = rng.between(lo, max(lo, hi - width))
            start = _snap((4 * start + lo + hi - width) // 6)  # rather in the middle
            sill = rng.between(*sills, GRID)
            top = min(sill + rng.between(1000, 1500, GRID), height - 250, 2250)
            if room.kind in ("bath", "storage"):
                top = min(sill + 700, height - 250)
            window = _outer_opening("window", wall, start, start + width, sill, top)
            clash = any(
                o.axis == window.axis
                and o.line == window.line
                and o.low < window.high + 200
                and window.low < o.high + 200
                for o in taken
            )
            if width >= widths[0] * 3 // 4 and not clash and rng.chance(chance):
                assert wall[2] < window.low < window.high < wall[3]
                windows.append(window)
    return windows
