"""Parts of a scene, and how they become one mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.errors import SceneError
from prnav.scene.images import EncodedImage
from prnav.scene.mesh import SceneMesh
from prnav.scene.texture_budget import TextureLimits, build_atlas

MAX_TRIANGLES = 50_000_000
"""Most triangles of one scene, instances counted one by one."""

MAX_COORDINATE = 1e6
"""Largest coordinate [m] that is taken for one."""


@dataclass(frozen=True)
class Part:
    """Triangles with one texture.

    Attributes:
        vertices: shape (V, 3).
        faces: shape (F, 3), within 0..V-1.
        uvs: shape (V, 2), v down; None for zeros.
        colors: vertex colour times material colour, shape (V, 3) or (3,).
        texture: number from :meth:`Textures.add`, 0 for white.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    uvs: NDArray[np.float32] | None
    colors: NDArray[np.uint8]
    texture: int

    @classmethod
    def of(
        cls,
        vertices: Array,
        faces: Array,
        uvs: Array | None,
        colors: NDArray[np.float64],
        texture: int,
    ) -> Part:
        """Part of numbers of any type, colours as factors 0..1."""
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused with the mesh
            return cls(
                vertices.astype(np.float32),
                faces.astype(np.int32),
                None if uvs is None else uvs.astype(np.float32),
                np.floor(np.clip(np.nan_to_num(colors), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8),
                texture,
            )

    def moved(self, matrix: NDArray[np.float64]) -> Part:
        """The part under a matrix (4, 4); one that mirrors turns the triangles round, so that fronts stay fronts."""
        linear, offset = matrix[:3, :3], matrix[:3, 3]
        with np.errstate(all="ignore"):  # what is not finite is refused with the mesh
            vertices = (self.vertices.astype(np.float64) @ linear.T + offset).astype(np.float32)
            mirrored = np.linalg.det(linear) < 0.0
        faces = self.faces[:, ::-1] if mirrored else self.faces
        return Part(vertices, faces, self.uvs, self.colors, self.texture)


class Textures:
    """Images of one scene, encoded; equal ones are taken once."""

    def __init__(self) -> None:
        self.images: list[EncodedImage] = []
        self._numbers: dict[bytes, int] = {}

    def add(self, image: EncodedImage) -> int:
        """Number of a texture, from 1 on."""
        key = hashlib.sha256(image.data).digest() + image.alteration
        if key not in self._numbers:
            _ = image.size  # what is no image is refused where it is used first
            self.images.append(image)
            self._numbers[key] = len(self.images)
        return self._numbers[key]


def assemble(
    path: Path, parts: Sequence[Part], textures: Textures, limits: TextureLimits, notes: Sequence[str] = ()
) -> SceneMesh:
    """One mesh of all parts, which are in the y-up world frame [m] already, with notes on what it lacks.

    Raises:
        SceneError: no triangles, too many, coordinates that are not finite or beyond reason, or a broken image.
    """
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise SceneError(f"scene {path}: it has no triangles; give a mesh with faces (points and lines do not count)")
    check_triangles(path, sum(len(part.faces) for part in parts))
    count = sum(len(part.vertices) for part in parts)
    vertices, uvs = np.empty((count, 3), np.float32), np.zeros((count, 2), np.float32)
    colors = np.empty((count, 3), np.uint8)
    faces = np.empty((sum(len(part.faces) for part in parts), 3), np.int32)
    start = face = 0
    for part in parts:
        rows = slice(start, start + len(part.vertices))
        vertices[rows], colors[rows] = part.vertices, part.colors
        if part.uvs is not None:
            uvs[rows] = part.uvs
        np.add(part.faces, start, out=faces[face : face + len(part.faces)])
        start, face = rows.stop, face + len(part.faces)
    _check_coordinates(path, vertices)
    numbers = np.array([part.texture for part in parts], np.int32)
    face_texture = np.repeat(numbers, [len(part.faces) for part in parts])
    atlas = build_atlas(textures.images, limits, vertices, uvs, faces, face_texture)
    return SceneMesh(path.name, vertices, uvs, colors, faces, face_texture, atlas, tuple(dict.fromkeys(notes)))


def check_triangles(path: Path, count: int) -> None:
    """Refuse more triangles than memory is likely to hold."""
    if count > MAX_TRIANGLES:
        raise SceneError(f"scene {path}: {count} triangles; at most {MAX_TRIANGLES} are loaded: simplify the mesh")


def _check_coordinates(path: Path, vertices: NDArray[np.float32]) -> None:
    good = np.abs(vertices) <= MAX_COORDINATE  # false for NaN, too
    if good.all():
        return
    bad = np.flatnonzero(~good.all(axis=1))
    first = vertices[bad[0]]
    problem = "farther out than 1000 km" if np.isfinite(first).all() else "not finite"
    raise SceneError(
        f"scene {path}: {len(bad)} of {len(vertices)} vertices are {problem}, the first is number {bad[0]}: "
        f"{[float(f'{value:.6g}') for value in first]}; repair the mesh or export it again in metres"
    )
