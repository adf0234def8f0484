"""The files that a mesh file names: looked for under one root folder, and a word about each that is not found.

Names are written on all kinds of machines, so that a name is tried as it stands, in other spellings of its letters,
in another case, and at last by its base name beside the file that names it. Nothing is read from above the root: the
mesh's own folder, unless a wider one is given or a file named :data:`ROOT_MARK` lies in a folder above.
"""

from __future__ import annotations

import functools
import posixpath
import re
import stat
import urllib.parse
from collections.abc import Sequence
from pathlib import Path

from prnav.errors import SceneError
from prnav.scene.text_files import spellings

ROOT_MARK = ".prnav-root"
"""An empty file of this name makes its folder the root of all meshes under it."""


class SideFiles:
    """Files by the name that a mesh gives them.

    Attributes:
        found: their bytes.
        notes: what is worth a word: files that are not there, and others that were taken in their place.
    """

    def __init__(self, mesh: Path, root: Path | None = None) -> None:
        """Prepare to look beside a mesh.

        Args:
            mesh: the file that names others.
            root: folder that they may be in; it counts if the mesh is in it.
        """
        self.mesh = mesh
        self._folder = mesh.parent.resolve()
        self._root = side_root(mesh, root)
        self.found: dict[str, bytes] = {}
        self.notes: list[str] = []
        self._tried: set[str] = set()

    def read(self, names: Sequence[str], owner: str = "", quiet: bool = False, strict: bool = False) -> bytes | None:
        """Bytes of a file, None and a note where it is not there.

        Args:
            names: ways to read its name, the likeliest first; :func:`side_key` of that one is its key in ``found``.
            owner: key of the file that names it; the mesh itself by default.
            quiet: no note where there is none.
            strict: only where the name says, not by its base name elsewhere.
        """
        key = side_key(owner, names[0])
        if key in self.found:
            return self.found[key]
        if key in self._tried:
            return None
        path, exact = self._look(names, owner, strict)
        if path is not None:
            self.found[key] = read_file(path, self.mesh) or b""
            if not exact:
                self._note(f"{names[0]!r} is not there, {path.name!r} was read from {self._shown(path.parent)} instead")
            return self.found[key]
        if not quiet:
            self._tried.add(key)
            self._note(self._reason(names[0], owner))
        return None

    def outside(self, name: str, owner: str = "") -> bool:
        """Whether a name leads out of the root."""
        local = local_name(name)
        return local is not None and not self._inside(self._base(owner) / local)

    def _look(self, names: Sequence[str], owner: str, strict: bool) -> tuple[Path | None, bool]:
        """The file that is meant, and whether it is where the name says."""
        for name in names:
            local = local_name(name)
            if local is not None and (path := self._in_folder(self._base(owner), local)) is not None:
                return path, True
        for name in () if strict else names:
            plain = posixpath.basename(_slashes(name).rstrip("/"))
            for base in (self._base(owner), self._folder):
                if plain and (path := self._in_folder(base, plain)) is not None:
                    return path, local_name(name) is None
        return None, False

    def _in_folder(self, base: Path, name: str) -> Path | None:
        for spelled in spellings(name):
            path = base / spelled
            if self._inside(path) and _is_file(path):
                return path
        path = base
        for part in posixpath.normpath(name).split("/"):  # as file systems that do not tell cases apart would find it
            path = path / part if part == ".." else path / _folder_names(path).get(part.casefold(), part)
            if not self._inside(path):
                return None
        return path if _is_file(path) else None

    def _base(self, owner: str) -> Path:
        folder = posixpath.dirname(local_name(owner) or "")
        base = self._folder / folder
        return base if self._inside(base) else self._folder

    def _inside(self, path: Path) -> bool:
        try:
            return path.resolve().is_relative_to(self._root)
        except (OSError, ValueError, RuntimeError):
            return False

    def _reason(self, name: str, owner: str) -> str:
        lost = "what it colours stays plain"
        if self.outside(name, owner):
            where = "the mesh's folder" if self._root == self._folder else "the root folder"
            return (
                f"{name!r} lies outside {where} and is not read, {lost}; "
                f"give a folder that holds both (--data-root DIR), or put an empty file {ROOT_MARK} into it"
            )
        if re.match(r"[a-z][a-z0-9+.-]+://", name, re.IGNORECASE) and not name.lower().startswith("file:"):
            return f"{name!r} is not on this machine, {lost}"
        return f"{name!r} is missing, {lost}"

    def _shown(self, folder: Path) -> str:
        if folder.resolve() == self._folder:
            return "the mesh's own folder"
        return repr(folder.resolve().relative_to(self._root).as_posix())

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)


def side_root(mesh: Path, root: Path | None = None) -> Path:
    """Folder that the files of a mesh may be in: the root given, if it holds the mesh, a marked one, or its own."""
    folder = mesh.parent.resolve()
    if root is not None and folder.is_relative_to(root.resolve()):
        return root.resolve()
    for above in (folder, *folder.parents):
        if (above / ROOT_MARK).is_file():
            return above
    return folder


def side_key(owner: str, name: str) -> str:
    """Key of a file that another one names; ``owner`` is the key of that one, "" for the mesh."""
    return posixpath.join(posixpath.dirname(_slashes(owner)), name) if owner else name


def local_name(name: str) -> str | None:
    """A name as a relative path with slashes; None where it is absolute or on the network."""
    text = _slashes(name)
    if "\0" in text or text.startswith("/") or re.match(r"[a-zA-Z]:(/|$)|[a-zA-Z][a-zA-Z0-9+.-]+:/", text):
        return None
    return text


def read_file(path: Path, owner: Path) -> bytes | None:
    """Bytes of a file, None where there is none.

    Raises:
        SceneError: it cannot be read.
    """
    try:
        if not stat.S_ISREG(mode := path.stat().st_mode) and not stat.S_ISDIR(mode):
            raise OSError(None, "it is a device or a pipe")
        return path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"scene {owner}: {path} cannot be read ({reason}); give a readable mesh file") from error


def _slashes(name: str) -> str:
    if name.lower().startswith("file:"):
        name = "/" + urllib.parse.unquote(name[5:]).lstrip("/")
    return name.replace("\\", "/")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


@functools.lru_cache(maxsize=256)
def _listed(folder: Path, changed: int) -> dict[str, str]:
    """Names in a folder by their case-folded form; None-like empty where several share one."""
    names: dict[str, str] = {}
    twice = set()
    for entry in folder.iterdir():
        key = entry.name.casefold()
        if key in names:
            twice.add(key)
        names[key] = entry.name
    return {key: name for key, name in names.items() if key not in twice}


def _folder_names(folder: Path) -> dict[str, str]:
    try:
        return _listed(folder, folder.stat().st_mtime_ns)
    except (OSError, ValueError):
        return {}
