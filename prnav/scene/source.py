"""The bytes of a mesh file and of the files it refers to, read once: what is hashed is what is loaded."""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import stat
import urllib.parse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from prnav.errors import SceneError
from prnav.files import resolve_inside

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
"""Kinds of mesh files that can be loaded."""

_LFS_POINTER = b"version https://git-lfs"


@dataclass(frozen=True)
class MeshSource:
    """A mesh file in memory.

    Attributes:
        path: where it was read from; errors name it.
        data: its bytes.
        side: bytes of the files it names (buffers, images, materials) by the name it gives them; a file that is not
            there has no entry.
        images: those of the names that are images.
    """

    path: Path
    data: bytes = field(repr=False)
    side: dict[str, bytes] = field(repr=False)
    images: tuple[str, ...] = ()

    @property
    def suffix(self) -> str:
        """Lower-case suffix with its dot."""
        return self.path.suffix.lower()

    def digest(self) -> str:
        """SHA-256 over the file, its kind, and the side files with their names, in hex."""
        parts = [(self.suffix, self.data), *sorted(self.side.items())]
        digest = hashlib.sha256()
        for name, data in parts:
            digest.update(json.dumps([name, len(data)]).encode())
            digest.update(data)
        return digest.hexdigest()


def read_source(path: str | Path) -> MeshSource:
    """A mesh file with all the files it names.

    Raises:
        SceneError: it is missing, empty, of another kind, or names a file outside its own folder.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise SceneError(f"scene {path}: suffix {path.suffix!r} is not a mesh that can be read; {_kinds()}")
    data = _read(path, path)
    if data is None:
        raise SceneError(f"scene {path}: no such file; give the path of a mesh ({', '.join(SUFFIXES)})")
    if not data:
        raise SceneError(f"scene {path}: the file is empty (0 bytes); copy or export it again")
    if data.startswith(_LFS_POINTER):
        raise SceneError(f"scene {path}: it is a Git LFS pointer, not the mesh itself; run `git lfs pull` beside it")
    names = {".obj": _obj_names, ".ply": _ply_names}.get(path.suffix.lower(), _gltf_names)
    side: dict[str, bytes] = {}

    def read_side(name: str) -> bytes | None:
        if name not in side:
            content = _read(resolve_inside(path.parent, _relative(path, name), SceneError), path)
            if content is None:
                return None
            side[name] = content
        return side[name]

    images = []
    for name, is_image in names(path, data, read_side):
        read_side(name)
        if is_image:
            images.append(name)
    return MeshSource(path, data, side, tuple(images))


def decode_data_uri(path: Path, uri: str) -> bytes:
    """Bytes of a ``data:`` URI."""
    head, comma, body = uri.partition(",")
    try:
        if not comma:
            raise ValueError("it has no comma")
        if head.endswith(";base64"):
            return base64.b64decode(body, validate=True)
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


_AGAIN = "copy or export the file again"


def _kinds() -> str:
    return f"valid: {', '.join(SUFFIXES)} (convert it, for example with Blender)"


def _read(path: Path, owner: Path) -> bytes | None:
    try:
        if not stat.S_ISREG(mode := path.stat().st_mode) and not stat.S_ISDIR(mode):
            raise OSError(None, "it is a device or a pipe")
        return path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"scene {owner}: {path} cannot be read ({reason}); give a readable mesh file") from error


def _relative(path: Path, name: str) -> str:
    """Path of a side file; names of other machines' folders are refused by name, not taken for odd file names."""
    if "://" in name or name[1:3] in (":\\", ":/"):
        raise SceneError(f"scene {path}: it refers to {name!r} outside its folder; put that file beside the mesh")
    return name.replace("\\", "/")


def _gltf_names(path: Path, data: bytes, read: Callable[[str], bytes | None]) -> Iterator[tuple[str, bool]]:
    text: bytes | memoryview = split_glb(path, data)[0] if path.suffix.lower() == ".glb" else data
    document = parse_json(path, text)
    for kind in ("buffers", "images"):
        items = document.get(kind, [])
        for item in items if isinstance(items, list) else []:
            uri = item.get("uri") if isinstance(item, dict) else None
            if isinstance(uri, str) and not uri.startswith("data:"):
                yield urllib.parse.unquote(uri), kind == "images"


def _obj_names(path: Path, data: bytes, read: Callable[[str], bytes | None]) -> Iterator[tuple[str, bool]]:
    for line in data.splitlines():
        if line.startswith(b"mtllib "):
            library = _text(line[7:])
            yield library, False
            for material_line in (read(library) or b"").splitlines():
                keyword, _, rest = _text(material_line).partition(" ")
                if keyword.lower() == "map_kd":
                    yield rest.strip(), True


def _ply_names(path: Path, data: bytes, read: Callable[[str], bytes | None]) -> Iterator[tuple[str, bool]]:
    for line in data[: data.find(b"end_header") + 1].splitlines():
        text = _text(line)
        if text.lower().startswith("comment texturefile"):
            yield text[len("comment texturefile") :].strip(), True


def _text(line: bytes) -> str:
    return line.decode("utf-8", errors="replace").strip()
