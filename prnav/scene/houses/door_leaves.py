"""Leaves of inner doors: open, half open and closed."""

from __future__ import annotations

from prnav.scene.houses.builder import Pen, Point
from prnav.scene.houses.style import METAL, HomeStyle

_THICK = 40


def flat(pen: Pen, plan: tuple[int, int, int, int], h: int, at_low: bool, home: HomeStyle) -> None:
    """A door that stands open along a wall or across it.

    ``plan`` is its x0, z0, x1, z1 in the wall's frame; it is hinged at its end next to the opening.
    """
    x0, z0, x1, z1 = plan
    leaf = home.door
    if x1 - x0 > z1 - z0:  # flat against the wall
        pen.box(x0, 10, z0, x1, h, z1, leaf)
        far = x0 + 60 if at_low else x1 - 80
        pen.box(far, 1000, z1, far + 20, 1020, z1 + 45, METAL, skip="B")
        pen.box(far, 1000, z1 + 25, far + (110 if at_low else 20), 1020, z1 + 45, METAL)
        return
    pen.box(x0, 10, z0, x1, h, z1, leaf)
    pen.box(x0 - 45, 1000, z1 - 80, x1 + 45, 1020, z1 - 60, METAL)
    for x in (x0 - 45, x1 + 25):
        pen.box(x, 1000, z1 - 170, x + 20, 1020, z1 - 80, METAL)


def closed(pen: Pen, width: int, h: int, home: HomeStyle) -> None:
    """A closed door between the jambs; the frame's origin is its lower left corner, at the leaf's front."""
    pen.box(0, 0, -_THICK, width, h, 0, home.door, skip="LRU")
    for z in (0, -_THICK - 45):
        pen.box(width - 110, 1000, z, width - 90, 1020, z + 45, METAL, skip="")
        lever = 25 if z == 0 else 0
        pen.box(width - 190, 1000, z + lever, width - 90, 1020, z + lever + 20, METAL)


def turned(pen: Pen, width: int, h: int, angle: tuple[int, int], at_low: bool, home: HomeStyle) -> None:
    """A door half open; the frame's origin is its hinge, ``angle`` 1000 times cosine and sine from the wall.

    ``at_low`` says that the leaf points to the right of its hinge.
    """
    along = angle if at_low else (-angle[0], angle[1])
    across = (-along[1], along[0]) if at_low else (along[1], -along[0])

    def at(share: int, side: int, y: int) -> Point:
        x, z = along[0] * share + across[0] * side, along[1] * share + across[1] * side
        return x // 1000, y, z // 1000

    def face(first: Point, second: Point, size: int) -> None:
        low, high = (first, second) if at_low else (second, first)
        pen.quad([low, high, (high[0], h, high[2]), (low[0], h, low[2])], home.door, (size, h))

    near, far = (at(0, 0, 10), at(width, 0, 10)), (at(0, _THICK, 10), at(width, _THICK, 10))
    face(near[1], near[0], width)
    face(far[0], far[1], width)
    face(far[1], near[1], _THICK)
    for side in (-30, _THICK + 30):
        x, _, z = at(width - 80, side, 0)
        pen.box(x - 25, 1000, z - 25, x + 25, 1025, z + 25, METAL)
