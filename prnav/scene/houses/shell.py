"""The built part of a home: floors, walls, ceilings, doorways, windows, skirting."""

from __future__ import annotations

from prnav.scene.houses import door_leaves
from prnav.scene.houses.builder import Builder, Material, Pen
from prnav.scene.houses.flight import build_stairs
from prnav.scene.houses.openings import outer_walls
from prnav.scene.houses.plan import FRAME_WIDTH, Opening, Room, Storey
from prnav.scene.houses.shapes import SIDES, Frame, Rect
from prnav.scene.houses.style import METAL, WHITE, HomeStyle, RoomStyle

FLOOR_STEP = 400
WALL_STEP = 650
OUTER_THICKNESS = 160
REVEAL = 110
SKIRTING = (80, 12)


def build_shell(builder: Builder, storey: Storey, home: HomeStyle, rooms: list[RoomStyle]) -> None:
    """Draw one storey without its furniture."""
    for room, style in zip(storey.rooms, rooms, strict=True):
        pen = builder.pen(storey.light(room), Frame(0, storey.level, 0, 0))
        inner = floor = ceiling = room.inner
        if room.kind == "stairs":
            stairs = storey.stairs_up or storey.stairs_down
            assert stairs is not None
            floor = stairs.entry_zone(inner)
            ceiling = floor if storey.stairs_up is not None else inner
        pen.slab(floor.x0, floor.z0, floor.x1, floor.z1, 0, style.floor, step=FLOOR_STEP)
        pen.slab(
            ceiling.x0, ceiling.z0, ceiling.x1, ceiling.z1, storey.height, home.ceiling, up=False, step=2 * FLOOR_STEP
        )
        if room.kind == "stairs" and storey.stairs_up is not None:
            build_stairs(builder, storey, room, home, style)
        for side in SIDES:
            wall = builder.pen(storey.light(room), inner.frame(side)).at(0, storey.level, 0)
            _wall(wall, inner.length(side), storey, room, side, style, home)
    for opening in storey.openings:
        if min(opening.rooms) >= 0:
            _passage(builder, storey, opening, home, rooms)
    for room in storey.rooms:
        for _, side, low, high in outer_walls(storey.rooms, room):
            _facade(builder, storey, room, side, low, high, home)


def _wall(pen: Pen, length: int, storey: Storey, room: Room, side: int, style: RoomStyle, home: HomeStyle) -> None:
    holes = storey.openings_of(room, side)
    columns = sorted({0, length, *(edge for _, low, high in holes for edge in (low, high))})
    rows = sorted(
        {
            0,
            storey.height,
            *([style.panel_height] if style.panel else []),
            *(e for o, _, _ in holes for e in (o.bottom, o.top)),
        }
    )
    upstairs = room.kind == "stairs" and storey.stairs_down is not None  # no floor along the flights
    skirted = style.skirting and not upstairs
    for x0, x1 in zip(columns, columns[1:], strict=False):
        here = [o for o, low, high in holes if low <= x0 and x1 <= high]
        start = 0
        while start < len(rows) - 1:
            y0, y1 = rows[start], rows[start + 1]
            start += 1
            if any(o.bottom <= y0 and y1 <= o.top for o in here):
                continue
            material = style.panel if style.panel is not None and y1 <= style.panel_height else style.wall
            pen.panel(x0, y0, x1, y1, 0, material, step=WALL_STEP)
        if skirted and not any(o.bottom == 0 for o in here):
            _skirting(pen, x0, x1, home.trim)
    if style.panel is not None and style.skirting:
        for x0, x1 in _gaps(length, [(low, high) for o, low, high in holes if o.bottom < style.panel_height]):
            pen.box(x0, style.panel_height - 20, 0, x1, style.panel_height + 20, 18, home.trim, skip="BLR")
    if home.cornice and room.kind != "stairs":
        _cornice(pen, length, storey.height, home.ceiling)
    for opening, low, high in holes:
        if opening.kind == "door" and high + 260 < length:
            pen.box(high + 150, 1050, 0, high + 230, 1130, 10, WHITE, skip="B")  # a light switch
        if opening.kind == "window":
            _window(pen, opening, low, high, home)
        elif opening.kind == "entrance":
            _entrance(pen, opening, low, high, home)
        _casing(pen, opening, low, high, home)


def _gaps(length: int, holes: list[tuple[int, int]]) -> list[tuple[int, int]]:
    edges = [0, *(edge for hole in sorted(holes) for edge in hole), length]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a]


def _skirting(pen: Pen, x0: int, x1: int, material: Material) -> None:
    height, depth = SKIRTING
    pen.panel(x0, 0, x1, height, depth, material)
    pen.slab(x0, 0, x1, depth, height, material)


