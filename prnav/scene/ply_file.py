"""PLY files as columns of numbers: the header, and the body in text or either byte order.

What a header promises is held against the bytes that are there before anything of that size is allocated. Lists may
differ in length from row to row: rows are found in one compiled pass.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.scene.side_files import SideFiles
from prnav.scene.text_files import decode_name

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8", "float16": "f2",
}  # fmt: skip
_START = re.compile(rb"(?:\xef\xbb\xbf)?\s*ply[ \t]*(\r\n|\n|\r)")
_END = re.compile(rb"(?:\r\n|\n|\r)[ \t]*end_header[ \t]*(\r\n|\n|\r|$)")
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_MAX_VALUE = 1 << 53


@dataclass(frozen=True)
class Property:
    """A column of an element; with ``count_type`` it is a list of ``type``."""

    name: str
    type: str  #: NumPy's name, without byte order
    count_type: str | None = None


@dataclass
class Element:
    """Rows of one kind."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def least_bytes(self) -> int:
        """Bytes that a row takes at least, its lists empty."""
        return sum(np.dtype(p.count_type or p.type).itemsize for p in self.properties)


class Header(NamedTuple):
    """What a PLY file says of itself."""

    order: str
    """Byte order as NumPy writes it; empty for text."""
    elements: list[Element]
    textures: list[str]
    """File names in ``comment TextureFile`` lines."""
    body: int
    """First byte after the header."""


class ListColumn(NamedTuple):
    """A list per row."""

    values: NDArray[np.float64]
    """All of them, one row after another."""
    sizes: NDArray[np.int64]
    """How many each row has, (n,)."""


class Rows(NamedTuple):
    """Columns of an element by their names in lower case."""

    rows: int
    scalars: dict[str, NDArray[np.float64]]
    """(n,) each."""
    types: dict[str, str]
    """NumPy's name of each column's type."""
    lists: dict[str, ListColumn]


def read_header(path: Path, data: bytes) -> Header:
    """Header of a PLY file.

    Raises:
        SceneError: there is none, or a line of it cannot be read.
    """
    start, end = _START.match(data), _END.search(data)
    if start is None or end is None:
        raise SceneError(f"scene {path}: no PLY header (it starts with {data[:8]!r}); copy or export the file again")
    order: str | None = None
    elements: list[Element] = []
    textures: list[str] = []
    for raw in re.split(rb"\r\n|\n|\r", data[start.end() : end.start()]):
        line = decode_name(raw).strip()
        words = line.split()
        keyword = words[0].lower() if words else ""
        if keyword == "format":
            if len(words) < 2 or words[1].lower() not in _FORMATS:
                _bad_line(path, line, f"format {' or '.join(_FORMATS)}")
            order = _FORMATS[words[1].lower()]
        elif keyword == "element":
            if len(words) != 3 or not re.fullmatch(r"[0-9]{1,18}", words[2]):
                _bad_line(path, line, "element NAME COUNT")
            elements.append(Element(words[1].lower(), int(words[2])))
        elif keyword == "property":
            if not elements:
                _bad_line(path, line, "an element line before it")
            elements[-1].properties.append(_property(path, line, words))
        elif keyword == "comment" and len(words) > 1:
            match = re.match(r"texture_?file\b\s*:?\s*(.+)", line.split(None, 1)[1], re.IGNORECASE)
            if match:
                textures.append(match[1].strip().strip('"'))
        elif keyword not in ("", "comment", "obj_info"):
            _bad_line(path, line, "format, element, property, comment or obj_info")
    if order is None:
        raise SceneError(f"scene {path}: its PLY header has no format line; export it again")
    if len({element.name for element in elements}) != len(elements):
        raise SceneError(f"scene {path}: its PLY header has two elements of one name; export it again")
    body = end.end()
    if order and start[1] == b"\r" and end[1] == b"\r\n":
        body -= 1  # lines end in a carriage return alone: the line feed is the body's first byte
    return Header(order, elements, textures, body)


def read_tables(path: Path, data: bytes, header: Header, wanted: tuple[str, ...]) -> dict[str, Rows]:
    """Elements of a PLY file by name.

    Args:
        path: for errors.
        data: the whole file.
        header: of it.
        wanted: elements to read; the others are passed over.

    Raises:
        SceneError: the body does not hold what the header promises.
    """
    if not header.order:
        return _text_tables(path, data[header.body :], header, wanted)
    body = np.frombuffer(data, np.uint8, offset=header.body)
    _check_promise(path, sum(e.count * e.least_bytes for e in header.elements), len(body), "bytes")
    tables: dict[str, Rows] = {}
    start = 0
    for number, element in enumerate(header.elements):
        if not any(later.name in wanted for later in header.elements[number:]):
            break
        offsets, end = _binary_rows(path, body, start, element, header.order)
        if element.name in wanted:
            tables[element.name] = _binary_table(body, offsets, element, header.order)
        start = end
    return tables


def ply_side_files(path: Path, data: bytes, side: SideFiles) -> list[str]:
    """Read the images that a PLY names; their keys."""
    try:
        names = read_header(path, data).textures
    except SceneError:
        return []  # told when it is parsed
    return [name for name in names if side.read([name]) is not None]


def _property(path: Path, line: str, words: list[str]) -> Property:
    kinds = [word.lower() for word in words[1:-1]]
    if len(kinds) == 1 and kinds[0] in _TYPES:
        return Property(words[-1].lower(), _TYPES[kinds[0]])
    if len(kinds) == 3 and kinds[0] == "list" and kinds[1] in _TYPES and kinds[2] in _TYPES:
        if _TYPES[kinds[1]][0] != "f":
            return Property(words[-1].lower(), _TYPES[kinds[2]], _TYPES[kinds[1]])
    _bad_line(path, line, "property TYPE NAME or property list COUNT_TYPE TYPE NAME")


