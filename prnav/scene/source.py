"""The bytes of a mesh file and of the files it refers to, read once: what is hashed is what is loaded."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path

from prnav.errors import SceneError
from prnav.scene.glb import gltf_side_files
from prnav.scene.mtl import obj_side_files
from prnav.scene.ply_file import ply_side_files
from prnav.scene.side_files import SideFiles, read_file

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
        notes: files that it names and that were not found, or found elsewhere.
    """

    path: Path
    data: bytes = field(repr=False)
    side: dict[str, bytes] = field(repr=False)
    images: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

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


def read_source(path: str | Path, root: str | Path | None = None) -> MeshSource:
    """A mesh file with all the files it names.

    Args:
        path: the mesh.
        root: folder that the files it names may be in; by default the mesh's own
            (:func:`prnav.scene.side_files.side_root`).

    Raises:
        SceneError: it is missing, empty, of another kind, or its buffers are outside the root.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise SceneError(f"scene {path}: suffix {path.suffix!r} is not a mesh that can be read; {_kinds()}")
    data = read_file(path, path)
    if data is None:
        raise SceneError(f"scene {path}: no such file; give the path of a mesh ({', '.join(SUFFIXES)})")
    if not data:
        raise SceneError(f"scene {path}: the file is empty (0 bytes); copy or export it again")
    if data.startswith(_LFS_POINTER):
        raise SceneError(f"scene {path}: it is a Git LFS pointer, not the mesh itself; run `git lfs pull` beside it")
    side = SideFiles(path, None if root is None else Path(root))
    read = {".obj": obj_side_files, ".ply": ply_side_files}.get(path.suffix.lower(), gltf_side_files)
    images = read(path, data, side)
    return MeshSource(path, data, side.found, tuple(images), tuple(side.notes))


def _kinds() -> str:
    return f"valid: {', '.join(SUFFIXES)} (convert it, for example with Blender)"
