"""Scenes by name: built-in homes, mesh files, and the ids that episode files use."""

from __future__ import annotations

import functools
import hashlib
import json
import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path, PurePosixPath

import numpy as np

from prnav.aliases import Array
from prnav.cache import cache_key, cached_arrays, is_cached
from prnav.config import to_mapping
from prnav.errors import SceneError, SceneNote
from prnav.files import resolve_inside
from prnav.frames import to_y_up
from prnav.scene.load import check_limits, compose
from prnav.scene.mesh import SceneMesh
from prnav.scene.scene_file import AXES, SceneFile
from prnav.scene.source import MeshSource, read_source
from prnav.scene.texture_budget import MAX_TEXTURE_SIZE, TEXTURE_BUDGET, TextureLimits

SCENE_VERSION = 4
"""Version of the code from file to arrays: whatever changes the arrays of any file raises it, and caches are redone."""

SPLITS = ("train", "val", "test")

_BUILT_IN = "prhouses/"
_HABITAT_PREFIX = "data/scene_datasets/"


def load_scene(
    source: str | Path | SceneFile,
    up: str = "y",
    max_texture_size: int = MAX_TEXTURE_SIZE,
    texture_budget: int = TEXTURE_BUDGET,
    root: str | Path | None = None,
) -> SceneMesh:
    """A scene from a mesh file (.glb, .gltf, .obj, .ply) or a built-in id such as "prhouses/test/03".

    The arrays are kept in the cache, under a hash of the bytes of the file and all the files it names. What was not
    found or left out stands in the scene's notes and is given as warnings, whether it came from the cache or not.

    Args:
        source: path of a mesh file, a built-in id, or a scene of a data set
            (:meth:`prnav.scene.datasets.SceneSet.scene`).
        up: up axis of a mesh file, "y" (glTF's own) or "z" (Habitat's stage files). Built-in homes are y-up; a scene
            of a data set has its own frame.
        max_texture_size: longest side of a texture [texels]; bigger ones of a file are reduced by a power of two.
        texture_budget: texels of all textures of a file together; where there are more, those with the most texels per
            square metre of surface are reduced by powers of two. Built-in homes stay as they are.
        root: folder that the images and materials of a file may be in, above its own; it counts for meshes in it.

    Raises:
        SceneError: no such scene, or a file that cannot be used.
    """
    to_y_up((0.0, 0.0, 0.0), up)
    if isinstance(source, str) and source.startswith(_BUILT_IN):
        return _load_built_in(source)
    scene = source if isinstance(source, SceneFile) else SceneFile(Path(source).name, Path(source), AXES[up])
    limits = check_limits(scene.path, max_texture_size, texture_budget)
    stage, objects = _read_files(scene, root)
    files = [(file.digest(), file.notes) for file in (stage, *objects.values())]
    key = cache_key(SCENE_VERSION, files, scene.describe(), max_texture_size, texture_budget)
    mesh = _cached("scene", key, scene.path.name, lambda: compose(scene, stage, objects, limits))
    for note in mesh.notes:
        warnings.warn(f"scene {scene.path}: {note}", SceneNote, stacklevel=2)
    return mesh


def parse_scene(scene: SceneFile, root: str | Path | None = None) -> SceneMesh:
    """A scene from its files, past the cache.

    Raises:
        SceneError: a file that cannot be used.
    """
    return compose(scene, *_read_files(scene, root), TextureLimits())


def scene_ids(split: str) -> list[str]:
    """Ids of the built-in homes of a split: "train", "val" or "test".

    Raises:
        SceneError: no such split.
    """
    from prnav.scene.houses import SPLIT_SIZES

    if split not in SPLITS:
        raise SceneError(f"split {split!r} is not one of the built-in homes'; valid: {', '.join(SPLITS)}")
    return [f"{_BUILT_IN}{split}/{index:02d}" for index in range(SPLIT_SIZES[split])]


def ten_training_homes() -> list[str]:
    """Ids of ten of the training homes, drawn with a fixed seed, for tasks that train in few scenes as the paper's."""
    from prnav.scene.houses.manifest import ten_homes

    return ten_homes()


