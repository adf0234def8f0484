"""Tiles joined along their borders.

Detour links two border edges of neighbouring tiles where they overlap by more than a centimetre and their heights
there differ by at most twice the climb. Each overlap becomes an edge that both polygons have: edges are split at the
ends of the overlaps, and corners that meet become one vertex. What remains of a border edge is a wall.

Before: the tiles of :mod:`.detour`. After: :mod:`.polymesh`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.errors import NavMeshError

SLACK = 0.01  #: Detour's: borders this far apart are the same line, overlaps shorter than twice this are none [m]
LINKS_PER_EDGE = 64  #: more overlaps than this on average are taken for a broken file
_SIDES = {0: (0, 1, 0), 2: (2, 0, 1), 4: (0, -1, 0), 6: (2, 0, -1)}  #: side: (axis across it, step in x, step in y)


@dataclass(frozen=True)
class BorderEdge:
    """Edge of a polygon on the border of its tile."""

    tile: int
    polygon: int
    corner: int  #: which corner of the polygon it starts at
    side: int  #: Detour's: 0 +x, 2 +z, 4 -x, 6 -z


@dataclass(frozen=True)
class Loop:
    """Corners of a polygon, and the polygon across the edge from each to the next (-1 a wall)."""

    vertices: list[int]
    neighbours: list[int]


@dataclass
class _Segment:
    polygon: int
    corner: int
    ends: tuple[int, int]  #: vertices, from low to high along the border
    low: float
    high: float
    line: float
    heights: tuple[float, float]
    overlaps: list[tuple[float, float, int, int, int]]  #: low, high, vertex at low, vertex at high, polygon across

    def height(self, at: float) -> float:
        span = self.high - self.low
        w = (at - self.low) / span if span > 0 else 0.0
        return self.heights[0] + w * (self.heights[1] - self.heights[0])


def stitch(
    vertices: NDArray[np.float64], loops: list[Loop], border: list[BorderEdge], headers: list[Untyped], source: str
) -> tuple[NDArray[np.float64], list[Loop]]:
    """Vertices and polygons with the border edges of neighbouring tiles joined.

    Raises:
        NavMeshError: a border edge has a side that Detour does not have, or borders overlap without end.
    """
    if not border or len(headers) < 2:
        return vertices, loops
    groups: dict[tuple[int, int, int], list[_Segment]] = {}
    for edge in border:
        if edge.side not in _SIDES:
            raise NavMeshError(f"navmesh {source}: border side {edge.side} is not known; valid: 0, 2, 4, 6")
        header = headers[edge.tile]
        groups.setdefault((int(header["x"]), int(header["y"]), edge.side), []).append(_segment(vertices, loops, edge))
    parent = np.arange(len(vertices))

    def root(v: int) -> int:
        while parent[v] != v:
            parent[v] = parent[parent[v]]
            v = int(parent[v])
        return v

    climb = float(headers[0]["walkable_climb"])
    budget = LINKS_PER_EDGE * len(border)
    for (x, y, side), segments in groups.items():
        if side >= 4:
            continue  # each pair once, from its lower side
        _, dx, dy = _SIDES[side]
        others = sorted(groups.get((x + dx, y + dy, side + 4), []), key=lambda s: s.low)
        lows = np.array([s.low for s in others])
        longest = max((s.high - s.low for s in others), default=0.0)
        for a in segments:
            first, last = np.searchsorted(lows, [a.low - longest, a.high])
            for b in others[first:last]:
                budget -= 1
                if budget < 0:
                    raise NavMeshError(f"navmesh {source}: its tiles' borders overlap too often; the file is broken")
                if _meet(a, b, climb):
                    _link(a, b, parent, root)
    changed: dict[int, dict[int, _Segment]] = {}
    for segments in groups.values():
        for s in segments:
            if s.overlaps:
                changed.setdefault(s.polygon, {})[s.corner] = s
    result = []
    for p, loop in enumerate(loops):
        corners = [root(v) for v in loop.vertices]
        if p not in changed:
            result.append(Loop(corners, loop.neighbours))
            continue
        result.append(_split(Loop(corners, loop.neighbours), changed[p], root))
    return vertices, result


def _segment(vertices: NDArray[np.float64], loops: list[Loop], edge: BorderEdge) -> _Segment:
    loop = loops[edge.polygon].vertices
    a, b = loop[edge.corner], loop[(edge.corner + 1) % len(loop)]
    across = _SIDES[edge.side][0]
    along = 2 - across
    if vertices[a, along] > vertices[b, along]:
        a, b = b, a
    return _Segment(
        polygon=edge.polygon,
        corner=edge.corner,
        ends=(a, b),
        low=float(vertices[a, along]),
        high=float(vertices[b, along]),
        line=float(vertices[a, across]),
        heights=(float(vertices[a, 1]), float(vertices[b, 1])),
        overlaps=[],
    )


def _meet(a: _Segment, b: _Segment, climb: float) -> bool:
    low, high = max(a.low, b.low) + SLACK, min(a.high, b.high) - SLACK
    if low > high or abs(a.line - b.line) > SLACK:
        return False
    below, above = b.height(low) - a.height(low), b.height(high) - a.height(high)
    return below * above < 0 or min(abs(below), abs(above)) <= 2 * climb


def _link(a: _Segment, b: _Segment, parent: NDArray[np.int64], root: Untyped) -> None:
    chosen = []
    for end in (0, 1):
        near, far = (a.low, b.low) if end == 0 else (a.high, b.high)
        if abs(near - far) <= SLACK:  # two corners meet: one vertex
            one, two = root(a.ends[end]), root(b.ends[end])
            parent[max(one, two)] = min(one, two)
            chosen.append(a.ends[end])
        elif (near > far) == (end == 0):
            chosen.append(a.ends[end])
        else:
            chosen.append(b.ends[end])
    low, high = max(a.low, b.low), min(a.high, b.high)
    a.overlaps.append((low, high, chosen[0], chosen[1], b.polygon))
    b.overlaps.append((low, high, chosen[0], chosen[1], a.polygon))


def _split(loop: Loop, segments: dict[int, _Segment], root: Untyped) -> Loop:
    vertices: list[int] = []
    neighbours: list[int] = []
    count = len(loop.vertices)
    for k, v in enumerate(loop.vertices):
        after = loop.vertices[(k + 1) % count]
        if k not in segments:
            vertices.append(v)
            neighbours.append(loop.neighbours[k])
            continue
        s = segments[k]
        upwards = root(s.ends[0]) == v
        pieces = sorted(s.overlaps, key=lambda o: o[0], reverse=not upwards)
        at = v
        for low, _, vertex_low, vertex_high, across in pieces:
            del low
            begin, end = (root(vertex_low), root(vertex_high)) if upwards else (root(vertex_high), root(vertex_low))
            if begin != at:
                vertices.append(at)
                neighbours.append(-1)
            if begin == end:
                continue
            vertices.append(begin)
            neighbours.append(across)
            at = end
        if at != after:
            vertices.append(at)
            neighbours.append(-1)
    return Loop(vertices, neighbours)
