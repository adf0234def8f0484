"""Layouts of homes on two storeys around one stair room. Lengths are millimetres.

Both storeys share an outline, a hall and the stair room behind it; all else is cut on each storey by itself. The hall
is a corridor between two bands of rooms with the stairs in one of them, or a hall in the middle of the home that ends
at the stairs. The ground floor may have a wing.
"""

from __future__ import annotations

from dataclasses import dataclass

from prnav.scene.houses.layout import AREAS, Cells, badness, programmes, root, slices, treemap
from prnav.scene.houses.plan import GRID, Stairs, snap
from prnav.scene.houses.rng import Rng
from prnav.scene.houses.shapes import Rect

_DRAWS = 40
_TRIES = 7
_ENTRY = 1100


@dataclass(frozen=True)
class _Scheme:
    """What both storeys share: the hall, the stairs (entered at low z), and what is left for rooms."""

    hall: tuple[str, Rect]
    stairs: Rect
    bands: tuple[Rect, ...]
    """Cut side by side."""
    blocks: tuple[Rect, ...]
    """Cut by area."""


def two_storeys(rng: Rng, area: int, thickness: int) -> tuple[Cells, Cells, Stairs, int]:
    """Cells of the ground floor and of the upper one, the stairs, and the height of the rooms.

    The stair room is the first cell of each storey.
    """
    # storeys are a multiple of 0.2 m apart: a navmesh's voxels lie alike on both
    steps, riser, slab = rng.choice(((8, 175, 300), (8, 175, 250), (10, 150, 300), (10, 150, 260)))
    tread, landing = rng.between(250, 280, 10), rng.between(950, 1050, GRID)
    width = rng.between(2050, 2450, GRID) + thickness
    length = _up(_ENTRY + (steps - 1) * tread + landing + thickness)
    kinds = programmes(rng, area)
    best: tuple[int, tuple[Cells, Cells]] | None = None
    for _ in range(_DRAWS):
        wing = rng.between(18, 30) if len(kinds[0]) >= 5 and rng.chance(40) else 0  # of the ground floor [percent]
        main = area * 1_000_000 // (200 + wing) * 100
        ratio = rng.between(100, 165)
        depth = max(snap(root(main * 100 // ratio)), length + 1900)
        scheme = _scheme(rng, snap(main // depth), depth, width, length)
        if scheme is None:
            continue
        extra = [_wing(rng, snap(main // depth), main * wing // 100)] if wing else []
        total, storeys = 0, []
        for names, more in ((kinds[0], extra), (kinds[1], [])):
            size = (main + sum(rect.area for rect in more)) // 1_000_000
            options = (_fill(rng, names, scheme, more) for _ in range(_TRIES))
            value, cells = min(((badness(cells, size), cells) for cells in options), key=lambda pair: pair[0])
            total += value
            storeys.append(cells)
        if best is None or total < best[0]:
            best = total, (storeys[0], storeys[1])
    assert best is not None, f"no outline of {area} m2 holds stairs of {width} x {length} mm"
    placed, entry = _place(rng, best[1])
    stairs = Stairs(placed[0][0][1], entry, steps, riser, tread, landing, rng.chance(50))
    return placed[0], placed[1], stairs, stairs.rise - slab


def _up(value: int) -> int:
    return -(-value // GRID) * GRID


def _scheme(rng: Rng, length: int, depth: int, width: int, stairs: int) -> _Scheme | None:
    corridor = rng.between(1200, 1600, GRID)
    band = max(stairs, snap((depth - corridor) * rng.between(44, 56) // 100))
    other = depth - corridor - band
    if other >= 2700 and band <= stairs + 2500 and rng.chance(75):
        x = snap((length - width) * rng.between(0, 100) // 100)
        x = 0 if x < 2500 else length - width if length - width - x < 2500 else x
        sides = [Rect(0, other + corridor, x, depth), Rect(x + width, other + corridor, length, depth)]
        bands = (Rect(0, 0, length, other), *(rect for rect in sides if rect.width > 0))
        return _Scheme(
            ("corridor", Rect(0, other, length, other + corridor)),
            Rect(x, other + corridor, x + width, depth),
            bands,
            (),
        )
    hall = depth - stairs
    if not 1900 <= hall <= 5500 or length < width + 5000:
        return None
    x = snap((length - width) * rng.between(36, 64) // 100)
    blocks = (Rect(0, 0, x, depth), Rect(x + width, 0, length, depth))
    return _Scheme(("hall", Rect(x, 0, x + width, hall)), Rect(x, hall, x + width, depth), (), blocks)


def _wing(rng: Rng, length: int, area: int) -> Rect:
    width = min(length, snap(max(3000, root(area * rng.between(60, 150) // 100))))
    depth = max(2800, snap(area // width))
    x = 0 if rng.chance(50) else length - width
    return Rect(x, -depth, x + width, 0)


def _fill(rng: Rng, kinds: list[str], scheme: _Scheme, extra: list[Rect]) -> Cells:
    """Spread kinds over the free regions by area, and cut these."""
    regions = [*scheme.bands, *scheme.blocks, *extra]
    names: list[list[str]] = [[] for _ in regions]
    wanted = sum(AREAS[kind] for kind in kinds)
    share = [rect.area * wanted // sum(r.area for r in regions) for rect in regions]
    load = [0] * len(regions)
    for kind in sorted(rng.shuffled(kinds), key=lambda kind: -AREAS[kind] * rng.between(80, 120)):
        k = max(range(len(regions)), key=lambda k: share[k] - load[k])
        names[k].append(kind)
        load[k] += AREAS[kind]
    for k in range(len(regions)):
        if not names[k]:
            donor = max(range(len(regions)), key=lambda k: len(names[k]))
            names[k].append(names[donor].pop() if len(names[donor]) > 1 else "storage")
    cells: Cells = [("stairs", scheme.stairs), scheme.hall]
    for k, rect in enumerate(regions):
        cut = slices if k < len(scheme.bands) and rect.depth < 6500 else treemap
        cells += cut(rng, rng.shuffled(names[k]), rect)
    return cells


def _place(rng: Rng, storeys: tuple[Cells, Cells]) -> tuple[tuple[Cells, Cells], int]:
    """The storeys mirrored, turned and centred on the origin, and the side at which the stairs are entered."""
    flip_x, flip_z, swap = rng.chance(50), rng.chance(50), rng.chance(50)

    def move(c: Rect) -> Rect:
        c = Rect(-c.x1, c.z0, -c.x0, c.z1) if flip_x else c
        c = Rect(c.x0, -c.z1, c.x1, -c.z0) if flip_z else c
        return Rect(c.z0, c.x0, c.z1, c.x1) if swap else c

    moved = [[(kind, move(cell)) for kind, cell in cells] for cells in storeys]
    every = [cell for cells in moved for _, cell in cells]
    x = snap((min(c.x0 for c in every) + max(c.x1 for c in every)) // 2)
    z = snap((min(c.z0 for c in every) + max(c.z1 for c in every)) // 2)
    ground, upper = ([(kind, Rect(c.x0 - x, c.z0 - z, c.x1 - x, c.z1 - z)) for kind, c in cells] for cells in moved)
    entry = (1 if flip_z else 3) if swap else (2 if flip_z else 0)
    return (ground, upper), entry
