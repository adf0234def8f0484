"""Doors and windows: which rooms are joined, where walls are broken, and how the doors stand."""

from __future__ import annotations

from dataclasses import replace

from prnav.scene.houses.plan import DOOR_HEIGHT, GRID, Opening, Room, snap
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES, Rect

_COSTS = {
    # how unlikely a door between two kinds is; pairs not named cost 6
    ("hall", "living"): 1, ("hall", "kitchen"): 1, ("hall", "bedroom"): 1, ("bath", "hall"): 1, ("hall", "study"): 1,
    ("dining", "hall"): 1, ("hall", "storage"): 1, ("hall", "hall"): 1, ("kitchen", "living"): 1,
    ("dining", "living"): 1, ("dining", "kitchen"): 1, ("living", "study"): 2, ("bedroom", "living"): 3,
    ("bath", "bedroom"): 4, ("bath", "living"): 5, ("kitchen", "storage"): 2, ("living", "storage"): 3,
    ("bedroom", "dining"): 5, ("bedroom", "study"): 5, ("bedroom", "bedroom"): 9, ("bath", "kitchen"): 9,
    ("bath", "bath"): 12, ("bath", "storage"): 12, ("bath", "dining"): 9, ("bedroom", "storage"): 6,
}  # fmt: skip


def _shared(a: Rect, b: Rect) -> Wall | None:
    """Axis, line and interval of the wall between two cells, and whether ``a`` is at its lower side."""
    low, high = max(a.z0, b.z0), min(a.z1, b.z1)
    if high > low and (a.x1 == b.x0 or b.x1 == a.x0):
        return "z", a.x1 if a.x1 == b.x0 else a.x0, low, high, a.x1 == b.x0
    low, high = max(a.x0, b.x0), min(a.x1, b.x1)
    if high > low and (a.z1 == b.z0 or b.z1 == a.z0):
        return "x", a.z1 if a.z1 == b.z0 else a.z0, low, high, a.z1 == b.z0
    return None


Wall = tuple[str, int, int, int, bool]


def _edges(rooms: tuple[Room, ...]) -> list[tuple[int, Room, Room, Wall]]:
    """Pairs of rooms with a wall between them that is long enough for a door, and ten times their cost."""
    edges = []
    for a in rooms:
        for b in rooms[a.index + 1 :]:
            wall = _shared(a.cell, b.cell)
            if "stairs" in (a.kind, b.kind) and "hall" not in (a.kind, b.kind):
                continue  # the stairs' other walls are beside and behind the flights
            if wall is not None and wall[3] - wall[2] >= 1300:
                pair = (a.kind, b.kind) if a.kind <= b.kind else (b.kind, a.kind)
                edges.append((10 * _COSTS.get(pair, 6), a, b, wall))
    return edges


def tree_costs(rooms: tuple[Room, ...]) -> list[int]:
    """Costs of the doors of the cheapest spanning tree, 1000 where a room cannot be reached."""
    group = list(range(len(rooms)))
    costs = []
    for cost, a, b, _ in sorted(_edges(rooms), key=lambda edge: edge[0]):
        if group[a.index] != group[b.index]:
            group = [group[a.index] if g == group[b.index] else g for g in group]
            costs.append(cost)
    return costs + [1000] * (len(set(group)) - 1)


def doors(rng: Rng, rooms: tuple[Room, ...], home_area: int) -> list[Opening]:
    """A spanning tree of doors (cheapest pairs first) and some more that close loops.

    Doors that are not needed to reach a room may be closed, and so may that of one small room with no other door, of
    at most a twenty-fifth of the home's area [mm2].
    """
    edges = [(cost + rng.below(8), a, b, wall) for cost, a, b, wall in _edges(rooms)]
    edges.sort(key=lambda edge: (edge[0], edge[1].index, edge[2].index))
    group = list(range(len(rooms)))
    found: list[Opening] = []
    loops: list[bool] = []
    for cost, a, b, wall in edges:
        joined = group[a.index] != group[b.index]
        private = "bath" in (a.kind, b.kind) or "storage" in (a.kind, b.kind)
        loop = rng.chance(55 if cost < 30 else 15 if cost < 50 else 0)
        locked = rng.chance(12)  # a second way that is always closed
        if not joined and ("stairs" in (a.kind, b.kind) or ((private or not loop) and not locked)):
            continue
        group = [group[a.index] if g == group[b.index] else g for g in group]
        locked = not joined and (private or not loop)
        door = _door(rng, a, b, wall, locked)
        found.append(replace(door, leaf="closed") if locked else door)
        loops.append(not joined)
    assert len(set(group)) == 1, "every room touches another"
    leaf = rng.fork("leaves")
    shut = False
    for k, door in enumerate(found):
        if door.kind != "door" or door.leaf:
            continue
        state = leaf.weighted((("open", 50), ("half", 25), ("", 10), ("closed", 15)))
        if loops[k] and leaf.chance(25):
            state = "closed"
        if state == "closed" and not loops[k]:
            small = [
                room
                for room in (rooms[index] for index in door.rooms)
                if room.kind in ("storage", "bath")
                and 25 * room.cell.area <= home_area
                and sum(room.index in other.rooms for other in found) == 1
            ]
            state = "closed" if small and not shut else "half"
            shut = shut or state == "closed"
        found[k] = replace(door, leaf=state)
    return found


def _door(rng: Rng, a: Room, b: Room, wall: Wall, leaf: bool = False) -> Opening:
    axis, line, low, high, a_first = wall
    low, high = low + 200, high - 200  # half a wall, a frame and a hand
    space = high - low
    open_kinds = {"living", "kitchen", "dining", "hall"}
    kind, width = "door", 0
    if "stairs" in (a.kind, b.kind):
        kind, width = "wide", rng.between(min(space, 1300), min(space, 1900), GRID)
    elif not leaf and space >= 1600 and {a.kind, b.kind} <= open_kinds and rng.chance(40):
        kind, width = "wide", rng.between(1300, min(space, 2400), GRID)
    else:
        width = rng.between(800, min(space, 1000), GRID)
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


def entrance(rng: Rng, outer: list[tuple[Room, int, int, int]]) -> list[Opening]:
    """The front door, from a hall if there is one at an outer wall."""
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
    "hall": ((600, 1000), (900, 1100), 50), "stairs": ((700, 1000), (900, 1000), 90),
    "storage": ((500, 600), (1500, 1500), 25),
}  # fmt: skip


def windows(
    rng: Rng, outer: list[tuple[Room, int, int, int]], taken: list[Opening], height: int, ground: bool
) -> list[Opening]:
    """Windows in the outer walls; stairs have some on the upper storey alone."""
    found = []
    for wall in outer:
        room, side, low, high = wall
        if room.kind not in _WINDOWS or (room.kind == "stairs" and ground):
            continue
        widths, sills, chance = _WINDOWS[room.kind]
        low, high = low + 300, high - 300
        pieces = max(1, (high - low) // 3000)
        for k in range(pieces):
            lo, hi = low + (high - low) * k // pieces, low + (high - low) * (k + 1) // pieces
            width = min(rng.between(*widths, GRID), (hi - lo) // GRID * GRID)
            start = rng.between(lo, max(lo, hi - width))
            start = snap((4 * start + lo + hi - width) // 6)  # rather in the middle
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
                found.append(window)
    return found
