"""From a seed to a furnished home."""

from __future__ import annotations

from dataclasses import replace

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


def generate_house(seed: int, config: HouseConfig = HouseConfig(), name: str | None = None) -> SceneMesh:  # noqa: B008
    """A furnished home, the same bytes for the same seed and config on every machine.

    The floor is at y = 0, the ceiling's upper side and furniture near it leave no walkable surface outside the rooms.
    Every room can be reached from every other by a body of radius 0.1 m.
    """
    rng = Rng(seed)
    storeys = make_plan(rng.fork("plan"), config)
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