def _cornice(pen: Pen, length: int, top: int, material: Material) -> None:
    """A moulding where the wall meets the ceiling."""
    size = 85
    corners = [(0, top - size, 6), (length, top - size, 6), (length, top, size), (0, top, size)]
    pen.quad(corners, material, (length, size), cuts=(max(1, length // 900), 1))
    pen.slab(0, 0, length, 6, top - size, material, up=False)


def _casing(pen: Pen, opening: Opening, low: int, high: int, home: HomeStyle) -> None:
    """The frame around an opening, standing 15 mm out of the wall."""
    if opening.kind == "wide":
        return
    w, out, trim = FRAME_WIDTH, 15, home.trim
    bottom = opening.bottom if opening.kind == "window" else 0
    pen.box(low - w, bottom, 0, low, opening.top + w, out, trim, skip="BU")
    pen.box(high, bottom, 0, high + w, opening.top + w, out, trim, skip="BU")
    pen.box(low, opening.top, 0, high, opening.top + w, out, trim, skip="BLR")


def _reveal(pen: Pen, low: int, high: int, bottom: int, top: int, depth: int, material: Material) -> None:
    """The sides and the top of a hole that goes ``depth`` into the wall."""
    span = top - bottom
    pen.quad([(low, bottom, 0), (low, bottom, -depth), (low, top, -depth), (low, top, 0)], material, (depth, span))
    pen.quad([(high, bottom, -depth), (high, bottom, 0), (high, top, 0), (high, top, -depth)], material, (depth, span))
    pen.slab(low, -depth, high, 0, top, material, up=False)


def _window(pen: Pen, opening: Opening, low: int, high: int, home: HomeStyle) -> None:
    bottom, top = opening.bottom, opening.top
    _reveal(pen, low, high, bottom, top, REVEAL, home.trim)
    pen.slab(low, -REVEAL, high, 0, bottom, home.trim)
    pen.box(low - 60, bottom - 30, 0, high + 60, bottom, 90, home.trim, skip="B")
    view = Material(f"view:{(low + high) // 100 % 4}", (255, 255, 255), 0, glow=True)
    pen.panel(low, bottom, high, top, -REVEAL, view)
    panes = max(1, (high - low) // 900)
    bar, z0, z1 = 25, -REVEAL, -REVEAL + 30
    for k in range(panes + 1):
        x = low + (high - low) * k // panes
        x = min(max(x, low + bar), high - bar)
        pen.box(x - bar, bottom, z0, x + bar, top, z1, home.trim, skip="BTU")
    for y0, y1 in ((bottom, bottom + 2 * bar), (top - 2 * bar, top)):
        pen.box(low, y0, z0, high, y1, z1, home.trim, skip="BLR")


def _entrance(pen: Pen, opening: Opening, low: int, high: int, home: HomeStyle) -> None:
    _reveal(pen, low, high, 0, opening.top, 60, home.trim)
    pen.slab(low, -60, high, 0, 0, home.dark_wood)
    pen.panel(low, 0, high, opening.top, -60, home.door._replace(color=home.front.color))
    pen.box(high - 110, 1000, -60, high - 40, 1030, -10, METAL, skip="B")


def _passage(builder: Builder, storey: Storey, opening: Opening, home: HomeStyle, rooms: list[RoomStyle]) -> None:
    """Jambs, lintel and threshold between two rooms."""
    half = storey.thickness // 2
    low_room, high_room = (storey.rooms[index] for index in opening.rooms)
    side = 2 if opening.axis == "x" else 1  # the wall as seen from the room at the lower side
    low, high = low_room.inner.along(side, opening.low, opening.high)
    pen = builder.pen(storey.light(low_room), low_room.inner.frame(side)).at(0, storey.level, 0)
    jamb = home.trim if opening.kind == "door" else rooms[low_room.index].wall
    _reveal(pen, low, high, 0, opening.top, 2 * half, jamb)
    floors = (rooms[low_room.index].floor, rooms[high_room.index].floor)
    same = floors[0] == floors[1]
    if opening.leaf == "closed":
        door_leaves.closed(pen.at(low, 0, 20 - half), high - low, opening.top, home)
    pen.slab(low, -2 * half, high, 0, 0, floors[0] if same else home.dark_wood)


def _facade(builder: Builder, storey: Storey, room: Room, side: int, low: int, high: int, home: HomeStyle) -> None:
    """The outside of an outer wall, with its windows and doors painted on."""
    cell = room.cell
    start, end = cell.along(side, low, high)
    frame = cell.frame(side)
    pen = builder.pen(-1, frame.at(end, storey.level, -OUTER_THICKNESS, 2))  # faces outwards
    length = end - start

    def outside(x: int, z: int) -> bool:
        px, _, pz = frame.point(x, 0, z)
        return not any(_covers(other.cell, px, pz) for other in storey.rooms)

    # neighbours that go on in the same line need no corner; a wing's wall that comes towards us ends this one early
    left = _corner(outside, end, 1)
    right = _corner(outside, start, -1)
    pen.panel(-left, 0, length + right, storey.facade, 0, home.facade)
    for opening, lo, hi in storey.openings_of(room, side):
        if min(opening.rooms) >= 0:
            continue
        shift = (cell.length(side) - room.inner.length(side)) // 2
        lo, hi = end - (hi + shift), end - (lo + shift)
        if 0 <= lo and hi <= length:
            glass = Material("screen", (255, 255, 255), 0) if opening.kind == "window" else home.door
            pen.box(lo, opening.bottom, 0, hi, opening.top, 10, home.trim, front=glass, skip="B")


def _covers(cell: Rect, x: int, z: int) -> bool:
    return cell.x0 <= x <= cell.x1 and cell.z0 <= z <= cell.z1


def _corner(outside, x: int, step: int) -> int:  # noqa: ANN001
    if not outside(x + step, -1):
        return -OUTER_THICKNESS
    return OUTER_THICKNESS if outside(x + step, 1) else 0
