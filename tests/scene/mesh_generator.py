"""OBJ and PLY files of all combinations of what such files may hold, with values that are known without reading them.

Every file shows the same flat sheet, 3 m wide and 2 m high in the plane z = 1, made of six squares. What covers it and
what colours it differs: the colour of a point follows from its place by a formula, so that triangulation, indices and
encodings cannot change it.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from mesh_cases import QUARTERS, picture

WIDTH, HEIGHT, LEVEL = 3, 2, 1.0
TURNED = QUARTERS[::-1, ::-1].copy()
"""Another picture, for the squares that do not show the first one."""

FACES = {
    "triangles": [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]],
    "squares": [[(0, 0), (1, 0), (1, 1), (0, 1)]],
}
L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
"""Three squares at the lower left as one concave polygon."""


@dataclass(frozen=True)
class Sheet:
    """One file with what it holds.

    Attributes:
        name: of the mesh file; tells the combination.
        files: bytes by file name, the mesh among them.
        tint: whether vertex colours go from black at the left to white at the right.
        cells: factor on the colour of each square, (HEIGHT, WIDTH, 3).
        pictures: which picture each square shows: 0 none, 1 QUARTERS, 2 TURNED, (HEIGHT, WIDTH).
    """

    name: str
    files: dict[str, bytes]
    tint: bool
    cells: np.ndarray
    pictures: np.ndarray
    polygons: list[list[tuple[int, int]]] = field(default_factory=list)

    def colors(self, points: np.ndarray) -> np.ndarray:
        """Colours 0..255 under points (N, 2) of the sheet, (N, 3)."""
        column, row = np.floor(points).astype(int).T
        result = self.cells[row, column] * 255.0
        if self.tint:
            result = result * (points[:, :1] / WIDTH)
        across, down = (points[:, 0] / WIDTH * 2).astype(int), ((1 - points[:, 1] / HEIGHT) * 2).astype(int)
        for number, image in ((1, QUARTERS), (2, TURNED)):
            shows = self.pictures[row, column] == number
            result[shows] *= image[down[shows], across[shows]] / 255.0
        return result


def points() -> np.ndarray:
    """100 points of the sheet that lie on no border of squares, triangles or texels, (100, 2)."""
    generator = np.random.default_rng(5)
    found = generator.uniform([0.02, 0.02], [WIDTH - 0.02, HEIGHT - 0.02], (2000, 2))
    u, v = found[:, 0] / WIDTH * 2, found[:, 1] / HEIGHT * 2
    borders = [found[:, 0], found[:, 1], found[:, 0] - found[:, 1], found[:, 0] + found[:, 1], u, v]
    good = np.all([np.abs(b - np.round(b)) > 0.02 for b in borders], axis=0)
    return found[good][:100]


def polygons(kind: str) -> list[list[tuple[int, int]]]:
    """Polygons of grid points that cover the sheet."""
    result: list[list[tuple[int, int]]] = []
    taken = set()
    if kind == "mixed":
        result.append(L_SHAPE)
        taken = {(0, 0), (1, 0), (0, 1)}
    for j, i in itertools.product(range(HEIGHT), range(WIDTH)):
        if (i, j) in taken:
            continue
        own = FACES["squares" if kind == "squares" or (kind == "mixed" and i < 2) else "triangles"]
        result += [[(i + a, j + b) for a, b in corners] for corners in own]
    return result


def _cell(polygon: list[tuple[int, int]]) -> tuple[int, int]:
    """The square of a polygon, its first one."""
    return min(b for _, b in polygon), min(a for a, _ in polygon)


def _cells(kind: str, values: list, otherwise) -> np.ndarray:
    """A value for each square, the same for all squares of one polygon."""
    result = np.array([[otherwise] * WIDTH] * HEIGHT, float)
    for j, i in itertools.product(range(HEIGHT), range(WIDTH)):
        own = (0, 0) if kind == "mixed" and i + j < 2 and (i, j) != (1, 1) else (j, i)
        result[j, i] = values[(own[1] + own[0]) % len(values)]
    return result


GRID = [(i, j) for j in range(HEIGHT + 1) for i in range(WIDTH + 1)]
FACE_COLORS = [(1.0, 0.0, 0.0), (0.0, 0.2, 1.0), (0.6, 1.0, 0.4)]

OBJ_COLOURS = ("none", "vertex 0..1", "vertex 0..255", "kd", "kd and vertex")
OBJ_TEXTURES = ("none", "one", "two in one library", "two libraries", "some faces")
OBJ_ENCODINGS = ("utf-8", "crlf", "cr", "bom", "utf-16", "latin-1")


def obj_sheets() -> Iterator[Sheet]:
    """OBJ files: indices x faces x colours x textures x encodings."""
    combinations = itertools.product(
        ("absolute", "relative"), ("triangles", "squares", "mixed"), OBJ_COLOURS, OBJ_TEXTURES
    )
    for number, (indices, kind, colours, textures) in enumerate(combinations):
        for encoding in (OBJ_ENCODINGS[number % 6], OBJ_ENCODINGS[(number + 3) % 6]):
            yield _obj_sheet(indices, kind, colours, textures, encoding)


def _obj_sheet(indices: str, kind: str, colours: str, textures: str, encoding: str) -> Sheet:
    faces = polygons(kind)
    tint = "vertex" in colours
    top = 255 if "255" in colours else 1
    lines = ["# a sheet"] if encoding != "latin-1" else ["# une tôle", "o tôle"]
    libraries = {"two in one library": "a.mtl", "two libraries": "a.mtl b.mtl"}.get(textures, "a.mtl")
    lines += [f"mtllib {libraries}"]
    for i, j in GRID:
        shade = f"{i / WIDTH * top:.7g}"
        lines.append(f"v {i} {j} {LEVEL}" + (f" {shade} {shade} {shade}" if tint else ""))
    lines += [f"vt {i / WIDTH:.7g} {j / HEIGHT:.7g}" for i, j in GRID]
    kd = np.array([0.4, 1.0, 0.8]) if "kd" in colours else np.ones(3)
    pictures = _cells(kind, [1, 2] if "two" in textures else [1, 0] if textures == "some faces" else [1], 0)
    if textures == "none":
        pictures = np.zeros((HEIGHT, WIDTH))
    material = ""
    for polygon in faces:
        shows = int(pictures[_cell(polygon)])
        wanted = {0: "plain", 1: "first", 2: "second"}[1 if textures == "some faces" else shows]
        if wanted != material:
            lines.append(f"usemtl {wanted}")
            material = wanted
        corners = []
        for point in polygon:
            k = GRID.index(point) + 1
            if indices == "relative":
                k -= len(GRID) + 1
            corners.append(f"{k}/{k}" if shows else str(k))
        lines.append("f " + " ".join(corners))
    color = f"Kd {kd[0]} {kd[1]} {kd[2]}"
    first, second = f"newmtl first\n{color}\nmap_Kd p.png\n", f"newmtl second\n{color}\nmap_Kd -s 1 1 1 q.png\n"
    plain = f"newmtl plain\n{color}\n"
    files = (
        {"a.mtl": first + plain, "b.mtl": second} if textures == "two libraries" else {"a.mtl": first + second + plain}
    )
    name = "-".join((indices, kind, colours, textures, encoding)).replace(" ", "_").replace("..", "to") + ".obj"
    text = "\n".join(lines) + "\n"
    ends = {"crlf": "\r\n", "cr": "\r"}.get(encoding, "\n")
    codec = {"bom": "utf-8-sig", "utf-16": "utf-16", "latin-1": "latin-1"}.get(encoding, "utf-8")
    encoded = {key: value.replace("\n", ends).encode(codec) for key, value in ({name: text} | files).items()}
    encoded |= {"p.png": picture(), "q.png": picture(TURNED)}
    return Sheet(name, encoded, tint, np.ones((HEIGHT, WIDTH, 1)) * kd, pictures, faces)


PLY_FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")
PLY_COLOURS = ("none", "vertex uchar", "vertex ushort", "vertex float", "vertex float 255", "face uchar", "face float",
               "face ushort", "both")  # fmt: skip
PLY_TEXTURES = ("none", "st", "texture_u", "face", "two")
PLY_NAMES = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
PLY_INDICES = (("uchar", "int"), ("uint8", "uint32"), ("int", "int"), ("ushort", "short"), ("char", "uchar"))
_CODES = {"char": "b", "uchar": "B", "uint8": "B", "short": "h", "ushort": "H", "int": "i", "uint32": "I", "float": "f"}


def ply_sheets() -> Iterator[Sheet]:
    """PLY files: formats x faces x colours x textures, with names and types of each kind among them."""
    combinations = itertools.product(
        PLY_FORMATS, ("triangles", "squares", "mixed", "strips"), PLY_COLOURS, PLY_TEXTURES
    )
    for number, (form, kind, colours, textures) in enumerate(combinations):
        if kind == "strips" and ("face" in colours or colours == "both" or textures in ("face", "two")):
            continue  # strips have neither colours nor pictures of their own
        yield _ply_sheet(form, kind, colours, textures, PLY_NAMES[number % 3], PLY_INDICES[number % 5], number)


def _ply_sheet(form, kind, colours, textures, names, index_types, number) -> Sheet:
    faces = polygons("triangles" if kind == "strips" else kind)
    strips = [[GRID.index((i, j + b)) for i in range(WIDTH + 1) for b in (1, 0)] for j in range(HEIGHT)]
    tint, of_faces = colours.startswith("vertex") or colours == "both", colours.startswith("face") or colours == "both"
    kind_of = {"none": "uchar", "both": "uchar", "vertex float 255": "float"}.get(colours, colours.split()[-1])
    top = {"uchar": 255, "ushort": 65535, "float": 255.0 if "255" in colours else 1.0}[kind_of]
    header = ["ply", f"format {form} 1.0", "comment a sheet", "obj_info of six squares"]
    pictures = np.zeros((HEIGHT, WIDTH))
    if textures != "none":
        header.append("comment TextureFile p.png")
        pictures = _cells(kind, [1, 2] if textures == "two" else [1], 0)
    if textures == "two":
        header.append("comment TextureFile q.png")
    header += ["element vertex 12", *(f"property float {axis}" for axis in "xyz")]
    if number % 2:
        header.append("property float quality")
    uv_names = {"st": ("s", "t"), "texture_u": ("texture_u", "texture_v")}.get(textures, ())
    header += [f"property float {name}" for name in uv_names]
    if tint:
        header += [f"property {kind_of} {name}" for name in (*names, "alpha")]
    rows: list[list[tuple[str, float]]] = []
    for i, j in GRID:
        row = [("float", i), ("float", j), ("float", LEVEL)] + [("float", 0.5)] * (number % 2)
        row += [("float", i / WIDTH), ("float", j / HEIGHT)] if uv_names else []
        row += [(kind_of, i / WIDTH * top)] * 3 + [(kind_of, top)] if tint else []
        rows.append(row)
    if number % 5 == 4:  # an element that nobody knows, before the faces
        header += ["element thing 2", "property list uchar short values", "property int number"]
        rows += [[("uchar", 2), ("short", 7), ("short", 8), ("int", 1)], [("uchar", 0), ("int", 2)]]
    wedges = textures in ("face", "two")
    cells = _cells(kind, FACE_COLORS, (1, 1, 1)) if of_faces else np.ones((HEIGHT, WIDTH, 3))
    if kind == "strips":
        if number % 2:  # one strip with a break in it
            header += ["element tristrips 1", "property list int int vertex_indices"]
            joined = [*strips[0], -1, *strips[1]]
            rows.append([("int", len(joined))] + [("int", k) for k in joined])
        else:
            header += ["element tristrips 2", "property list int int vertex_indices"]
            rows += [[("int", len(strip))] + [("int", k) for k in strip] for strip in strips]
    else:
        count_type, index_type = index_types
        name = "vertex_index" if number % 2 else "vertex_indices"
        header += [f"element face {len(faces)}", f"property list {count_type} {index_type} {name}"]
        header += ["property list uchar float texcoord", "property int texnumber"] if wedges else []
        header += [f"property {kind_of} {name}" for name in names] if of_faces else []
        for polygon in faces:
            row = [(count_type, len(polygon))] + [(index_type, GRID.index(point)) for point in polygon]
            if wedges:
                row += [("uchar", 2 * len(polygon))]
                row += [("float", value) for i, j in polygon for value in (i / WIDTH, j / HEIGHT)]
                row += [("int", int(pictures[_cell(polygon)]) - 1)]
            row += [(kind_of, value * top) for value in cells[_cell(polygon)]] if of_faces else []
            rows.append(row)
    ends = ("\n", "\n", "\r\n", "\r")[number % 4]
    data = ends.join([*header, "end_header", ""]).encode() + _body(form, rows, ends)
    name = "-".join((form, kind, colours, textures, str(number))).replace(" ", "_") + ".ply"
    files = {name: data, "p.png": picture(), "q.png": picture(TURNED)}
    return Sheet(name, files, tint, cells, pictures, faces)


def _body(form: str, rows: list[list[tuple[str, float]]], ends: str) -> bytes:
    def exact(code: str, value: float) -> float:
        return value if code == "float" else int(round(value))

    if form == "ascii":
        return "".join(" ".join(f"{exact(c, v):.9g}" for c, v in row) + ends for row in rows).encode()
    order = "<" if form == "binary_little_endian" else ">"
    return b"".join(struct.pack(order + _CODES[code], exact(code, value)) for row in rows for code, value in row)
