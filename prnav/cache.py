"""Derived data on disk: arrays under a key that says everything they were made from.

A key is the hash of the input's content, the settings and the version of the code that derives them, so that nothing
is ever stale. Entries are ``.npz`` files without pickles, written atomically: two processes that start at once do the
work twice and write the same bytes. A broken entry is made anew. The folder is ``$PRNAV_CACHE``, else
``$XDG_CACHE_HOME/prnav``, else ``~/.cache/prnav``; it may be deleted at any time.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from prnav.aliases import Array, Untyped
from prnav.files import atomic_path
from prnav.stored_arrays import BROKEN, read_arrays

Arrays = dict[str, Array]


def cache_dir() -> Path:
    """The cache's folder (it may not exist yet)."""
    if configured := os.environ.get("PRNAV_CACHE"):
        return Path(configured)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "prnav"


def hash_arrays(arrays: Mapping[str, Array]) -> str:
    """SHA-256 in hex over names, types, shapes and little-endian bytes of arrays, in name order."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        array = array.astype(array.dtype.newbyteorder("<"), copy=False)
        digest.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def cache_key(*parts: Untyped) -> str:
    """Key from JSON-able parts (strings, numbers, dicts), as hex."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:32]


def cached_arrays(kind: str, key: str, compute: Callable[[], Arrays]) -> Arrays:
    """Arrays stored under ``kind/key``, computed and stored where they are missing.

    A cache that cannot be written (a full disk, a read-only home) costs time, never the result.
    """
    path = _path(kind, key)
    try:
        return read_arrays(path, limited=False)
    except BROKEN:
        pass  # missing or broken: made anew below
    arrays = compute()
    try:
        with atomic_path(path) as temporary:
            with open(temporary, "wb") as file:
                np.savez(file, **arrays)  # type: ignore[arg-type]
    except OSError:
        pass  # nowhere to store: the result stands
    return arrays


def is_cached(kind: str, key: str) -> bool:
    """Whether :func:`cached_arrays` has a file for ``kind/key``."""
    return _path(kind, key).is_file()


def _path(kind: str, key: str) -> Path:
    return cache_dir() / kind / f"{key}.npz"
