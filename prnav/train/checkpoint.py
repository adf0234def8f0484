"""Checkpoints: one safetensors file that holds a tree of arrays and plain values, written whole or not at all.

Arrays are tensors named by their path in the tree; the rest of the tree stands as JSON in the file's metadata. No
pickle: a checkpoint from a stranger cannot run code.
"""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from prnav.aliases import JSON, Array, JSONObject, Untyped
from prnav.errors import CheckpointError
from prnav.files import atomic_path
from prnav.schema import Anything, ListOf, MapOf, Number, Table, Text, fit

FORMAT = 1
SUFFIX = ".safetensors"
_NAME = re.compile(r"step-(\d+)\.safetensors")
_ARRAY = "__array__"

_BEFORE = "delete it to resume from the one before"

R = TypeVar("R")

_COUNT = Number(0, 1e18, whole=True)
_DIMENSION = Number(0, 1_000_000, whole=True)

TREE = Table(
    allowed={
        "version": Text(),
        "config_hash": Text(),
        "shapes": MapOf(ListOf(_DIMENSION)),
        "observations": MapOf(Table({"shape": ListOf(_DIMENSION)})),
        "policy": MapOf(Anything()),
        "counters": Table({"step": _COUNT, "updates": _COUNT, "episodes": _COUNT}),
        "workers": _COUNT,
        "learner": Table({"optimizer": Table({"state": MapOf(MapOf(Anything()))}), "generator": MapOf(Anything())}),
        "collector": MapOf(Anything()),
        "seconds": Number(0, 1e12),
        "recent": ListOf(MapOf(Number(finite=False))),
        "validated_step": _COUNT,
        "best": MapOf(Number()),
    }
)
"""The top of a checkpoint's tree; :func:`needed` says which of it must be there."""


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
            tree: JSONObject = _fill(json.loads(metadata["tree"]), functools.cache(file.get_tensor))
    except (OSError, SafetensorError, ValueError, KeyError, TypeError, RecursionError, MemoryError) as error:
        raise CheckpointError(f"checkpoint {path}: cannot be read ({error})") from error
    whole: JSONObject = fit(
        tree, TREE, CheckpointError, f"checkpoint {path}", "it is damaged; delete it to resume from the one before"
    )
    return whole


def needed(tree: Mapping[str, JSON], keys: Sequence[str], path: str | Path) -> None:
    """Hold a checkpoint to the parts that are about to be used.

    Raises:
        CheckpointError: one is missing.
    """
    for key in keys:
        if key not in tree:
            raise CheckpointError(f"checkpoint {path}: it lacks {key!r}; it is damaged: {_BEFORE}")


def check_like(
    found: Untyped, model: Untyped, path: str | Path, place: str = "", any_rows: Collection[str] = ()
) -> None:
    """Hold a part of a checkpoint to what this run would write: the same keys, types and shapes.

    Args:
        found: the part.
        model: the same of this run.
        path: the checkpoint, for errors.
        place: where in it the part stands.
        any_rows: names of arrays whose number of rows may differ.

    Raises:
        CheckpointError: something differs.
    """
    problem = None
    if isinstance(model, Mapping):
        if not isinstance(found, Mapping) or found.keys() != model.keys():
            keys = sorted(map(str, found.keys() ^ model.keys())) if isinstance(found, Mapping) else "all"
            problem = f"has other parts ({keys})"
        else:
            for key, value in model.items():
                check_like(found[key], value, path, f"{place}/{key}", any_rows)
    elif isinstance(model, torch.Tensor | np.ndarray):
        wanted = model.detach().cpu().numpy() if isinstance(model, torch.Tensor) else model
        first = 1 if place.rpartition("/")[2] in any_rows else 0
        if not isinstance(found, np.ndarray) or found.dtype != wanted.dtype:
            problem = f"is {getattr(found, 'dtype', type(found).__name__)} where {wanted.dtype} is needed"
        elif found.ndim != wanted.ndim or found.shape[first:] != wanted.shape[first:]:
            problem = f"is of shape {found.shape} where {wanted.shape} is needed"
        elif found.dtype.kind == "f" and np.isnan(found).any() and not np.isnan(wanted).any():
            problem = "is not a number somewhere"
    elif isinstance(model, list | tuple):
        if not isinstance(found, list) or len(found) != len(model):
            problem = f"is not a list of {len(model)}"
        else:
            for index, value in enumerate(model):
                check_like(found[index], value, path, f"{place}/{index}", any_rows)
    elif model is not None and (
        not isinstance(found, type(model)) or isinstance(found, bool) != isinstance(model, bool)
    ):
        problem = f"is {found!r:.40} where a {type(model).__name__} is needed"
    if problem is not None:
        raise CheckpointError(
            f"checkpoint {path}: its part {place.strip('/')} {problem}; it is damaged, or of another version: {_BEFORE}"
        )


def _strip(node: Untyped, path: str, arrays: dict[str, Array]) -> Untyped:
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


def _fill(node: Untyped, array: Callable[[str], Array]) -> Untyped:
    if isinstance(node, dict):
        if _ARRAY in node:
            if not isinstance(node[_ARRAY], str):
                raise ValueError("an array without a name")
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
    expected = policy.state_dict()
    for name, value in weights.items():
        tensor = torch.from_numpy(value) if isinstance(value, np.ndarray) else None
        if tensor is None or (name in expected and tensor.dtype != expected[name].dtype):
            kind = type(value).__name__ if tensor is None else str(tensor.dtype)
            raise CheckpointError(f"checkpoint {source}: its weights {name!r} are of type {kind}, not float32")
        if tensor.is_floating_point() and not bool(torch.isfinite(tensor).all()):
            raise CheckpointError(f"checkpoint {source}: its weights {name!r} are not finite; take another checkpoint")
    try:
        policy.load_state_dict({name: torch.from_numpy(value) for name, value in weights.items()})
    except RuntimeError as error:
        first = " ".join(str(error).split())[:200]
        raise CheckpointError(f"checkpoint {source}: its weights do not fit the configured policy ({first})") from error
