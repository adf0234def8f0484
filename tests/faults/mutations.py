"""Files of ours, changed as a fault or a stranger might: parts dropped, doubled, of another type, shape or size."""

from __future__ import annotations

import copy
import io
import json
from pathlib import Path

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save_file

ODD = [
    None, True, -1, 0, 0.5, 10**30, -(10**18), 1e308, float("nan"), float("inf"), "", "x", "[/b]", "a\0b", "x" * 5000,
    [], {}, [[]], [None], {"": {}}, [1] * 1000, "../../x", "\ud800",
]  # fmt: skip


def places(node, path=()):
    """Paths to all nodes of a JSON value."""
    yield path
    if isinstance(node, dict | list):
        for key, value in node.items() if isinstance(node, dict) else enumerate(node):
            yield from places(value, (*path, key))


def mutated_json(value, rng):
    """A JSON value with one to three of its nodes dropped, doubled or replaced."""
    value = copy.deepcopy(value)
    for _ in range(int(rng.integers(1, 4))):
        paths = [path for path in places(value) if path]
        if not paths:
            return value
        path = paths[int(rng.integers(len(paths)))]
        owner = value
        for key in path[:-1]:
            owner = owner[key]
        kind = int(rng.integers(4))
        if kind == 0:
            del owner[path[-1]]
        elif kind == 1 and isinstance(owner, list):
            owner.append(copy.deepcopy(owner[path[-1]]))
        elif kind == 2 and isinstance(owner, dict):
            owner["another"] = owner.pop(path[-1])
        else:
            owner[path[-1]] = copy.deepcopy(ODD[int(rng.integers(len(ODD)))])
    return value


def mutated_bytes(data, rng):
    """Some bytes changed, cut off, or put in."""
    data = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        place = int(rng.integers(max(1, len(data))))
        kind = int(rng.integers(4))
        if kind == 0:
            data[place : place + 1] = rng.bytes(1)
        elif kind == 1:
            del data[place:]
        elif kind == 2:
            del data[place : place + int(rng.integers(1, 64))]
        else:
            data[place:place] = rng.bytes(int(rng.integers(1, 64)))
    return bytes(data)


def mutated_array(array, rng):
    """An array of another type, shape or content."""
    kind = int(rng.integers(8))
    if kind == 0:
        return array.astype(["f4", "f8", "i8", "u1", "U8", "?"][int(rng.integers(6))])
    if kind == 1:
        return array[..., None]
    if kind == 2:
        return array[: len(array) // 2] if array.ndim else array[None]
    if kind == 3:
        return np.concatenate([array, array]) if array.ndim else np.stack([array] * 3)
    if kind == 4:
        return array.reshape(-1)
    if kind == 5 and array.dtype.kind in "fiu" and array.size:
        changed = array.copy()
        odd = [0, 1, 127] if array.dtype.kind in "iu" else [np.nan, np.inf, -np.inf, 1e300, -1.0]
        with np.errstate(over="ignore"):
            changed.flat[int(rng.integers(array.size))] = odd[int(rng.integers(len(odd)))]
        return changed
    if kind == 6:
        return np.zeros((0,) * array.ndim, array.dtype)
    return -array if array.dtype.kind in "fi" else array[::-1] if array.ndim else array


def mutate_json_lines(path, rng):
    """One line of a file of JSON lines."""
    lines = path.read_text().splitlines()
    row = int(rng.integers(len(lines)))
    lines[row] = json.dumps(mutated_json(json.loads(lines[row]), rng))
    path.write_text("\n".join(lines) + "\n")


def mutate_json(path, rng):
    """A JSON file."""
    path.write_text(json.dumps(mutated_json(json.loads(path.read_text()), rng)))


def mutate_npz(path, rng):
    """One array of an archive, or which there are."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    name = list(arrays)[int(rng.integers(len(arrays)))]
    kind = int(rng.integers(10))
    if kind == 0:
        del arrays[name]
    elif kind == 1:
        arrays["another"] = arrays.pop(name)
    else:
        arrays[name] = mutated_array(arrays[name], rng)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    path.write_bytes(buffer.getvalue())


def mutate_checkpoint(path, rng):
    """A tensor of a checkpoint, or the tree that says what they are."""
    with safe_open(path, framework="numpy") as file:
        metadata = dict(file.metadata())
        arrays = {name: file.get_tensor(name) for name in file.keys()}
    if rng.integers(2):
        metadata["tree"] = json.dumps(mutated_json(json.loads(metadata["tree"]), rng))
    else:
        name = list(arrays)[int(rng.integers(len(arrays)))]
        if rng.integers(5) == 0:
            del arrays[name]
        else:
            changed = mutated_array(arrays[name], rng)
            arrays[name] = np.ascontiguousarray(changed if changed.dtype.kind != "U" else arrays[name].reshape(-1))
    save_file(arrays, path, metadata=metadata)


def mutate_text(path, rng):
    """The bytes of any file."""
    path.write_bytes(mutated_bytes(path.read_bytes(), rng))


def restore(path: Path, data: bytes) -> None:
    """The file as it was."""
    path.write_bytes(data)