def resolve_scene(
    scene_id: str, data_root: str | Path | None = None, scene_files: Sequence[str | Path] = (), only: bool = False
) -> str | Path:
    """What to give to :func:`load_scene` for a scene id of an episode file.

    Built-in ids stand for themselves. Of ``scene_files``, the one counts whose path ends with most of the id's parts,
    its file name at least. Else the id is a path under ``data_root``, with Habitat's "data/scene_datasets/" in front
    or not; the root may be Habitat's "data" folder, too. With ``only``, the one scene file given stands for whatever
    the episodes call their one scene, if nothing else does.

    Raises:
        SceneError: nothing fits, two files fit alike, or the id leaves the root.
    """
    if scene_id.startswith(_BUILT_IN):
        _split_and_index(scene_id)
        return scene_id
    parts = PurePosixPath(scene_id.replace("\\", "/")).parts
    files = [Path(file) for file in scene_files]
    ranked = [(_common_ending(file.absolute().parts, parts), file) for file in files]
    best = max((count for count, _ in ranked), default=0)
    if best > 0:
        fitting = {file.absolute(): file for count, file in ranked if count == best}
        if len(fitting) > 1:
            listed = ", ".join(str(file) for file in fitting.values())
            raise SceneError(
                f"scene {scene_id!r} fits {len(fitting)} files alike ({listed}); give only one with --scene"
            )
        return _existing(next(iter(fitting.values())), scene_id)
    looked = [f"{len(files)} files given with --scene"] if files else []
    if data_root is not None:
        short = scene_id.removeprefix(_HABITAT_PREFIX)
        for name in dict.fromkeys((scene_id, short, f"scene_datasets/{short}")):
            path = resolve_inside(data_root, name, SceneError)
            if path.is_file():
                return path
        looked.append(f"the data root {data_root}")
    where = ", ".join(looked) or "no --data-root and no --scene given"
    if only and len(files) == 1:
        return _existing(files[0], scene_id)
    raise SceneError(
        f"scene {scene_id!r} is not found (looked in: {where}); name the folder that holds it with --data-root DIR, "
        f"or the mesh itself with --scene FILE"
    )


def is_built_in(scene_id: str) -> bool:
    """Whether an id is one of the built-in homes'."""
    return scene_id.startswith(_BUILT_IN)


def _read_files(scene: SceneFile, root: str | Path | None) -> tuple[MeshSource, dict[Path, MeshSource]]:
    """The bytes of a scene's stage and of its objects, each read once."""
    paths = dict.fromkeys(placed.path for placed in scene.objects)
    return read_source(scene.path, root), {path: read_source(path, root) for path in paths}


def _load_built_in(scene_id: str) -> SceneMesh:
    from prnav.scene.houses import HouseConfig, generate_house, split_seed

    seed = split_seed(*_split_and_index(scene_id))
    return _cached("houses", _house_key(seed), scene_id, lambda: generate_house(seed, HouseConfig()))


def _house_key(seed: int) -> str:
    from prnav.scene.houses import VERSION, HouseConfig

    return cache_key(SCENE_VERSION, VERSION, _houses_code(), seed, to_mapping(HouseConfig()))


def missing_homes(scene_ids: Sequence[str]) -> list[str]:
    """Those of ``scene_ids`` that are built-in homes and not in the cache yet."""
    from prnav.scene.houses import split_seed

    homes = [name for name in scene_ids if name.startswith(_BUILT_IN)]
    return [name for name in homes if not is_cached("houses", _house_key(split_seed(*_split_and_index(name))))]


def _split_and_index(scene_id: str) -> tuple[str, int]:
    from prnav.scene.houses import SPLIT_SIZES

    match = re.fullmatch(rf"{_BUILT_IN}({'|'.join(SPLITS)})/(\d\d)", scene_id)
    if match is None or int(match[2]) >= SPLIT_SIZES[match[1]]:
        ranges = ", ".join(f"{_BUILT_IN}{split}/00 to {SPLIT_SIZES[split] - 1:02d}" for split in SPLITS)
        raise SceneError(f"scene {scene_id!r} is no built-in home; valid: {ranges}")
    return match[1], int(match[2])


@functools.cache
def _houses_code() -> str:
    """Hash of the generator's source, so that a home from the cache is always what the code would make."""
    digest = hashlib.sha256()
    for path in sorted((Path(__file__).parent / "houses").glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _cached(kind: str, key: str, name: str, make: Callable[[], SceneMesh]) -> SceneMesh:
    def stored() -> dict[str, Array]:
        mesh = make()
        notes = np.frombuffer(json.dumps(mesh.notes).encode(), np.uint8)
        return {**mesh.to_arrays(), "notes": notes}

    arrays = cached_arrays(kind, key, stored)
    return SceneMesh.from_arrays(name, arrays, tuple(json.loads(arrays["notes"].tobytes())))


def _common_ending(path: Sequence[str], parts: Sequence[str]) -> int:
    count = 0
    for mine, wanted in zip(reversed(path), reversed(parts), strict=False):
        if mine != wanted:
            break
        count += 1
    return count


def _existing(path: Path, scene_id: str) -> Path:
    if not path.is_file():
        raise SceneError(f"scene {scene_id!r}: {path} is no file; give the path of its mesh with --scene FILE")
    return path
