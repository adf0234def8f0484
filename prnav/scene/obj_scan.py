"""The lines of an OBJ file as arrays, in one compiled pass that believes nothing.

Numbers are read by the grammar alone, so that a letter among them is an error and never a zero. What is neither a
vertex, a texture coordinate nor a face is handed on as a line of text, with the number of faces before it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

_TEXT, _VERTEX, _UV, _FACE, _SKIP = range(5)
NO_ERROR, BAD_NUMBER, FEW_NUMBERS, BAD_CORNER, ZERO_INDEX, EARLY_INDEX = range(6)
_FARTHEST = 1 << 60
"""Indices are cut off here: beyond anything that a file can hold."""


class ObjLines(NamedTuple):
    """What the lines of an OBJ file say; indices count from 0."""

    positions: NDArray[np.float64]
    """(V, 3)."""
    colors: NDArray[np.float64] | None
    """As they stand in the file, (V, 3), NaN where a vertex has none; None where none has any."""
    uvs: NDArray[np.float64]
    """(T, 2), v up."""
    corners: NDArray[np.int64]
    """Vertex and texture coordinate of each corner of each face, (C, 2); -1 for no texture coordinate."""
    sizes: NDArray[np.int64]
    """Corners of each face, (F,)."""
    face_lines: NDArray[np.int64]
    """Line of each face, from 1 on, (F,)."""
    texts: NDArray[np.int64]
    """Other lines: first byte, end, faces before them, (S, 3)."""


class ObjFault(Exception):
    """A line that cannot be read: what is wrong with it, its number, and its bytes."""

    def __init__(self, kind: int, line: int, start: int, end: int) -> None:
        self.kind, self.line, self.start, self.end = kind, line, start, end


def scan_obj(data: bytes) -> ObjLines:
    """Lines of an OBJ file; see :class:`ObjLines`.

    Raises:
        ObjFault: a line cannot be read.
    """
    text = np.frombuffer(data, np.uint8)
    vertices, uvs, faces, corners, texts, colored = _count(text)
    result = ObjLines(
        np.empty((vertices, 3)),
        np.full((vertices if colored else 0, 3), np.nan),
        np.empty((uvs, 2)),
        np.empty((corners, 2), np.int64),
        np.empty(faces, np.int64),
        np.empty(faces, np.int64),
        np.empty((texts, 3), np.int64),
    )
    kind, line, start, end = _read(text, *result)
    if kind != NO_ERROR:
        raise ObjFault(kind, line, start, end)
    return result if colored else result._replace(colors=None)


@njit(cache=True, nogil=True, error_model="numpy")
def _line_end(text, i):
    while i < len(text) and text[i] != 10 and text[i] != 13:
        i += 1
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def _next_line(text, end):
    """First byte after a line's end; a carriage return and a line feed are one end."""
    if end + 1 < len(text) and text[end] == 13 and text[end + 1] == 10:
        return end + 2
    return end + 1


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _blank(character):
    return character == 32 or character == 9 or character == 11 or character == 12 or character == 0


@njit(cache=True, nogil=True, error_model="numpy")
def _skip_blanks(text, i, end):
    while i < end and _blank(text[i]):
        i += 1
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def _values_end(text, i, end):
    """Where the values of a line end: at a comment, if there is one."""
    while i < end and text[i] != 35:
        i += 1
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def _kind(text, i, end):
    """What a line is that starts at its first visible byte, and where its values start."""
    word = i
    while word < end and not _blank(text[word]) and text[word] != 35:
        word += 1
    size = word - i
    if size == 0:
        return _SKIP, word
    if size == 1:
        if text[i] == 118:  # v
            return _VERTEX, word
        if text[i] == 102:  # f
            return _FACE, word
        if text[i] == 103 or text[i] == 111 or text[i] == 115:  # g, o, s
            return _SKIP, word
    if size == 2:
        if text[i] == 118 and text[i + 1] == 116:  # vt
            return _UV, word
        if text[i] == 118 and text[i + 1] == 110:  # vn
            return _SKIP, word
        if text[i] == 102 and text[i + 1] == 111:  # fo, an old word for f
            return _FACE, word
    return _TEXT, word


@njit(cache=True, nogil=True, error_model="numpy")
def _words(text, i, end):
    count = 0
    while True:
        i = _skip_blanks(text, i, end)
        if i >= end:
            return count
        count += 1
        while i < end and not _blank(text[i]):
            i += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _count(text):
    vertices = uvs = faces = corners = texts = i = 0
    colored = False
    while i < len(text):
        end = _line_end(text, i)
        kind, at = _kind(text, _skip_blanks(text, i, end), end)
        if kind == _VERTEX:
            vertices += 1
            colored |= _words(text, at, _values_end(text, at, end)) >= 6
        elif kind == _UV:
            uvs += 1
        elif kind == _FACE:
            faces += 1
            corners += _words(text, at, _values_end(text, at, end))
        elif kind == _TEXT:
            texts += 1
        i = _next_line(text, end)
    return vertices, uvs, faces, corners, texts, colored


