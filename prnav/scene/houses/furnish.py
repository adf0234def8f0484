"""Furnishing a room: its doors, lamps and walls, and the pieces that belong to its kind."""

from __future__ import annotations

from collections.abc import Callable

from prnav.scene.houses import door_leaves, pieces, pieces_more
from prnav.scene.houses.builder import Builder, Pen
from prnav.scene.houses.furnish_day import dining, hall, kitchen, living, study
from prnav.scene.houses.furnish_night import bath, bedroom, storage
from prnav.scene.houses.light import Lamp
from prnav.scene.houses.placement import RoomSpace, Spot
from prnav.scene.houses.plan import Storey
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES, Frame, Rect
from prnav.scene.houses.style import HomeStyle, RoomStyle

LAMP = 2_600_000.0
"""Strength of a ceiling lamp."""


class Furnisher:
    """Furnishes one room; collects its lamps."""

    def __init__(
        self, builder: Builder, storey: Storey, space: RoomSpace, home: HomeStyle, style: RoomStyle, rng: Rng
    ) -> None:
        self.builder, self.storey, self.space = builder, storey, space
        self.home, self.style, self.rng = home, style, rng
        self.room, self.inner = space.room, space.room.inner
        self.lamps: list[Lamp] = []
        self._pendants: list[tuple[int, int]] = []
        self._rugs = 0

    @property
    def square(self) -> int:
        """Area of the room in hundredths of a square metre."""
        return self.inner.area // 10_000

    def furnish(self) -> None:
        """Furnish the room."""
        self._door_leaves()
        if self.room.kind == "stairs":
            self._stairs()
            return
        self._curtains()
        {
            "living": living, "kitchen": kitchen, "dining": dining, "bedroom": bedroom, "bath": bath, "study": study,
            "hall": hall, "storage": storage,
        }[self.room.kind](self)  # fmt: skip
        self._ceiling_lamps()

    def pen(self, frame: Frame) -> Pen:
        """A pen for a piece whose frame stands on the floor."""
        return self.builder.pen(self.storey.light(self.room), frame._replace(y=frame.y + self.storey.level))

    def draw(self, piece: Callable[..., None], frame: Frame, *sizes: int) -> None:
        """Draw a piece whose place is settled."""
        self.builder.placed[piece.__name__] = self.builder.placed.get(piece.__name__, 0) + 1
        piece(self.pen(frame), self.rng, *sizes, self.home, self.style)

    def put(self, piece: Callable[..., None], w: int, d: int, h: int, **where: int) -> Spot | None:
        """Draw a piece of this size somewhere along a wall, if there is a place (see RoomSpace.wall_spot)."""
        spot = self.space.wall_spot(w, d, h, **where)  # type: ignore[arg-type]
        if spot is not None:
            self.draw(piece, spot.frame, w, d)
        return spot

    def settle(self, body: Rect) -> bool:
        """Take floor away from walls, if it is free and people can still walk."""
        floor, inner = self.space.floor, self.inner
        inside = body.x0 >= inner.x0 and body.z0 >= inner.z0 and body.x1 <= inner.x1 and body.z1 <= inner.z1
        mask = floor.mask(body)
        if not inside or mask & floor.taken or not floor.is_walkable(floor.taken | mask):
            return False
        floor.take(body)
        return True

    def lamp(self, x: int, y: int, z: int, strength: float = LAMP) -> None:
        """A source of light."""
        self.lamps.append(Lamp((x, y + self.storey.level, z), None, strength))

    def pendant(self, frame: Frame, x: int, z: int) -> None:
        """A lamp that hangs over a place in a piece's frame."""
        px, _, pz = frame.point(x, 0, z)
        drop = self.storey.height - 1750
        pieces.pendant(self.pen(Frame(px, self.storey.height, pz, 0)), self.rng, drop, self.home)
        self.lamp(px, 1850, pz)
        self._pendants.append((px, pz))

    def pictures(self, count: int) -> None:
        """Pictures on free walls."""
        for _ in range(count):
            w, h = self.rng.between(400, 1000, 50), self.rng.between(350, 700, 50)
            frame = self.hang(w, h, 1300)
            if frame is not None:
                pieces.picture_frame(self.pen(frame), self.rng, w, h, self.home)

    def hang(self, w: int, h: int, bottom: int, room_below: int = 0) -> Frame | None:
        """Frame of a free part of a wall, taken, with ``room_below`` of free wall under it."""
        place = self.space.wall_place(w, h + room_below, bottom - room_below)
        return None if place is None else self.inner.frame(place[0]).at(place[1], bottom, 0)

    def clock(self, percent: int) -> None:
        """A clock on a wall."""
        frame = self.hang(380, 380, 1650) if self.rng.chance(percent) else None
        if frame is not None:
            pieces_more.wall_clock(self.pen(frame.at(190, 190, 0)), self.rng, self.home)

    def shelves(self, percent: int) -> None:
        """A shelf on a wall."""
        w = self.rng.choice((700, 900, 1100))
        frame = self.hang(w, 400, 1350, 120) if self.rng.chance(percent) else None
        if frame is not None:
            pieces_more.wall_shelf(self.pen(frame), self.rng, w, self.home)

    def wall_lamps(self, count: int) -> None:
        """Lamps on the walls."""
        for _ in range(count):
            frame = self.hang(200, 300, 1650)
            if frame is not None:
                pieces_more.wall_lamp(self.pen(frame.at(100, 100, 0)), self.rng, self.home)
                x, y, z = frame.point(100, 150, 150)
                self.lamp(x, y, z, LAMP / 5)

    def plants(self, percent: int) -> None:
        """A plant, rather in a corner."""
        if self.rng.chance(percent):
            self.put(pieces.plant, 420, 420, 1200, corner=80, window=30)

    def floor_lamp(self, percent: int) -> None:
        """A standing lamp in a corner."""
        if self.rng.chance(percent):
            spot = self.put(pieces.floor_lamp, 400, 400, 1700, corner=90)
            if spot is not None:
                x, y, z = spot.frame.point(200, 1350, 250)
                self.lamp(x, y, z, LAMP / 3)

    def heater(self, percent: int) -> None:
        """A radiator, rather below a window."""
        if self.rng.chance(percent):
            w = self.rng.choice((700, 840, 980))
            self.put(pieces_more.radiator, w, 100, 640, window=300)

    def rug(self, x0: int, z0: int, frame: Frame, w: int, d: int) -> None:
        """A rug at (x0, z0) in a piece's frame, cut off at the walls."""
        rect, inner = frame.rect(x0, z0, x0 + w, z0 + d), self.inner.inset(60)
        low_x, low_z = max(rect.x0, inner.x0), max(rect.z0, inner.z0)
        wide, deep = min(rect.x1, inner.x1) - low_x, min(rect.z1, inner.z1) - low_z
        if wide > 500 and deep > 500:
            pieces.rug(self.pen(Frame(low_x, 0, low_z, 0)), self.rng, wide, deep, 10 + 4 * self._rugs)
            self._rugs += 1  # where two overlap, one lies on the other

    def middle_rug(self, w: int, d: int) -> None:
        """A rug in the middle of the room, its longer side along the room's."""
        w, d = (w, d) if self.inner.width >= self.inner.depth else (d, w)
        self.rug(
            (self.inner.width - w) // 2, (self.inner.depth - d) // 2, Frame(self.inner.x0, 0, self.inner.z0, 0), w, d
        )

    def _curtains(self) -> None:
        """Curtains at the windows of rooms where people sit and sleep, all of one cloth and length."""
        rng = self.rng.fork("curtains")
        if self.room.kind not in ("living", "dining", "bedroom", "study") or not rng.chance(78):
            return
        fabric, long = rng.choice((self.style.accent, self.home.fabric, self.home.curtain)), rng.chance(45)
        for side in SIDES:
            for opening, low, high in self.space.windows(side):
                width = rng.between(200, 300, 10)
                top, bottom = min(opening.top + 140, self.storey.height - 40), 40 if long else opening.bottom - 130
                if low - width < 150 or high + width > self.inner.length(side) - 150:
                    continue
                if not all(self.space.wall_is_free(side, a, b, bottom, top)
                           for a, b in ((low - width, low - 90), (high + 90, high + width))):  # fmt: skip
                    continue
                self.space.hang(side, low - width, low, bottom, top)
                self.space.hang(side, high, high + width, bottom, top)
                pen = self.pen(self.inner.frame(side).at(low - width, top, 0))
                pieces_more.curtain_rod(pen, high - low + 2 * width)
                for x in (10, high - low + width + 20):
                    pieces_more.curtain(pen.at(x, 0, 0), width - 30, top - bottom, fabric)

    def _ceiling_lamps(self) -> None:
        """One lamp in the middle, more in long and large rooms; none near a pendant."""
        inner, h = self.inner, self.storey.height
        columns, rows = (max(1, (size + 1500) // 4500) for size in (inner.width, inner.depth))
        for c in range(columns):
            for r in range(rows):
                x = inner.x0 + inner.width * (2 * c + 1) // (2 * columns)
                z = inner.z0 + inner.depth * (2 * r + 1) // (2 * rows)
                if all(abs(x - px) + abs(z - pz) > 2200 for px, pz in self._pendants):
                    pieces.ceiling_lamp(self.pen(Frame(x, h, z, 0)), self.rng.fork("ceiling lamp"), self.home)
                    self.lamp(x, h - 150, z)

    def _stairs(self) -> None:
        """Nothing stands on the way: a lamp over the way in below, a lamp and pictures over the flights above."""
        stairs, inner = self.storey.stairs_up or self.storey.stairs_down, self.inner
        assert stairs is not None
        place = stairs.entry_zone(inner) if self.storey.stairs_up is not None else inner
        x, z, h = (place.x0 + place.x1) // 2, (place.z0 + place.z1) // 2, self.storey.height
        pieces.ceiling_lamp(self.pen(Frame(x, h, z, 0)), self.rng, self.home)
        self.lamp(x, h - 150, z)
        if self.storey.stairs_down is not None:
            self.pictures(self.rng.between(3, 5))
            self.wall_lamps(self.rng.between(0, 2))

    def _door_leaves(self) -> None:
        """Doors that open into this room stand half open, or open: along the wall, or across where a corner is near."""
        for opening, side, low, high in self.space.doors_inwards():
            width, length = high - low, self.inner.length(side)
            at_low = low < length - high
            corner = low if at_low else length - high
            flat = corner > width + 60
            hinge = low - 5 if at_low else high + 5
            if flat:
                x0, x1, z0, z1 = (hinge - width, hinge, 20, 60) if at_low else (hinge, hinge + width, 20, 60)
            else:
                x0, x1, z0, z1 = (hinge - 40, hinge, 20, 20 + width) if at_low else (hinge, hinge + 40, 20, 20 + width)
            frame = self.inner.frame(side)
            floor = self.space.floor
            if opening.leaf == "half":
                floor.keep(frame.rect(low - 50, 0, high + 50, 1250))
                angle = self.rng.choice(((574, 819), (500, 866), (423, 906)))
                leaf = self.pen(frame.at(low + 5 if at_low else high - 5, 0, 5))
                door_leaves.turned(leaf, width - 10, opening.top - 15, angle, at_low, self.home)
                continue
            body = frame.rect(x0, z0, x1, z1)
            if corner < 60 or floor.mask(body) & floor.taken or not floor.is_walkable(floor.taken | floor.mask(body)):
                continue
            if flat and not self.space.wall_is_free(side, min(x0, hinge - 90), x1 - 90 if at_low else x1, 0, 2000):
                continue
            floor.take(body)
            if flat:
                self.space.hang(side, x0, x1, 0, opening.top)
            door_leaves.flat(self.pen(frame), (x0, z0, x1, z1), opening.top - 15, at_low, self.home)


def furnish_room(
    builder: Builder, storey: Storey, space: RoomSpace, home: HomeStyle, style: RoomStyle, rng: Rng
) -> list[Lamp]:
    """Furnish a room and return its lamps."""
    furnisher = Furnisher(builder, storey, space, home, style, rng)
    furnisher.furnish()
    return furnisher.lamps
