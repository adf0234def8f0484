"""Text as other programs write it: any line ends, UTF-8, UTF-16 or an older code page, with or without a mark."""

from __future__ import annotations

import codecs
import re
import unicodedata

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),  # before UTF-16, whose mark it starts with
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_CONTINUED = re.compile(rb"\\[ \t]*(\r\n|\r|\n)")


def plain_bytes(data: bytes) -> bytes:
    """A text file's bytes without a byte order mark, UTF-16 and UTF-32 turned into UTF-8; others as they are."""
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            rest = data[len(mark) :]
            return rest if encoding == "utf-8" else rest.decode(encoding, errors="replace").encode()
    for place, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):  # no mark: every other byte of Latin text is zero
        start = data[:64]
        if len(start) > 8 and not any(start[place::2]) and all(start[1 - place :: 2]):
            return data.decode(encoding, errors="replace").encode()
    return data


def join_continued(data: bytes) -> bytes:
    """Text in which lines that end in a backslash go on in the next one; comments do not."""
    if b"\\" not in data or not _CONTINUED.search(data):
        return data
    kept: list[bytes] = []
    held = b""
    for line in data.splitlines():
        line = held + line
        held = b""
        stripped = line.rstrip()
        if stripped.endswith(b"\\") and not line.lstrip().startswith(b"#"):
            held = stripped[:-1] + b" "
        else:
            kept.append(line)
    return b"\n".join([*kept, held]) if held else b"\n".join(kept)


def decode_name(raw: bytes) -> str:
    """A name or line: UTF-8 where it is that, else Windows' Western code page, else Latin-1."""
    for encoding in ("utf-8", "cp1252"):
        try:
            return raw.decode(encoding)
        except UnicodeDecodeError:
            pass
    return raw.decode("latin-1")


def spellings(name: str) -> list[str]:
    """How a file system may spell a name: as it is, composed, decomposed, and as bytes of an older code page."""
    found = [name, unicodedata.normalize("NFC", name), unicodedata.normalize("NFD", name)]
    if not name.isascii():
        for encoding in ("cp1252", "latin-1"):
            try:
                found.append(name.encode(encoding).decode("utf-8", errors="surrogateescape"))
            except UnicodeEncodeError:
                pass
    return list(dict.fromkeys(found))
