"""Palettes: which materials a home and its rooms are made of."""

from __future__ import annotations

from dataclasses import dataclass

from prnav.scene.houses.builder import Color, Material
from prnav.scene.houses.rng import Rng

_WOODS: tuple[Color, ...] = (
    (222, 184, 135), (196, 148, 96), (160, 108, 66), (124, 80, 50), (92, 60, 42), (232, 208, 170), (176, 128, 92),
    (140, 116, 96),
)  # fmt: skip
_TRIMS: tuple[Color, ...] = (
    (245, 244, 240),
    (245, 244, 240),
    (236, 228, 210),
    (150, 104, 66),
    (96, 66, 48),
    (200, 204, 204),
)
_ACCENTS: tuple[Color, ...] = (
    (178, 58, 52), (52, 92, 140), (62, 120, 92), (214, 164, 60), (126, 76, 128), (220, 120, 70), (70, 140, 150),
    (92, 96, 104), (188, 176, 156), (48, 60, 88), (200, 130, 140), (120, 132, 70), (230, 224, 210), (60, 56, 54),
)  # fmt: skip
_WALLS: tuple[Color, ...] = (
    (250, 248, 242), (244, 236, 220), (232, 238, 240), (226, 234, 220), (240, 224, 204), (214, 226, 236),
    (236, 216, 214), (238, 230, 180), (196, 210, 200), (206, 198, 188), (176, 196, 208), (222, 190, 160),
    (168, 186, 160), (212, 170, 150), (150, 170, 186),
)  # fmt: skip
_TILES: tuple[Color, ...] = (
    (250, 250, 248), (226, 226, 222), (206, 216, 222), (196, 220, 214), (232, 214, 190), (180, 176, 170),
    (150, 190, 196), (120, 120, 124), (216, 180, 160),
)  # fmt: skip
_CARPETS: tuple[Color, ...] = (
    (206, 194, 172), (160, 160, 166), (132, 120, 112), (120, 140, 168), (168, 110, 100), (140, 156, 128),
    (190, 170, 190),
)  # fmt: skip

METAL = Material("metal", (196, 200, 206), 500)
CERAMIC = Material("", (250, 250, 250))
BLACK = Material("", (34, 34, 38))
WHITE = Material("", (248, 247, 244))


@dataclass(frozen=True)
class RoomStyle:
    """Materials of one room.

    Attributes:
        floor: of the floor.
        wall: of the walls, above ``panel_height`` where there is a panel.
        panel: of the walls' lower part, or None.
        panel_height: where the panel ends [mm].
        skirting: whether there is one.
        accent: fabric of cushions, chairs and covers.
    """

    floor: Material
    wall: Material
    panel: Material | None
    panel_height: int
    skirting: bool
    accent: Material


@dataclass(frozen=True)
class HomeStyle:
    """Materials shared by a whole home."""

    trim: Material
    door: Material
    ceiling: Material
    wood: Material
    dark_wood: Material
    fabric: Material
    front: Material
    counter: Material
    facade: Material
    curtain: Material
    cornice: bool


def home_style(rng: Rng) -> HomeStyle:
    """Draw a home's materials."""
    trim = rng.choice(_TRIMS)
    wood = rng.choice(_WOODS)
    dark = rng.choice(tuple(w for w in _WOODS if w != wood))
    front = rng.choice((*_ACCENTS[:7], *_TILES[:4], wood, dark, (240, 238, 232)))
    white = rng.chance(55)
    return HomeStyle(
        trim=Material("", trim),
        door=Material("door", (244, 242, 236) if white else rng.choice(_WOODS), 0),
        ceiling=Material("plaster:9", (252, 251, 248), 1500),
        wood=Material("wood:0", wood, 600),
        dark_wood=Material("wood:1", dark, 600),
        fabric=Material("fabric:0", rng.choice(_ACCENTS), 300),
        front=Material("wood:0", wood, 600) if rng.chance(30) else Material("", front),
        counter=Material("marble", rng.choice(_TILES), 900) if rng.chance(60) else Material("wood:1", dark, 600),
        facade=Material("brick", (214, 150, 120), 1200)
        if rng.chance(40)
        else Material("plaster:9", rng.choice(_WALLS)),
        curtain=Material("fabric:0", rng.choice(((240, 236, 224), (226, 222, 214), (206, 196, 176))), 300),
        cornice=rng.chance(55),
    )


def room_style(rng: Rng, kind: str, home: Rng) -> RoomStyle:
    """Draw a room's materials; ``home`` is a generator in the same state for every room of a home."""
    main_floor = _floor(home)
    variant = rng.below(4)
    color = rng.choice(_WALLS)
    panel, height = None, 0
    if kind == "bath":
        floor = Material(f"tiles:{rng.below(4)}", rng.choice(_TILES), 800)
        panel = Material(f"tiles:{rng.below(3)}", rng.choice(_TILES), rng.choice((600, 800)))
        height = rng.choice((1200, 1500, 2000))
        wall = Material("plaster:0", color)
    elif kind in ("kitchen", "storage"):
        floor = Material(f"tiles:{rng.below(4)}", rng.choice(_TILES), rng.choice((800, 1200)))
        floor = main_floor if rng.chance(35) else floor
        wall = Material("plaster:0", color)
    else:
        floor = main_floor
        if kind == "bedroom" and rng.chance(55):
            floor = Material(f"carpet:{rng.below(2)}", rng.choice(_CARPETS), 400)
        paper = rng.weighted((("plaster:0", 55), (f"stripes:{variant}", 18), (f"damask:{variant}", 20), ("brick", 7)))
        scale = {"plaster": 1000, "stripes": 800, "damask": 700, "brick": 900}[paper.partition(":")[0]]
        wall = Material(paper, (220, 150, 124) if paper == "brick" else color, scale)
        if kind in ("living", "dining", "hall", "study") and rng.chance(22):
            panel = Material("boards", rng.choice((_TRIMS[0], _TRIMS[2], rng.choice(_WALLS))), 900)
            height = rng.choice((900, 1000, 1100))
    accent = Material(f"fabric:{rng.below(2)}", rng.choice(_ACCENTS), 300)
    return RoomStyle(floor, wall, panel, height, kind != "bath", accent)


def _floor(rng: Rng) -> Material:
    kind = rng.weighted((("planks:0", 55), ("parquet", 25), ("tiles:1", 12), ("carpet:2", 8)))
    if kind == "tiles:1":
        return Material(kind, rng.choice(_TILES), 1200)
    if kind == "carpet:2":
        return Material(kind, rng.choice(_CARPETS), 400)
    return Material(kind, rng.choice(_WOODS), 1300 if kind == "planks:0" else 900)
