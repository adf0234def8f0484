"""What a home's plan is made of: storeys, rooms, stairs, and the doors and windows in walls. Lengths are millimetres.

A storey's outline is cut by straight lines into one rectangular cell per room. Walls stand centred on the cells'
borders: a room's inner rectangle is its cell less half a wall's thickness. Everything lies on a grid of 50 mm, half
thicknesses excepted.
"""

from __future__ import annotations

from dataclasses import dataclass

from prnav.scene.houses.shapes import Rect

GRID = 50
DOOR_HEIGHT = 2050
FRAME_WIDTH = 70
STAIR_LIGHT = 0
"""Index of the light of the stairs: the stair room is the first of its storey."""


def snap(value: int) -> int:
    """The nearest multiple of the grid."""
    return (value + GRID // 2) // GRID * GRID


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
        leaf: how a door's leaf stands: "open", "half", "closed", or "" where there is none.
    """

    kind: str
    axis: str
    line: int
    low: int
    high: int
    bottom: int
    top: int
    rooms: tuple[int, int]
    leaf: str = ""


@dataclass(frozen=True)
class Stairs:
    """A flight up, a half landing, and a flight back above the place where one started.

    In the frame of the room's side ``entry`` (x along it, z into the room) the entry zone comes first; from
    ``start`` on the flights lie side by side, and the half landing fills the rest.

    Attributes:
        cell: of the stair room, the same on both storeys.
        entry: side of the room at which one comes in, on both storeys.
        steps: risers per flight.
        riser: height of a step.
        tread: depth of a step.
        landing: depth of the half landing.
        mirrored: the way up starts at the right.
    """

    cell: Rect
    entry: int
    steps: int
    riser: int
    tread: int
    landing: int
    mirrored: bool

    @property
    def rise(self) -> int:
        """Height from floor to floor."""
        return 2 * self.steps * self.riser

    def start(self, inner: Rect) -> int:
        """Depth of the entry zone in a room with these walls."""
        depth = inner.length((self.entry + 1) % 4)
        return depth - self.landing - (self.steps - 1) * self.tread

    def entry_zone(self, inner: Rect) -> Rect:
        """Floor of the entry zone."""
        return inner.frame(self.entry).rect(0, 0, inner.length(self.entry), self.start(inner))


@dataclass(frozen=True)
class Storey:
    """One storey.

    Attributes:
        level: height of the floor.
        height: from floor to ceiling.
        thickness: of the walls between rooms.
        rooms: by index.
        openings: doors and windows.
        first_light: index of the light of room 0; the other rooms' follow.
        stairs_up: stairs to the next storey.
        stairs_down: stairs from the storey below.
    """

    level: int
    height: int
    thickness: int
    rooms: tuple[Room, ...]
    openings: tuple[Opening, ...]
    first_light: int = 0
    stairs_up: Stairs | None = None
    stairs_down: Stairs | None = None

    @property
    def facade(self) -> int:
        """Height of the outer walls' outside."""
        return self.height + 100 if self.stairs_up is None else self.stairs_up.rise

    def light(self, room: Room) -> int:
        """Index of the light of a room; a stair room is lit from its lowest storey to its highest ceiling."""
        if room.kind == "stairs" and self.stairs_down is not None:
            return STAIR_LIGHT
        return self.first_light + room.index

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