def _bad_line(path: Path, line: str, valid: str) -> NoReturn:
    raise SceneError(f"scene {path}: PLY header line {line!r:.80} is not {valid}; export it again")


def _check_promise(path: Path, promised: int, found: int, unit: str) -> None:
    if promised > found:
        raise SceneError(
            f"scene {path}: its PLY header promises at least {promised} {unit}, it has {found}: cut off; copy it again"
        )


def _text_tables(path: Path, body: bytes, header: Header, wanted: tuple[str, ...]) -> dict[str, Rows]:
    least = sum(element.count * len(element.properties) for element in header.elements)
    _check_promise(path, least, (len(body) + 1) // 2, "numbers")
    words = body.split()
    try:
        numbers = np.array(words, dtype=np.bytes_).astype(np.float64) if words else np.empty(0)
    except ValueError:
        wrong = next(word for word in words if not _is_number(word))
        raise SceneError(
            f"scene {path}: {decode_name(wrong)!r:.40} stands where a number is needed; repair or export the file again"
        ) from None
    _check_promise(path, least, len(numbers), "numbers")
    tables: dict[str, Rows] = {}
    start = 0
    for element in header.elements:
        offsets, end = _text_rows(path, numbers, start, element)
        if element.name in wanted:
            tables[element.name] = _text_table(numbers, offsets, element)
        start = end
    if start != len(numbers):
        raise SceneError(
            f"scene {path}: its body has {len(numbers)} numbers where its PLY header describes {start}; "
            "repair or export the file again"
        )
    return tables


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _text_rows(path: Path, numbers: NDArray[np.float64], start: int, element: Element) -> tuple[NDArray[np.int64], int]:
    """Where each column of each row starts, (n, columns), and where the element ends."""
    from prnav.scene.ply_rows import walk_text  # compiled: not for those who read no PLY

    lists = np.array([p.count_type is not None for p in element.properties], bool)
    offsets = np.empty((element.count, len(lists)), np.int64)
    end = walk_text(numbers, start, lists, offsets)
    if end < 0:
        _bad_rows(path, element, -1 - end)
    return offsets, end


def _text_table(numbers: NDArray[np.float64], offsets: NDArray[np.int64], element: Element) -> Rows:
    table = Rows(element.count, {}, {}, {})
    for column, p in enumerate(element.properties):
        at = offsets[:, column]
        table.types[p.name] = p.type
        if p.count_type is None:
            table.scalars[p.name] = numbers[at]
        else:
            sizes = numbers[at].astype(np.int64)
            table.lists[p.name] = ListColumn(numbers[_spread(at + 1, sizes, 1)], sizes)
    return table


def _binary_rows(
    path: Path, body: NDArray[np.uint8], start: int, element: Element, order: str
) -> tuple[NDArray[np.int64], int]:
    """Where each column of each row starts, (n, columns) [bytes], and where the element ends."""
    sizes = np.array([np.dtype(p.type).itemsize for p in element.properties], np.int64)
    counts = np.array([np.dtype(p.count_type).itemsize if p.count_type else 0 for p in element.properties], np.int64)
    signed = np.array([bool(p.count_type) and str(p.count_type)[0] == "i" for p in element.properties], bool)
    if not counts.any():
        row = int(sizes.sum())
        end = start + row * element.count
        if end > len(body):
            _bad_rows(path, element, max(0, (len(body) - start) // max(row, 1)))
        columns = np.cumsum(sizes) - sizes
        return start + row * np.arange(element.count)[:, None] + columns[None, :], end
    from prnav.scene.ply_rows import walk_binary

    offsets = np.empty((element.count, len(sizes)), np.int64)
    end = walk_binary(body, start, sizes, counts, signed, order == ">", offsets)
    if end < 0:
        _bad_rows(path, element, -1 - end)
    return offsets, end


def _binary_table(body: NDArray[np.uint8], offsets: NDArray[np.int64], element: Element, order: str) -> Rows:
    table = Rows(element.count, {}, {}, {})
    for column, p in enumerate(element.properties):
        at = offsets[:, column]
        table.types[p.name] = p.type
        if p.count_type is None:
            table.scalars[p.name] = _numbers(body, at, order + p.type)
        else:
            sizes = _numbers(body, at, order + p.count_type).astype(np.int64)
            first = at + np.dtype(p.count_type).itemsize
            values = _numbers(body, _spread(first, sizes, np.dtype(p.type).itemsize), order + p.type)
            table.lists[p.name] = ListColumn(values, sizes)
    return table


def _numbers(body: NDArray[np.uint8], at: NDArray[np.int64], kind: str) -> NDArray[np.float64]:
    """Numbers of a type at byte offsets, as float64."""
    dtype = np.dtype(kind)
    raw = np.empty((len(at), dtype.itemsize), np.uint8)
    for k in range(dtype.itemsize):
        raw[:, k] = body[at + k]
    with np.errstate(invalid="ignore"):  # signalling NaN
        return raw.view(dtype)[:, 0].astype(np.float64)


def _spread(firsts: NDArray[np.int64], sizes: NDArray[np.int64], stride: int) -> NDArray[np.int64]:
    """Places of all values of lists: ``sizes`` of them from each of ``firsts`` on, ``stride`` apart."""
    begin = np.cumsum(sizes) - sizes
    return np.repeat(firsts - begin * stride, sizes) + np.arange(int(sizes.sum())) * stride


def _bad_rows(path: Path, element: Element, row: int) -> NoReturn:
    raise SceneError(
        f"scene {path}: {element.name} {row} of {element.count} has a list of a wrong length, or is cut off; "
        "copy or export the file again"
    )
