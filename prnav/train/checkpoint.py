"""Checkpoints: one safetensors file that holds a tree of arrays and plain values, written whole or not at all.

Arrays are tensors named by their path in the tree; the rest of the tree stands as JSON in the file's metadata. No
pickle: a checkpoint from a stranger cannot run code.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from prnav.aliases import JSON, Anything, Array, JSONObject
from prnav.errors import CheckpointError
from prnav.files import atomic_path

FORMAT = 1
SUFFIX = ".safetensors"
_NAME = re.compile(r"step-(\d+)\.safetensors")
_ARRAY = "__array__"

R = TypeVar("R")


def save_checkpoint(path: Path, tree: Mapping[str, JSON]) -> None:
    """Write nested dicts and lists of tensors, arrays, strings, numbers, booleans and None.

    Raises:
        CheckpointError: the disk is full, or lets nothing be written there; what stood there before still does.
    """
    arrays: dict[str, Array] = {}
    skeleton = _strip(tree, "", arrays)
    try:
        with atomic_path(path) as temporary:
            save_file(arrays, temporary, metadata={"format": str(FORMAT), "tree": json.dumps(skeleton)})
    except (OSError, SafetensorError) as error:
        raise CheckpointError(
            f"checkpoint {path}: cannot be written ({error}); make room on the disk, or choose another --run DIR"
        ) from error


def load_checkpoint(path: Path) -> JSONObject:
    """The tree that :func:`save_checkpoint` wrote; tensors come back as arrays, tuples as lists.

    Raises:
        CheckpointError: no such file, a broken one, or one of another version.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            if metadata.get("format") != str(FORMAT):
                raise CheckpointError(
                    f"checkpoint {path}: format {metadata.get('format')!r}, this version reads {FORMAT}; "
                    f"use the version of prnav that wrote it (see run.json beside it)"
                )
            tree: JSONObject = _fill(json.loads(metadata["tree"]), file.get_tensor)
            return tree
    except (OSError, SafetensorError, ValueError, KeyError) as error:
        raise CheckpointError(f"checkpoint {path}: cannot be read ({error})") from error


def _strip(node: Anything, path: str, arrays: dict[str, Array]) -> Anything:
    """``node`` with its arrays moved into ``arrays`` under their path."""
    if isinstance(node, torch.Tensor):
        node = node.detach().cpu().numpy()
    if isinstance(node, np.ndarray):
        arrays[path] = np.ascontiguousarray(node).reshape(node.shape)
        return {_ARRAY: path}
    if isinstance(node, Mapping):
        return {str(key): _strip(value, f"{path}/{key}", arrays) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [_strip(value, f"{path}/{index}", arrays) for index, value in enumerate(node)]
    if isinstance(node, np.generic):
        return node.item()
    if node is None or isinstance(node, str | int | float | bool):
        return node
    raise TypeError(f"a checkpoint cannot hold {path}, which is a {type(node).__name__}")


def _fill(node: Anything, array: Callable[[str], Array]) -> Anything:
    if isinstance(node, dict):
        if _ARRAY in node:
            return array(node[_ARRAY])
        return {key: _fill(value, array) for key, value in node.items()}
    if isinstance(node, list):
        return [_fill(value, array) for value in node]
    return node


def checkpoint_path(folder: Path, step: int, rank: int = 0) -> Path:
    """Where the checkpoint of that step stands; workers other than the first keep their environments beside it."""
    return folder / f"step-{step:012d}{f'.worker-{rank}' if rank else ''}{SUFFIX}"


def best_path(folder: Path) -> Path:
    """Where the policy stands that did best in validation."""
    return folder / f"best{SUFFIX}"


def list_checkpoints(folder: Path) -> list[Path]:
    """Checkpoints in a folder, oldest first."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if _NAME.fullmatch(path.name))


def prune_checkpoints(folder: Path, keep: int) -> None:
    """Delete all but the last ``keep``, and what was left of writing that was interrupted."""
    for path in list_checkpoints(folder)[:-keep]:
        path.unlink()
        for part in folder.glob(f"{path.stem}.worker-*{SUFFIX}"):
            part.unlink()
    for path in folder.glob(f".*.tmp{SUFFIX}"):
        path.unlink(missing_ok=True)


def load_latest(folder: Path, use: Callable[[JSONObject], R], warn: Callable[[str], None], workers: int = 1) -> R:
    """``use`` the tree of the newest checkpoint that can be read; ``warn`` of each newer one that cannot.

    With several ``workers``, all their parts must be readable.

    Raises:
        CheckpointError: there is none.
    """
    paths = list_checkpoints(folder)
    if not paths:
        raise CheckpointError(f"run {folder.parent}: no checkpoint in {folder.name}/; start it anew with another --run")
    for path in reversed(paths):
        try:
            tree = load_checkpoint(path)
            for rank in range(1, workers):
                load_checkpoint(path.with_name(f"{path.stem}.worker-{rank}{SUFFIX}"))
        except CheckpointError as error:
            if path == paths[0]:
                raise
            warn(f"{error}; falling back to the checkpoint before it")
            continue
        return use(tree)
    raise AssertionError("unreachable")


def load_policy_weights(policy: torch.nn.Module, weights: Mapping[str, Array], source: str) -> None:
    """Put the weights of a checkpoint's tree into a policy.

    Raises:
        CheckpointError: they are of another policy.
    """
    try:
        policy.load_state_dict({name: torch.from_numpy(value) for name, value in weights.items()})
    except RuntimeError as error:
        first = " ".join(str(error).split())[:200]
        raise CheckpointError(f"checkpoint {source}: its weights do not fit the configured policy ({first})") from error
