"""Which furniture a room gets, by its kind."""

from __future__ import annotations

from collections.abc import Callable

from prnav.scene.houses import door_leaves, pieces, pieces_wet
from prnav.scene.houses.builder import Builder, Pen
from prnav.scene.houses.light import Lamp
from prnav.scene.houses.placement import RoomSpace, Spot
from prnav.scene.houses.plan import Storey
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import Frame
from prnav.scene.houses.style import HomeStyle, RoomStyle

_LAMP = 2_600_000.0
_SOFA = 560  # what counts below a window: the back may stand before the glass


class Furnisher:
    """Furnishes one room; collects its lamps."""

    def __init__(
        self, builder: Builder, storey: Storey, space: RoomSpace, home: HomeStyle, style: RoomStyle, rng: Rng
    ) -> None:
        self.builder, self.storey, self.space = builder, storey, space
        self.home, self.style, self.rng = home, style, rng
        self.room = space.room
        self.lamps: list[Lamp] = []
        self._ceiling_taken = False
        self._rugs = 0

    def pen(self, frame: Frame) -> Pen:
        """A pen for a piece whose frame stands on the floor."""
        return self.builder.pen(self.storey.light(self.room), frame._replace(y=frame.y + self.storey.level))

    def furnish(self) -> None:
        """Furnish the room."""
        self._door_leaves()
        if self.room.kind == "stairs":
            self._stairs()
            return
        {
            "living": self._living, "kitchen": self._kitchen, "dining": self._dining, "bedroom": self._bedroom,
            "bath": self._bath, "study": self._study, "hall": self._hall, "storage": self._storage,
        }[self.room.kind]()  # fmt: skip
        if not self._ceiling_taken:
            inner = self.room.inner
            x, z, h = (inner.x0 + inner.x1) // 2, (inner.z0 + inner.z1) // 2, self.storey.height
            pieces.ceiling_lamp(self.pen(Frame(x, h, z, 0)), self.rng, self.home)
            self._lamp(x, h - 150, z)

    def _stairs(self) -> None:
        """Nothing stands on the way; a lamp over the way in below, and one over the flights above."""
        stairs, inner = self.storey.stairs_up or self.storey.stairs_down, self.room.inner
        assert stairs is not None
        place = stairs.entry_zone(inner) if self.storey.stairs_up is not None else inner
        x, z, h = (place.x0 + place.x1) // 2, (place.z0 + place.z1) // 2, self.storey.height
        pieces.ceiling_lamp(self.pen(Frame(x, h, z, 0)), self.rng, self.home)
        self._lamp(x, h - 150, z)

    def _door_leaves(self) -> None:
        """Doors that open into this room stand half open, or open: along the wall, or across where a corner is near."""
        for opening, side, low, high in self.space.doors_inwards():
            width, length = high - low, self.room.inner.length(side)
            at_low = low < length - high
            corner = low if at_low else length - high
            flat = corner > width + 60
            hinge = low - 5 if at_low else high + 5
            if flat:
                x0, x1, z0, z1 = (hinge - width, hinge, 20, 60) if at_low else (hinge, hinge + width, 20, 60)
            else:
                x0, x1, z0, z1 = (hinge - 40, hinge, 20, 20 + width) if at_low else (hinge, hinge + 40, 20, 20 + width)
            frame = self.room.inner.frame(side)
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

    def _lamp(self, x: int, y: int, z: int, strength: float = _LAMP) -> None:
        self.lamps.append(Lamp((x, y + self.storey.level, z), None, strength))

    def _put(self, draw: Callable[..., None], w: int, d: int, h: int, **where: int) -> Spot | None:
        spot = self.space.wall_spot(w, d, h, **where)  # type: ignore[arg-type]
        if spot is not None:
            draw(self.pen(spot.frame), self.rng, w, d, self.home, self.style)
        return spot

    def _pictures(self, count: int) -> None:
        for _ in range(count):
            w, h = self.rng.between(400, 1000, 50), self.rng.between(350, 700, 50)
            place = self.space.wall_place(w, h, 1300)
            if place is not None:
                side, start = place
                frame = self.room.inner.frame(side).at(start, 1300, 0)
                pieces.picture_frame(self.pen(frame), self.rng, w, h, self.home)

    def _plants(self, percent: int) -> None:
        if self.rng.chance(percent):
            self._put(pieces.plant, 420, 420, 1200, corner=80, window=30)

    def _floor_lamp(self, percent: int) -> None:
        if self.rng.chance(percent):
            spot = self._put(pieces.floor_lamp, 400, 400, 1700, corner=90)
            if spot is not None:
                x, y, z = spot.frame.point(200, 1350, 250)
                self._lamp(x, y, z, _LAMP / 3)

    def _rug(self, x0: int, z0: int, frame: Frame, w: int, d: int) -> None:
        """A rug at (x0, z0) in a piece's frame, cut off at the walls."""
        rect, inner = frame.rect(x0, z0, x0 + w, z0 + d), self.room.inner.inset(60)
        low_x, low_z, high_x, high_z = (
            max(rect.x0, inner.x0),
            max(rect.z0, inner.z0),
            min(rect.x1, inner.x1),
            min(rect.z1, inner.z1),
        )
        if high_x - low_x > 500 and high_z - low_z > 500:
            pieces.rug(
                self.pen(Frame(low_x, 0, low_z, 0)), self.rng, high_x - low_x, high_z - low_z, 10 + 4 * self._rugs
            )
            self._rugs += 1  # where two overlap, one lies on the other

    def _bedroom(self) -> None:
        rng, big = self.rng, self.room.inner.area > 10_500_000
        w = rng.choice((1400, 1600, 1800)) if big else rng.choice((900, 900, 1000, 1400))
        d = 2050
        beside = 500 if w >= 1400 and rng.chance(85) else 0
        spot = self.space.wall_spot(w + 2 * beside, d, 1200, front=300, window=-60)
        if spot is None and beside:
            beside = 0
        if spot is None:
            spot = self.space.wall_spot(w, d, 1200, window=-40)
        if spot is None:
            w = 900
            spot = self.space.wall_spot(w, 2000, 1200)
        if spot is not None:
            frame = spot.frame.at(beside, 0, 0)
            if beside:
                for x in (0, beside + w):
                    stand = spot.frame.at(x + 25, 0, 0)
                    pieces.nightstand(self.pen(stand), rng, 450, 400, self.home, self.style)
                # people get in beside the bed: the floor there is free again
                self._free_sides(spot.frame, w, d, beside)
            if rng.chance(65):
                self._rug(-400, d * 2 // 5, frame, w + 800, d * 4 // 5)
            pieces.bed(self.pen(frame), rng, w, d, self.home, self.style)
        self._put(pieces.wardrobe, rng.choice((1000, 1500, 2000)) if big else 1000, 600, 2200, front=600, corner=60)
        if rng.chance(60):
            self._put(pieces.dresser, rng.choice((800, 1000, 1200)), 450, 1000, front=500)
        if rng.chance(35 if big else 50):
            self._desk(1200)
        self._plants(40)
        self._floor_lamp(30)
        self._pictures(rng.between(1, 3))

    def _free_sides(self, frame: Frame, w: int, d: int, beside: int) -> None:
        floor = self.space.floor
        sides = (frame.rect(0, 450, beside, d), frame.rect(beside + w, 450, 2 * beside + w, d))
        bodies = (frame.rect(0, 0, 2 * beside + w, 450), frame.rect(beside, 0, beside + w, d))
        for side in sides:
            floor.taken &= ~floor.mask(side)
            floor.keep(side)
        floor.take(*bodies)

    def _desk(self, w: int) -> None:
        spot = self._put(pieces.desk, w, 650, 800, front=700, window=40)
        if spot is not None:
            seat = spot.frame.at(w // 2 + 250 + 20, 0, 480 + 500, 2)
            body = spot.frame.rect(w // 2 - 250, 480, w // 2 + 270, 980)
            taken = self.space.floor.taken | self.space.floor.mask(body)
            if self.space.floor.is_walkable(taken):
                self.space.floor.take(body)
                pieces.office_chair(self.pen(seat), self.rng, 500, 500, self.home, self.style)

    def _living(self) -> None:
        rng = self.rng
        big = self.room.inner.area > 15_000_000
        w, d = rng.choice((1900, 2200, 2500)) if big else rng.choice((1500, 1800)), rng.choice((850, 900))
        spot = self._put(pieces.sofa, w, d, _SOFA, front=950, margin=50)
        if spot is None:
            w, d = 1500, 850
            spot = self._put(pieces.sofa, w, d, _SOFA, front=600)
        if spot is not None:
            table_w, table_d = rng.choice((900, 1000, 1200)), rng.choice((500, 600))
            if rng.chance(80):
                self._rug(-200, d - 250, spot.frame, w + 400, 1900)
            table = spot.frame.at((w - table_w) // 2, 0, d + 350)
            body = table.rect(0, 0, table_w, table_d)
            floor = self.space.floor
            if (
                not floor.mask(body) & floor.taken
                and self._inside(body)
                and floor.is_walkable(floor.taken | floor.mask(body))
            ):
                floor.take(body)
                pieces.coffee_table(self.pen(table), rng, table_w, table_d, self.home, self.style)
            facing = ((spot.side + 2) % 4,)
            tv = rng.choice((1400, 1600, 1800))
            stand = self.space.wall_spot(tv, 420, 1250, front=500, sides=facing) or self.space.wall_spot(
                1200, 420, 1250, front=400
            )
            if stand is not None:
                width = tv if stand.side == facing[0] else 1200
                pieces.tv_stand(self.pen(stand.frame), rng, width, 420, self.home, self.style)
        for _ in range(rng.between(1, 2) if big else rng.between(0, 1)):
            self._put(pieces.sofa, 850, 850, _SOFA, front=400, corner=50)
        if rng.chance(75):
            self._put(pieces.bookshelf, rng.choice((800, 1000, 1200)), 320, 2100, front=500)
        if self.room.inner.area > 21_000_000 and rng.chance(60):
            self._table(4)
        if rng.chance(50):
            self._put(pieces.dresser, 1200, 450, 950, front=400)
        self._plants(80)
        self._plants(40)
        self._floor_lamp(75)
        self._pictures(rng.between(2, 4))

    def _inside(self, rect) -> bool:  # noqa: ANN001
        inner = self.room.inner
        return rect.x0 >= inner.x0 and rect.z0 >= inner.z0 and rect.x1 <= inner.x1 and rect.z1 <= inner.z1

    def _table(self, seats: int) -> None:
        rng = self.rng
        square = rng.chance(35) or seats <= 2
        w, d = (900, 900) if square else (rng.choice((1200, 1400, 1600)), 800)
        frame = self.space.free_spot(w + 2 * (0 if not square else 350), d + 700, 500)
        if frame is None and not square:
            square, w, d = True, 900, 900
            frame = self.space.free_spot(1600, 1600, 450)
        if frame is None:
            return
        side = 350 if square else 0
        table = frame.at(side, 0, 350)
        if rng.chance(35):
            self._rug(-150, -150, frame, w + 2 * side + 300, d + 1000)
        pieces.dining_table(self.pen(table), rng, w, d, self.home, self.style)
        wood = rng.choice((self.home.wood, self.home.dark_wood))
        places = []
        count = 1 if square else 2 if w < 1500 else 3
        for k in range(count):
            x = w * (2 * k + 1) // (2 * count)
            places += [(x, -1, 0), (x, 1, 2)]
        if square:
            places += [(-1, d // 2, 3), (1, d // 2, 1)]
        for x, _, turns in places:
            out = rng.between(190, 320, 10)
            if turns == 0:
                seat = table.at(x - 220, 0, -out)
            elif turns == 2:
                seat = table.at(x + 220, 0, d + out, 2)
            elif turns == 3:
                seat = table.at(-out, 0, d // 2 + 220, 3)
            else:
                seat = table.at(w + out, 0, d // 2 - 220, 1)
            pieces.chair(self.pen(seat), rng, 440, 440, self.home, self.style, wood)
        x, _, z = table.point(w // 2, 0, d // 2)
        drop = self.storey.height - 1750
        pieces.pendant(self.pen(Frame(x, self.storey.height, z, 0)), rng, drop, self.home)
        self._lamp(x, 1850, z)
        self._ceiling_taken = True

    def _dining(self) -> None:
        self._table(6)
        if self.rng.chance(70):
            self._put(pieces.dresser, self.rng.choice((1200, 1500)), 450, 950, front=400)
        if self.rng.chance(40):
            self._put(pieces.bookshelf, 900, 320, 2100, front=400)
        self._plants(60)
        self._pictures(self.rng.between(1, 3))

    def _kitchen(self) -> None:
        rng, inner = self.rng, self.room.inner
        longest = max(inner.width, inner.depth)
        placed = None
        for w in (3600, 3000, 2400, 1800, 1200):
            if w <= longest - 700:
                placed = self._counter(w)
                if placed is not None:
                    break
        self._put(pieces_wet.fridge, 650, 680, 1900, front=700, corner=70, window=-100)
        if placed is not None and rng.chance(65):
            for w in (1800, 1200):
                if self._counter(w, plain=True) is not None:
                    break
        self._table(2 if inner.area < 12_000_000 else 4)
        if rng.chance(25):
            self._put(pieces_wet.washer, 600, 600, 900, front=500, corner=40)
        self._plants(30)
        self._pictures(rng.between(0, 2))

    def _counter(self, w: int, plain: bool = False) -> Spot | None:
        spot = self.space.wall_spot(w, 620, 900, front=700, corner=60, window=20)
        if spot is None:
            return None
        uppers, start = [], None
        for x in range(0, w + 1, 50):
            free = x + 50 <= w and self.space.wall_is_free(spot.side, spot.start + x, spot.start + x + 50, 1400, 2200)
            if free and start is None:
                start = x
            if not free and start is not None:
                if x - start >= 400:
                    uppers.append((start, x))
                start = None
        pieces_wet.counter(self.pen(spot.frame), self.rng, w, 620, self.home, self.style, uppers, plain)
        for low, high in uppers:
            self.space.hang(spot.side, spot.start + low, spot.start + high, 1400, 2200)
        return spot

    def _bath(self) -> None:
        rng = self.rng
        w = 1700 if rng.chance(60) else 0
        tub = None
        if w:
            tub = self._put(pieces_wet.bathtub, 1700, 750, 600, corner=100)
        if tub is None or rng.chance(30):
            tub = self._put(pieces_wet.shower, 900, 900, 2060, corner=300) or tub
        self._put(pieces_wet.toilet, 420, 680, 830, front=450, margin=80)
        wide = rng.choice((600, 800, 1000))
        basin = self.space.wall_spot(wide, 480, 900, front=500)
        if basin is None:
            wide = 500
            basin = self.space.wall_spot(wide, 420, 900, front=400)
        if basin is not None:
            pieces_wet.basin(self.pen(basin.frame), rng, wide, 480 if wide > 500 else 420, self.home, self.style)
            if self.space.wall_is_free(basin.side, basin.start, basin.start + wide, 1150, 1900):
                self.space.hang(basin.side, basin.start, basin.start + wide, 1150, 1900)
                pieces_wet.mirror(self.pen(self.room.inner.frame(basin.side).at(basin.start, 1150, 0)), wide, 700)
        if rng.chance(35):
            self._put(pieces_wet.washer, 600, 600, 900, front=400, corner=40)
        if rng.chance(70):
            place = self.space.wall_place(500, 550, 900)
            if place is not None:
                frame = self.room.inner.frame(place[0]).at(place[1], 1420, 0)
                pieces_wet.towel(self.pen(frame), rng, self.style)
        if rng.chance(60):
            inner = self.room.inner
            self._rug((inner.width - 800) // 2, (inner.depth - 550) // 2, Frame(inner.x0, 0, inner.z0, 0), 800, 550)
        self._pictures(rng.between(0, 1))

    def _study(self) -> None:
        rng = self.rng
        self._desk(rng.choice((1300, 1500, 1700)))
        for _ in range(rng.between(1, 3)):
            self._put(pieces.bookshelf, rng.choice((800, 1000, 1200)), 320, 2100, front=450)
        if rng.chance(60):
            self._put(pieces.sofa, rng.choice((850, 1500)), 850, _SOFA, front=400)
        if rng.chance(60):
            inner = self.room.inner
            self._rug(inner.width // 2 - 800, inner.depth // 2 - 600, Frame(inner.x0, 0, inner.z0, 0), 1600, 1200)
        self._plants(60)
        self._floor_lamp(50)
        self._pictures(rng.between(1, 3))

    def _hall(self) -> None:
        rng, inner = self.rng, self.room.inner
        narrow = min(inner.width, inner.depth) < 1900
        if rng.chance(70):
            self._put(pieces.dresser, rng.choice((700, 900)), 280 if narrow else 400, 950)
        if not narrow:
            if rng.chance(50):
                self._put(pieces.wardrobe, 1000, 550, 2200, front=500, corner=40)
            if rng.chance(40):
                self._put(pieces.chair, 440, 440, 900)
        self._plants(40 if narrow else 60)
        if rng.chance(55):
            length, width = max(inner.width, inner.depth), min(inner.width, inner.depth)
            run, wide = min(length - 800, 2600), min(width - 500, 1400)
            frame = Frame(inner.x0, 0, inner.z0, 0)
            if inner.width >= inner.depth:
                self._rug((inner.width - run) // 2, (inner.depth - wide) // 2, frame, run, wide)
            else:
                self._rug((inner.width - wide) // 2, (inner.depth - run) // 2, frame, wide, run)
        self._pictures(rng.between(1, 4))

    def _storage(self) -> None:
        rng = self.rng
        for _ in range(rng.between(1, 3)):
            self._put(pieces_wet.shelf_rack, rng.choice((900, 1200)), 400, 2000, front=500)
        if rng.chance(60):
            self._put(pieces_wet.washer, 600, 600, 900, front=500, corner=40)


def furnish_room(
    builder: Builder, storey: Storey, space: RoomSpace, home: HomeStyle, style: RoomStyle, rng: Rng
) -> list[Lamp]:
    """Furnish a room and return its lamps."""
    furnisher = Furnisher(builder, storey, space, home, style, rng)
    furnisher.furnish()
    return furnisher.lamps
