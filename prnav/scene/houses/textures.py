"""Procedural textures in integer arithmetic, so that every machine draws the same bytes.

A texture is named ``kind`` or ``kind:variant``; variants differ in seed and, where they carry colours of their own
(pictures, rugs, window views, books), in those. All others are pale and take their colour from the material.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.scene.houses.rng import Rng

Image = Array


def draw_texture(name: str, seed: int) -> NDArray[np.uint8]:
    """The texture of this name, shape (H, W, 3) uint8, top row first."""
    kind, _, variant = name.partition(":")
    rng = Rng(seed).fork(name)
    image = _KINDS[kind](rng, int(variant or 0))
    if image.ndim == 2:
        image = np.repeat(image[..., None], 3, axis=2)
    return np.clip(image, 0, 255).astype(np.uint8)


def _hash(x: Image, y: Image, seed: int) -> Image:
    """Uniform 0..255 per lattice point."""
    h = (x.astype(np.uint64) * np.uint64(0x9E3779B1) + y.astype(np.uint64) * np.uint64(0x85EBCA77)) & np.uint64(
        0xFFFFFFFF
    )
    h = (h + np.uint64(seed & 0xFFFFFFFF)) & np.uint64(0xFFFFFFFF)
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        h ^= h >> np.uint64(shift)
        h = (h * np.uint64(factor)) & np.uint64(0xFFFFFFFF)
    h ^= h >> np.uint64(16)
    return (h & np.uint64(255)).astype(np.int64)


def _grid(width: int, height: int) -> tuple[Image, Image]:
    y, x = np.mgrid[0:height, 0:width]
    return x.astype(np.int64), y.astype(np.int64)


def _noise(width: int, height: int, cell_x: int, cell_y: int, seed: int) -> Image:
    """Smooth value noise 0..255 that repeats with the image; cells divide the size."""
    x, y = _grid(width, height)
    cx, cy, nx, ny = x // cell_x, y // cell_y, width // cell_x, height // cell_y
    fx, fy = (x % cell_x) * 256 // cell_x, (y % cell_y) * 256 // cell_y
    fx, fy = fx * fx * (768 - 2 * fx) // 65536, fy * fy * (768 - 2 * fy) // 65536
    a, b = _hash(cx % nx, cy % ny, seed), _hash((cx + 1) % nx, cy % ny, seed)
    c, d = _hash(cx % nx, (cy + 1) % ny, seed), _hash((cx + 1) % nx, (cy + 1) % ny, seed)
    return ((a * (256 - fx) + b * fx) * (256 - fy) + (c * (256 - fx) + d * fx) * fy) // 65536


def _speckle(width: int, height: int, seed: int) -> Image:
    x, y = _grid(width, height)
    return _hash(x, y, seed)


def _mix(a: tuple[int, int, int], b: tuple[int, int, int], weight: Image) -> Image:
    """Colours between two, weight 0..256 of the second."""
    return (np.array(a) * (256 - weight[..., None]) + np.array(b) * weight[..., None]) // 256


_PAINTS = (
    (176, 62, 54), (204, 118, 70), (222, 176, 84), (132, 146, 84), (74, 118, 96), (70, 132, 146), (64, 92, 140),
    (116, 96, 146), (176, 112, 134), (224, 212, 190), (244, 240, 228), (150, 136, 120), (98, 84, 74), (62, 66, 76),
    (38, 40, 48), (168, 190, 200),
)  # fmt: skip


def _hue(rng: Rng) -> tuple[int, int, int]:
    """One of a painter's colours, slightly varied."""
    r, g, b = rng.choice(_PAINTS)
    return r + rng.between(-14, 10), g + rng.between(-14, 10), b + rng.between(-14, 10)


def _plaster(rng: Rng, variant: int) -> Image:
    """Painted plaster; from variant 8 on a smoother one."""
    seed, depth = rng.below(1 << 31), 6 if variant >= 8 else 14
    return 246 - _noise(64, 64, 16, 16, seed) * depth // 255 - _noise(64, 64, 4, 4, seed + 1) * depth // 400


