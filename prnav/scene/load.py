"""Mesh files of any kind to one :class:`SceneMesh`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.frames import to_y_up
from prnav.scene.gltf_scene import gltf_parts
from prnav.scene.mesh import SceneMesh
from prnav.scene.parts import Part, Textures, assemble, check_triangles
from prnav.scene.scene_file import AXES, PlacedObject, SceneFile
from prnav.scene.source import MeshSource
from prnav.scene.texture_budget import MAX_TEXTURE_SIZE, TEXTURE_BUDGET, TextureLimits


def load_mesh(
    source: MeshSource,
    up: str = "y",
    max_texture_size: int = MAX_TEXTURE_SIZE,
    texture_budget: int = TEXTURE_BUDGET,
) -> SceneMesh:
    """Mesh of a file that was read with :func:`prnav.scene.source.read_source`.

    Every part of the file's scene is kept, with its transform, texture, vertex colours and material colour; points and
    lines are not. Textures shared between parts are stored once and kept within the limits
    (:mod:`prnav.scene.texture_budget`).

    Args:
        source: the file's bytes.
        up: the file's up axis, "y" or "z"; z-up files are turned.
        max_texture_size: longest side of a texture [texels].
        texture_budget: texels of all textures together.

    Raises:
        SceneError: anything in the file that cannot be used.
    """
    to_y_up((0.0, 0.0, 0.0), up)  # a wrong axis is told before the work
    limits = check_limits(source.path, max_texture_size, texture_budget)
    return compose(SceneFile(source.path.name, source.path, AXES[up]), source, {}, limits)


def check_limits(path: str | Path, max_texture_size: int, texture_budget: int) -> TextureLimits:
    """The limits, if they are any.

    Raises:
        SceneError: one is below 1.
    """
    for name, value in (("max_texture_size", max_texture_size), ("texture_budget", texture_budget)):
        if value < 1:
            raise SceneError(f"scene {path}: {name} {value} is not a number of texels >= 1")
    return TextureLimits(max_texture_size, texture_budget)


def compose(scene: SceneFile, stage: MeshSource, objects: dict[Path, MeshSource], limits: TextureLimits) -> SceneMesh:
    """Mesh of a stage with the objects that stand in it.

    Args:
        scene: what stands where.
        stage: its stage's bytes.
        objects: the bytes of its objects' files.
        limits: of the textures.

    Raises:
        SceneError: a file that cannot be used, or too many triangles in all.
    """
    textures = Textures()
    notes: list[str] = []
    parts = _placed(read_parts(stage, textures, notes), scene.frame.matrix())
    files: dict[Path, list[Part]] = {}
    triangles = sum(len(part.faces) for part in parts)
    for placed in scene.objects:
        if placed.path not in files:
            own_notes: list[str] = []
            files[placed.path] = read_parts(objects[placed.path], textures, own_notes)
            notes += [f"{placed.path.name}: {note}" for note in own_notes]
        own = files[placed.path]
        triangles += sum(len(part.faces) for part in own)
        check_triangles(scene.path, triangles)
        if any(len(part.faces) for part in own):
            parts += _placed(own, placed.matrix(_bounds(own, placed)))
    return assemble(scene.path, parts, textures, limits, notes)


def read_parts(source: MeshSource, textures: Textures, notes: list[str]) -> list[Part]:
    """Parts of a mesh file in its own frame; its images go into ``textures``, what it lacks into ``notes``."""
    notes += source.notes
    if source.suffix == ".obj":
        from prnav.scene.obj import obj_parts  # compiled: not for those who read no OBJ

        return obj_parts(source, textures, notes)
    if source.suffix == ".ply":
        from prnav.scene.ply import ply_parts

        return ply_parts(source, textures, notes)
    return gltf_parts(source, textures, notes)


def _placed(parts: Sequence[Part], matrix: NDArray[np.float64]) -> list[Part]:
    return list(parts) if np.array_equal(matrix, np.eye(4)) else [part.moved(matrix) for part in parts]


def _bounds(parts: Sequence[Part], placed: PlacedObject) -> NDArray[np.float64]:
    """Corners of a mesh in its object's frame, (2, 3)."""
    points = np.concatenate([_placed([part], placed.frame.matrix())[0].vertices for part in parts if len(part.faces)])
    with np.errstate(invalid="ignore"):  # what is not finite is refused with the mesh
        return np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)