@njit(cache=True, nogil=True, error_model="numpy")
def _read(text, positions, colors, uvs, corners, sizes, face_lines, texts):
    vertex = uv = face = corner = other = i = line = 0
    values = np.empty(8)
    while i < len(text):
        line += 1
        end = _line_end(text, i)
        kind, at = _kind(text, _skip_blanks(text, i, end), end)
        if kind == _VERTEX or kind == _UV:
            found = _numbers(text, at, _values_end(text, at, end), values)
            if found < 0:
                return BAD_NUMBER, line, i, end
            if found < (3 if kind == _VERTEX else 1):
                return FEW_NUMBERS, line, i, end
            if kind == _VERTEX:
                positions[vertex] = values[:3]
                if found >= 6:
                    colors[vertex] = values[3:6]
                vertex += 1
            else:
                uvs[uv, 0], uvs[uv, 1] = values[0], values[1] if found > 1 else 0.0
                uv += 1
        elif kind == _FACE:
            stop = _values_end(text, at, end)
            first = corner
            while True:
                at = _skip_blanks(text, at, stop)
                if at >= stop:
                    break
                fault, at = _corner(text, at, stop, vertex, uv, corners[corner])
                if fault != NO_ERROR:
                    return fault, line, i, end
                corner += 1
            sizes[face], face_lines[face] = corner - first, line
            face += 1
        elif kind == _TEXT:
            texts[other, 0], texts[other, 1], texts[other, 2] = i, end, face
            other += 1
        i = _next_line(text, end)
    return NO_ERROR, 0, 0, 0


@njit(cache=True, nogil=True, error_model="numpy")
def _corner(text, i, end, vertices, uvs, corner):
    """One corner of a face, v, v/t, v//n or v/t/n, into its row; a fault, and where the next one may start."""
    index, i = _integer(text, i, end)
    if i < 0:
        return BAD_CORNER, i
    if index == 0:
        return ZERO_INDEX, i
    if index < -vertices:
        return EARLY_INDEX, i
    corner[0] = index - 1 if index > 0 else vertices + index
    corner[1] = -1
    if i < end and text[i] == 47:
        i += 1
        if i < end and text[i] != 47 and not _blank(text[i]):
            index, i = _integer(text, i, end)
            if i < 0:
                return BAD_CORNER, i
            if index < -uvs:
                return EARLY_INDEX, i
            corner[1] = index - 1 if index >= 0 else uvs + index
        if i < end and text[i] == 47:
            i += 1
            if i < end and not _blank(text[i]):
                index, i = _integer(text, i, end)
                if i < 0:
                    return BAD_CORNER, i
    if i < end and not _blank(text[i]):
        return BAD_CORNER, i
    return NO_ERROR, i


@njit(cache=True, nogil=True, error_model="numpy")
def _integer(text, i, end):
    """A whole number and where it ends; -1 for the end where there is none."""
    negative = False
    if i < end and (text[i] == 45 or text[i] == 43):
        negative = text[i] == 45
        i += 1
    first, value = i, np.int64(0)
    while i < end and 48 <= text[i] <= 57:
        value = value * 10 + np.int64(text[i]) - 48
        if value > _FARTHEST // 16:
            value = np.int64(_FARTHEST // 16)
        i += 1
    if i == first:
        return 0, -1
    return (-value if negative else value), i


@njit(cache=True, nogil=True, error_model="numpy")
def _numbers(text, i, end, values):
    """Numbers of a line into ``values``, as many as it holds; how many there are, -1 where something is none."""
    count = 0
    while True:
        i = _skip_blanks(text, i, end)
        if i >= end:
            return count
        value, i = _real(text, i, end)
        if i < 0 or (i < end and not _blank(text[i])):
            return -1
        if count < len(values):
            values[count] = value
        count += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _real(text, i, end):
    """A decimal number, nan or inf, and where it ends; -1 for the end where there is none."""
    sign = 1.0
    if i < end and (text[i] == 45 or text[i] == 43):
        sign = -1.0 if text[i] == 45 else 1.0
        i += 1
    if i + 2 < end and (text[i] | 32) > 96:  # letters: nan, inf, infinity
        a, b, c = text[i] | 32, text[i + 1] | 32, text[i + 2] | 32
        value = np.nan if a == 110 and b == 97 and c == 110 else np.inf if a == 105 and b == 110 and c == 102 else 0.0
        if value == 0.0:
            return 0.0, -1
        i += 3
        while i < end and not _blank(text[i]):
            i += 1
        return sign * value, i
    mantissa, power, digits, point = np.int64(0), 0, 0, False
    while i < end and (48 <= text[i] <= 57 or (text[i] == 46 and not point)):
        if text[i] == 46:
            point = True
        else:
            digits += 1
            if mantissa < 100_000_000_000_000_000:
                mantissa = mantissa * 10 + np.int64(text[i]) - 48
                power -= point
            else:
                power += not point
        i += 1
    if digits == 0:
        return 0.0, -1
    if i < end and (text[i] | 32 == 101 or text[i] | 32 == 100):  # e, and d as Fortran writes it
        exponent, i = _integer(text, i + 1, end)
        if i < 0:
            return 0.0, -1
        power += min(max(exponent, -10_000), 10_000)
    value = np.float64(mantissa)
    if power < 0:
        value = value / 10.0 ** min(-power, 300) / 10.0 ** min(max(-power - 300, 0), 300)
    elif power > 0:
        value = value * 10.0 ** min(power, 300) * 10.0 ** min(max(power - 300, 0), 300)
    return sign * value, i