def _stripes(rng: Rng, variant: int) -> Image:
    x, _ = _grid(64, 64)
    period = rng.choice((8, 16, 32))
    image = np.where(x % period < period // 2, 246, rng.between(198, 222))
    return image - _speckle(64, 64, rng.below(1 << 31)) // 40


def _damask(rng: Rng, variant: int) -> Image:
    x, y = _grid(64, 64)
    period = rng.choice((16, 32))
    dx, dy = x % period - period // 2, (y + (x // period % 2) * (period // 2)) % period - period // 2
    shape = rng.below(3)
    reach = (
        np.abs(dx) + np.abs(dy)
        if shape == 0
        else (dx * dx + dy * dy) * 3 // period
        if shape == 1
        else np.maximum(np.abs(dx), np.abs(dy)) * 2
    )
    mark = (reach * 4 // period) % 3 == 0
    return np.where(mark, rng.between(190, 218), 245) - _speckle(64, 64, rng.below(1 << 31)) // 50


def _boards(rng: Rng, variant: int) -> Image:
    x, _ = _grid(64, 64)
    grain = _noise(64, 64, 4, 32, rng.below(1 << 31)) * 18 // 255
    return np.where(x % 16 == 0, 170, np.where(x % 16 == 1, 225, 236)) + grain - 10


def _brick(rng: Rng, variant: int) -> Image:
    x, y = _grid(64, 64)
    row = y // 8
    column = (x + (row % 2) * 8) % 64
    tone = _hash(column // 16, row, rng.below(1 << 31)) * 60 // 255 + 165
    tone = tone + _speckle(64, 64, 7) // 12
    return np.where((y % 8 == 0) | (column % 16 == 0), 225, tone)


def _planks(rng: Rng, variant: int) -> Image:
    """Floor boards along v."""
    width, height, board = 128, 128, rng.choice((16, 32))
    x, y = _grid(width, height)
    column = x // board
    shift = _hash(column, column * 0, rng.below(1 << 31)) // 2
    piece = ((y + shift) % height) // (height // 2)
    tone = _hash(column, piece, rng.below(1 << 31)) * rng.between(30, 60) // 255
    grain = _noise(width, height, 4, 64, rng.below(1 << 31)) * 26 // 255 + _noise(width, height, 2, 16, 5) * 12 // 255
    seam = (x % board == 0) | ((y + shift) % (height // 2) == 0)
    return np.where(seam, 130, 172 + tone + grain)


def _parquet(rng: Rng, variant: int) -> Image:
    x, y = _grid(128, 128)
    block = 32
    across = (x // block + y // block) % 2 == 0
    u, v = np.where(across, x, y), np.where(across, y, x)
    strip = v % block // 8
    tone = _hash(x // block * 4 + strip, y // block, rng.below(1 << 31)) * 50 // 255
    grain = _hash(u // 6, v, rng.below(1 << 31)) * 22 // 255
    return np.where((v % 8 == 0) | (u % block == 0), 140, 178 + tone + grain)


def _tiles(rng: Rng, variant: int) -> Image:
    """Plain tiles with grout; every fourth variant is a chequerboard."""
    size = rng.choice((16, 32))
    x, y = _grid(64, 64)
    tone = _hash(x // size, y // size, rng.below(1 << 31)) * 14 // 255 + 232
    if variant % 4 == 3:
        tone = np.where((x // size + y // size) % 2 == 0, tone, rng.between(90, 150))
    veins = _noise(64, 64, 8, 8, rng.below(1 << 31)) * 12 // 255
    return np.where((x % size == 0) | (y % size == 0), 165, tone - veins)


def _carpet(rng: Rng, variant: int) -> Image:
    seed = rng.below(1 << 31)
    return 205 + _speckle(64, 64, seed) * 34 // 255 + _noise(64, 64, 16, 16, seed + 1) * 16 // 255


def _wood(rng: Rng, variant: int) -> Image:
    """Furniture wood, grain along v."""
    seed = rng.below(1 << 31)
    bend = _noise(64, 64, 16, 32, seed) // 12
    x, y = _grid(64, 64)
    rings = _hash((x + bend) % 64 // 2, y * 0, seed + 1) * 34 // 255
    return 196 + rings + _noise(64, 64, 2, 16, seed + 2) * 20 // 255


def _fabric(rng: Rng, variant: int) -> Image:
    x, y = _grid(64, 64)
    weave = np.where((x // 2 + y // 2) % 2 == 0, 232, 214)
    return weave + _speckle(64, 64, rng.below(1 << 31)) * 16 // 255


def _blanket(rng: Rng, variant: int) -> Image:
    """Bed covers: stripes, checks or dots over a pale ground."""
    x, y = _grid(64, 64)
    style, period = rng.below(4), rng.choice((16, 32))
    if style == 0:
        mark = y % period < period // 4
    elif style == 1:
        mark = (x % period < period // 3) ^ (y % period < period // 3)
    elif style == 2:
        dx, dy = x % period - period // 2, y % period - period // 2
        mark = dx * dx + dy * dy < period * period // 16
    else:
        mark = (x + y) % period < period // 4
    return np.where(mark, rng.between(120, 190), 236) - _speckle(64, 64, rng.below(1 << 31)) // 20


def _marble(rng: Rng, variant: int) -> Image:
    seed = rng.below(1 << 31)
    field = _noise(64, 64, 16, 16, seed) + _noise(64, 64, 8, 8, seed + 1) // 2
    return 235 - np.maximum(0, 30 - np.abs(field % 96 - 48)) * 2 + _speckle(64, 64, seed) // 25


def _metal(rng: Rng, variant: int) -> Image:
    return 215 + _noise(64, 64, 64, 2, rng.below(1 << 31)) * 26 // 255


def _door(rng: Rng, variant: int) -> Image:
    """A door leaf with panels, fitted."""
    x, y = _grid(64, 128)
    image = 222 + _noise(64, 128, 4, 64, rng.below(1 << 31)) * 18 // 255
    rows = rng.choice((((10, 58), (70, 118)), ((10, 36), (46, 82), (92, 118)), ((10, 118),)))
    for top, bottom in rows:
        for left, right in ((10, 29), (35, 54)) if rng.chance(60) else ((10, 54),):
            inside = (x >= left) & (x < right) & (y >= top) & (y < bottom)
            rim = inside & ((x < left + 2) | (y < top + 2))
            light = inside & ((x >= right - 2) | (y >= bottom - 2))
            image = np.where(rim, 150, np.where(light, 250, np.where(inside, image - 12, image)))
    return image


def _picture(rng: Rng, variant: int) -> Image:
    """A painting, fitted: blocks, a landscape, circles or stripes, in a passe-partout."""
    size = 64
    x, y = _grid(size, size)
    image = np.broadcast_to(np.array(_hue(rng)), (size, size, 3)).copy()
    style = variant % 4
    if style == 0:
        for _ in range(rng.between(5, 9)):
            x0, y0 = rng.below(50), rng.below(50)
            mark = (x >= x0) & (x < x0 + rng.between(8, 36)) & (y >= y0) & (y < y0 + rng.between(8, 36))
            image[mark] = _hue(rng)
    elif style == 1:
        image = _mix((rng.between(90, 170), 150, 220), (250, 215, rng.between(140, 220)), y * 4)
        for k in range(4):
            ridge = 26 + 9 * k + _noise(size, size, rng.choice((8, 16, 32)), size, rng.below(1 << 31)) // 24
            tone = _hue(rng)
            image[y > ridge] = (tone[0] // (k + 1) + 20, tone[1], tone[2] // (k + 1) + 20)
    elif style == 2:
        for _ in range(rng.between(4, 8)):
            dx, dy, radius = x - rng.below(size), y - rng.below(size), rng.between(5, 20)
            image[dx * dx + dy * dy < radius * radius] = _hue(rng)
    else:
        palette = np.array([_hue(rng) for _ in range(5)])
        angle = rng.below(3)
        field = (x, y, x + y)[angle] + _noise(size, size, 16, 16, rng.below(1 << 31)) // rng.between(10, 40)
        image = palette[(field // rng.between(5, 10)) % 5]
    image = image + (_speckle(size, size, rng.below(1 << 31)) // 16)[..., None] - 8
    margin = rng.choice((0, 5, 8))
    image[(x < margin) | (x >= size - margin) | (y < margin) | (y >= size - margin)] = (236, 232, 222)
    return image


def _rug(rng: Rng, variant: int) -> Image:
    """A rug, fitted: borders around stripes, lozenges or a plain field."""
    size = 96
    x, y = _grid(size, size)
    ground, mark, third = _hue(rng), _hue(rng), _hue(rng)
    image = np.broadcast_to(np.array(ground), (size, size, 3)).copy()
    style = variant % 4
    if style == 0:
        image[(y // rng.choice((4, 6, 8))) % 2 == 0] = mark
    elif style == 1:
        lozenge = (np.abs(x % 32 - 16) + np.abs(y % 32 - 16)) // 5 % 3
        image[lozenge == 0], image[lozenge == 1] = mark, third
    elif style == 2:
        dx, dy = x - 48, y - 48
        ring = (dx * dx + dy * dy) // 300 % 3
        image[ring == 0], image[ring == 1] = mark, third
    edge = np.minimum(np.minimum(x, size - 1 - x), np.minimum(y, size - 1 - y))
    image[(edge >= 3) & (edge < 8)] = mark
    image[edge < 3] = third
    return image + (_speckle(size, size, rng.below(1 << 31)) // 10)[..., None] - 12


def _view(rng: Rng, variant: int) -> Image:
    """What one sees through a window, fitted: sky above trees, hills or houses."""
    size = 64
    x, y = _grid(size, size)
    low = (rng.between(215, 250), rng.between(225, 245), 250)
    image = _mix((rng.between(130, 180), rng.between(180, 210), 250), low, np.minimum(256, y * 6))
    cloud = _noise(size, size, 16, 8, rng.below(1 << 31))
    image = np.where((cloud > 165)[..., None], 250, image)
    green = (rng.between(70, 120), rng.between(120, 160), rng.between(60, 90))
    skyline = 40 - _noise(size, size, 8, size, rng.below(1 << 31)) // 20
    if variant % 2:
        for _ in range(6):
            x0, top, tone = rng.below(size), rng.between(22, 40), rng.between(140, 205)
            wall = (x >= x0) & (x < x0 + rng.between(8, 16)) & (y >= top)
            image[wall] = (tone + 20, tone, tone - rng.below(30))
            image[wall & (x % 4 < 2) & (y % 6 < 3) & (y > top + 2)] = (90, 110, 130)
        skyline = skyline + 10
    tree = y > skyline
    image[tree] = green
    image[tree & (_speckle(size, size, 3) > 150)] = tuple(c + 22 for c in green)
    image[y > 54] = tuple(c + 40 for c in green)
    return image


def _screen(rng: Rng, variant: int) -> Image:
    x, y = _grid(64, 64)
    sheen = np.maximum(0, 40 - np.abs(x + y - 60)) // 2
    return np.stack([18 + sheen, 20 + sheen, 26 + sheen], axis=-1)


def _mirror(rng: Rng, variant: int) -> Image:
    x, y = _grid(64, 64)
    sheen = np.maximum(0, 60 - np.abs((x + y) % 90 - 40) * 3) // 2
    return np.stack([176 + sheen + y // 4, 192 + sheen + y // 5, 202 + sheen + y // 6], axis=-1)


def _books(rng: Rng, variant: int) -> Image:
    """A row of spines, fitted."""
    width, height = 128, 32
    image = np.broadcast_to(np.array((34, 28, 24)), (height, width, 3)).copy()
    x = 0
    while x < width - 2:
        thick = rng.between(4, 11)
        top = rng.between(1, 12)
        if rng.chance(90):
            tone = _hue(rng)
            image[top:, x : x + thick - 1] = tone
            band = rng.between(top + 2, 24)
            image[band : band + 3, x : x + thick - 1] = tuple(min(255, c + 60) for c in tone)
        x += thick
    return image


def _leaves(rng: Rng, variant: int) -> Image:
    tone = _noise(64, 64, 8, 8, rng.below(1 << 31))
    image = _mix((30, 80, 28), (110, 170, 70), tone)
    return image - (_speckle(64, 64, rng.below(1 << 31)) // 6)[..., None]


_KINDS: dict[str, Callable[[Rng, int], Image]] = {
    "plaster": _plaster, "stripes": _stripes, "damask": _damask, "boards": _boards, "brick": _brick,
    "planks": _planks, "parquet": _parquet, "tiles": _tiles, "carpet": _carpet, "wood": _wood, "fabric": _fabric,
    "blanket": _blanket, "marble": _marble, "metal": _metal, "door": _door, "picture": _picture, "rug": _rug,
    "view": _view, "screen": _screen, "books": _books, "leaves": _leaves,
    "mirror": _mirror,
}  # fmt: skip

TEXTURE_KINDS = tuple(_KINDS)
"""Names of all kinds of textures."""
