"""The container of a glTF file: chunks, JSON, data URIs, and the files it names."""

from __future__ import annotations

import base64
import binascii
import json
import re
import urllib.parse
from pathlib import Path

from prnav.errors import SceneError
from prnav.scene.side_files import SideFiles, local_name

_AGAIN = "copy or export the file again"


def decode_data_uri(path: Path, uri: str) -> bytes:
    """Bytes of a ``data:`` URI."""
    head, comma, body = uri.partition(",")
    try:
        if not comma:
            raise ValueError("it has no comma")
        if head.lower().rstrip().endswith(";base64"):
            plain = re.sub(r"\s+", "", urllib.parse.unquote(body) if "%" in body else body).rstrip("=")
            plain = plain.replace("-", "+").replace("_", "/")  # the alphabet for URLs
            return base64.b64decode(plain + "=" * (-len(plain) % 4), validate=True)
        return urllib.parse.unquote_to_bytes(body)
    except (ValueError, binascii.Error) as error:
        raise SceneError(f"scene {path}: data URI {uri[:40]!r}... cannot be decoded ({error}); export again") from error


def split_glb(path: Path, data: bytes) -> tuple[memoryview, memoryview | None]:
    """JSON and binary chunk (None where there is none) of a GLB, every length checked against the bytes there are.

    Views into ``data``, not copies.

    Raises:
        SceneError: not a GLB of version 2, or cut off.
    """
    if data[:4] != b"glTF"[: len(data)] or len(data) == 0:
        raise SceneError(
            f"scene {path}: it starts with {data[:4]!r}, a GLB starts with b'glTF'; export it as GLB again"
        )
    if len(data) < 20:
        raise SceneError(f"scene {path}: {len(data)} bytes are too few for a GLB header, it is cut off; {_AGAIN}")
    version, length = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8))
    if version != 2:
        raise SceneError(f"scene {path}: GLB version {version} is not known; export it as glTF 2.0")
    if length > len(data):
        raise SceneError(f"scene {path}: its header promises {length} bytes, it has {len(data)}: cut off; {_AGAIN}")
    chunks: dict[bytes, memoryview] = {}
    start = 12
    while start + 8 <= length:
        size, kind = int.from_bytes(data[start : start + 4], "little"), data[start + 4 : start + 8]
        if start + 8 + size > length:
            left = length - start - 8
            raise SceneError(f"scene {path}: chunk {kind!r} promises {size} bytes where {left} are left; {_AGAIN}")
        chunks.setdefault(kind, memoryview(data)[start + 8 : start + 8 + size])
        start += 8 + size
    if b"JSON" not in chunks:
        raise SceneError(f"scene {path}: the GLB has no JSON chunk; export it again")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def parse_json(path: Path, text: bytes | memoryview) -> dict:
    """The top-level object of a glTF."""
    try:
        document = json.loads(bytes(text).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        reason = str(error).split("\n")[0]
        raise SceneError(f"scene {path}: its glTF JSON cannot be read ({reason}); {_AGAIN}") from error
    if not isinstance(document, dict):
        raise SceneError(f"scene {path}: its glTF JSON is a {type(document).__name__}, not an object; export it again")
    return document


def gltf_side_files(path: Path, data: bytes, side: SideFiles) -> list[str]:
    """Read the buffers and images that a glTF names; the names of the images that are there.

    Raises:
        SceneError: the JSON cannot be read, or a buffer lies outside the root.
    """
    text: bytes | memoryview = split_glb(path, data)[0] if path.suffix.lower() == ".glb" else data
    document = parse_json(path, text)
    found = []
    for kind in ("buffers", "images"):
        items = document.get(kind, [])
        for item in items if isinstance(items, list) else []:
            uri = item.get("uri") if isinstance(item, dict) else None
            if not isinstance(uri, str) or is_data_uri(uri) or not uri:
                continue
            name = urllib.parse.unquote(uri)
            if kind == "images":
                if side.read([name]) is not None:
                    found.append(name)
            elif local_name(name) is None or side.outside(name):
                raise SceneError(
                    f"scene {path}: it refers to {name!r} outside its folder; put that file beside the mesh, or give a "
                    "folder that holds both (--data-root DIR)"
                )
            else:
                side.read([name], quiet=True, strict=True)
    return found


def is_data_uri(uri: str) -> bool:
    """Whether a URI holds its data itself."""
    return uri[:5].lower() == "data:"
