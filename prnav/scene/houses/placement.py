"""Where furniture can stand: along walls, in corners and around other pieces."""

from __future__ import annotations

from dataclasses import dataclass, field

from prnav.scene.houses.occupancy import Doorway, Occupancy
from prnav.scene.houses.plan import Opening, Room, Storey
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES, Frame, Rect

WALL_GAP = 15
"""Furniture stands this far from the wall, just clear of the skirting [mm]."""
_STEP = 100
_TRIES = 40


@dataclass(frozen=True)
class Spot:
    """A place along a wall: the piece's frame, its side, and where it starts along that side."""

    frame: Frame
    side: int
    start: int


@dataclass
class RoomSpace:
    """What is still free in a room, on the floor and on the walls."""

    room: Room
    storey: Storey
    rng: Rng
    floor: Occupancy = field(init=False)
    walls: dict[int, list[tuple[int, int, int, int]]] = field(init=False)

    def __post_init__(self) -> None:
        inner = self.room.inner
        doorways = []
        self.walls = {side: [] for side in SIDES}
        for side in SIDES:
            frame = inner.frame(side)
            for opening, low, high in self.storey.openings_of(self.room, side):
                self.walls[side].append((low - 80, high + 80, opening.bottom - 60, opening.top + 80))
                if opening.kind == "window":
                    continue
                reach = 900 if opening.kind == "door" else 600
                keep = frame.rect(low - 50, 0, high + 50, reach)
                x, _, z = frame.point((low + high) // 2, 0, 325)
                doorways.append(Doorway((x, z), keep))
        self.floor = Occupancy(inner, doorways)

    def doors_inwards(self) -> list[tuple[Opening, int, int, int]]:
        """Doors whose leaf stands open into this room (from a hall into the room, else into the later one)."""
        found = []
        for side in SIDES:
            for opening, low, high in self.storey.openings_of(self.room, side):
                if opening.leaf not in ("open", "half"):
                    continue
                kinds = [self.storey.rooms[index].kind for index in opening.rooms]
                inwards = max(opening.rooms)
                if kinds.count("hall") == 1:
                    inwards = opening.rooms[1 - kinds.index("hall")]
                if inwards == self.room.index:
                    found.append((opening, side, low, high))
        return found

    def windows(self, side: int) -> list[tuple[Opening, int, int]]:
        """Windows in a wall with their intervals."""
        return [item for item in self.storey.openings_of(self.room, side) if item[0].kind == "window"]

    def wall_is_free(self, side: int, low: int, high: int, bottom: int, top: int) -> bool:
        """Whether a part of a wall has no opening, furniture or picture before it."""
        return all(high <= a or b <= low or top <= c or d <= bottom for a, b, c, d in self.walls[side])

    def hang(self, side: int, low: int, high: int, bottom: int, top: int) -> None:
        """Take a part of a wall."""
        self.walls[side].append((low, high, bottom, top))

    def wall_spot(
        self,
        w: int,
        d: int,
        h: int,
        *,
        front: int = 0,
        margin: int = 0,
        corner: int = 0,
        sides: tuple[int, ...] = SIDES,
        window: int = 0,
    ) -> Spot | None:
        """Find a place along a wall for a piece of w x d x h, and take it.

        ``front`` is floor that stays free before it, ``margin`` free wall at both ends; ``corner`` and ``window``
        are how much it likes a corner and a place under or beside a window (negative: dislikes).
        """
        candidates = []
        for side in sides:
            length = self.room.inner.length(side)
            last = length - WALL_GAP - w
            if last < WALL_GAP:
                continue
            windows = [(a, b) for _, a, b in self.windows(side)]
            for start in sorted({*range(WALL_GAP, last, _STEP), last}):
                if not self.wall_is_free(side, start - margin, start + w + margin, 0, h):
                    continue
                at_end = min(start, last - start) < 50
                lit = any(a < start + w and start < b for a, b in windows)
                score = self.rng.below(100) + corner * at_end + window * lit
                candidates.append((-score, side, start))
        candidates.sort()
        tries = 0
        for _, side, start in candidates:
            spot = Spot(self.room.inner.frame(side).at(start, 0, WALL_GAP), side, start)
            body = spot.frame.rect(0, 0, w, d)
            if self.floor.overlaps(body):
                continue
            space = spot.frame.rect(-margin, d, w + margin, d + front)
            if front and self.floor.mask(space) & self.floor.taken:
                continue
            tries += 1
            if self.floor.fits(body):
                self.floor.take(body)
                if front:
                    self.floor.keep(space)
                self.hang(side, start, start + w, 0, h)
                return spot
            if tries == _TRIES:
                break
        return None

    def stand(self, frame: Frame, w: int, d: int) -> bool:
        """Put a piece at a given frame, if it fits there."""
        body = frame.rect(0, 0, w, d)
        if not self.floor.fits(body):
            return False
        self.floor.take(body)
        return True

    def free_spot(self, w: int, d: int, reach: int) -> Frame | None:
        """A place away from walls for a piece with ``reach`` of furniture-free floor around it, near the middle."""
        inner = self.room.inner
        middle_x, middle_z = (inner.x0 + inner.x1) // 2, (inner.z0 + inner.z1) // 2
        candidates = []
        for turns in (0, 1):
            sx, sz = (w, d) if turns == 0 else (d, w)
            for x in range(inner.x0 + reach, inner.x1 - reach - sx + 1, 2 * _STEP):
                for z in range(inner.z0 + reach, inner.z1 - reach - sz + 1, 2 * _STEP):
                    off = abs(x + sx // 2 - middle_x) + abs(z + sz // 2 - middle_z)
                    candidates.append((off + self.rng.below(500), turns, x, z))
        candidates.sort()
        tries = 0
        for _, turns, x, z in candidates:
            sx, sz = (w, d) if turns == 0 else (d, w)
            body = Rect(x, z, x + sx, z + sz)
            around = body.inset(-reach)
            if self.floor.overlaps(body) or self.floor.mask(around) & self.floor.taken:
                continue
            tries += 1
            if self.floor.fits(body):
                self.floor.take(body)
                return Frame(x, 0, z, 0) if turns == 0 else Frame(x + sx, 0, z, 1)
            if tries == _TRIES:
                break
        return None

    def wall_place(self, w: int, h: int, bottom: int) -> tuple[int, int] | None:
        """Side and start of a free part of a wall for something that hangs there; it is taken."""
        candidates = []
        for side in SIDES:
            for start in range(150, self.room.inner.length(side) - 150 - w, _STEP):
                if self.wall_is_free(side, start - 60, start + w + 60, bottom - 50, bottom + h):
                    candidates.append((side, start))
        if not candidates:
            return None
        side, start = self.rng.choice(candidates)
        self.hang(side, start - 60, start + w + 60, bottom, bottom + h)
        return side, start
