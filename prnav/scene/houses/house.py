"""From a seed to a furnished home."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from prnav.scene.atlas import TextureAtlas
from prnav.scene.houses.builder import Builder
from prnav.scene.houses.config import HouseConfig
from prnav.scene.houses.furnish import furnish_room
from prnav.scene.houses.light import Lamp, RoomLight, bake
from prnav.scene.houses.occupancy import CELL
from prnav.scene.houses.placement import RoomSpace
from prnav.scene.houses.plan import Room, Storey
from prnav.scene.houses.planner import make_plan
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import SIDES
from prnav.scene.houses.shell import build_shell
from prnav.scene.houses.style import home_style, room_style
from prnav.scene.houses.textures import draw_texture
from prnav.scene.mesh import SceneMesh


@dataclass(frozen=True)
class HouseFacts:
    """What the plan of a home says about it.

    Attributes:
        storeys: 1 or 2.
        rooms: number of rooms, the stair room not counted.
        floor_area: inside the outer walls, all storeys together [m2].
        closed_doors: the kinds of the rooms on both sides, by door.
        shut_off: kinds of the rooms that no open door leads to.
    """

    storeys: int
    rooms: int
    floor_area: float
    closed_doors: tuple[tuple[str, str], ...]
    shut_off: tuple[str, ...]


def plan_house(seed: int, config: HouseConfig = HouseConfig()) -> tuple[Storey, ...]:  # noqa: B008
    """The plan of a home, storey by storey from the ground up."""
    return make_plan(Rng(seed).fork("plan"), config)


def describe_house(seed: int, config: HouseConfig = HouseConfig()) -> HouseFacts:  # noqa: B008
    """Facts about a home, from its plan alone."""
    storeys = plan_house(seed, config)
    rooms = [room for storey in storeys for room in storey.rooms]
    closed: list[tuple[str, str]] = []
    shut: list[str] = []
    for storey in storeys:
        for opening in storey.openings:
            if opening.leaf == "closed":
                first, second = (storey.rooms[index].kind for index in opening.rooms)
                closed.append((first, second))
        reached, edge = {0}, [0]
        while edge:
            here = edge.pop()
            for opening in storey.openings:
                if here in opening.rooms and min(opening.rooms) >= 0 and opening.leaf != "closed":
                    other = sum(opening.rooms) - here
                    edge += [other] if other not in reached else []
                    reached.add(other)
        assert 2 * len(reached) > len(storey.rooms), "room 0 is not shut off"
        shut += [room.kind for room in storey.rooms if room.index not in reached]
    area = sum(room.cell.area for room in rooms) // 10_000 / 100
    count = sum(room.kind != "stairs" for room in rooms)
    return HouseFacts(len(storeys), count, area, tuple(closed), tuple(shut))


def generate_house(seed: int, config: HouseConfig = HouseConfig(), name: str | None = None) -> SceneMesh:  # noqa: B008
    """A furnished home, the same bytes for the same seed and config on every machine.

    The ground floor is at y = 0; ceilings and the outside leave no walkable surface outside the rooms. A body of radius
    0.1 m can reach every room from every other, except those that :func:`describe_house` says are shut off.
    """
    builder, lights = _draw(seed, config)
    geometry = builder.finish()
    images = [draw_texture(texture, seed) for texture in geometry.textures[1:]]
    return SceneMesh(
        name=name or f"house-{seed}",
        vertices=(geometry.positions / 1000.0).astype(np.float32),
        uvs=geometry.uvs.astype(np.float32),
        colors=bake(geometry, lights),
        faces=geometry.faces,
        face_texture=geometry.face_texture,
        atlas=TextureAtlas.from_images(images),
    )


def count_furniture(seed: int, config: HouseConfig = HouseConfig()) -> dict[str, int]:  # noqa: B008
    """Number of pieces of furniture in a home by kind; what hangs on walls and lies on tables is not counted."""
    return dict(sorted(_draw(seed, config)[0].placed.items()))


def _draw(seed: int, config: HouseConfig) -> tuple[Builder, list[RoomLight]]:
    """All surfaces of a home, and its light."""
    rng = Rng(seed)
    storeys = plan_house(seed, config)
    builder = Builder()
    home = home_style(rng.fork("style"))
    lights: list[RoomLight] = []
    for storey in storeys:
        floor = rng.fork("floor")
        styles = [
            room_style(rng.fork(_name(storey, room)), room.kind, floor.fork(f"level {storey.level}"))
            for room in storey.rooms
        ]
        build_shell(builder, storey, home, styles)
        for room, style in zip(storey.rooms, styles, strict=True):
            chance = rng.fork(f"furniture {storey.first_light + room.index}")
            space = RoomSpace(room, storey, chance.fork("places"))
            lamps = furnish_room(builder, storey, space, home, style, chance) if config.furniture else []
            cover = space.floor.cover()
            lamps = [*lamps, *_window_light(storey, room)]
            light = RoomLight(room.inner, storey.level, storey.height, tuple(lamps), cover, CELL)
            lights.append(light)
            if storey.light(room) < storey.first_light:  # the stair room goes up to this storey's ceiling
                below = lights[storey.light(room)]
                joined = replace(below, height=storey.level + storey.height, lamps=below.lamps + light.lamps)
                lights[storey.light(room)] = joined
    return builder, lights


def _name(storey: Storey, room: Room) -> str:
    """What a room's materials are drawn by: the stair room has the same on both storeys."""
    return "stairs" if room.kind == "stairs" else f"room {storey.first_light + room.index}"


def _window_light(storey: Storey, room: Room) -> list[Lamp]:
    lamps = []
    for side in SIDES:
        frame = room.inner.frame(side)
        for opening, low, high in storey.openings_of(room, side):
            if opening.kind == "window":
                middle = frame.at((low + high) // 2, (opening.bottom + opening.top) // 2 + storey.level, 0)
                ahead = middle.point(0, 0, 1)
                direction = (ahead[0] - middle.x, 0, ahead[2] - middle.z)
                area = (high - low) * (opening.top - opening.bottom)
                lamps.append(Lamp((middle.x, middle.y, middle.z), direction, 2.2 * area))
    return lamps
