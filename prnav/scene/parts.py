"""Parts of a scene, and how they become one mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.errors import SceneError
from prnav.frames import to_y_up
from prnav.scene.atlas import TextureAtlas
from prnav.scene.mesh import SceneMesh

MAX_TRIANGLES = 50_000_000
"""Most triangles of one scene, instances counted one by one."""

MAX_COORDINATE = 1e6
"""Largest coordinate [m] that is taken for one."""


@dataclass(frozen=True)
class Part:
    """Triangles with one texture, in the file's frame.

    Attributes:
        vertices: shape (V, 3) [m].
        faces: shape (F, 3), within 0..V-1.
        uvs: shape (V, 2), v down; None for zeros.
        colors: factors 0..1, shape (V, 3) or (3,).
        texture: number from :meth:`Textures.add`, 0 for white.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    uvs: NDArray[np.float64] | None
    colors: NDArray[np.float64]
    texture: int


class Textures:
    """Images of one scene; equal ones are stored once."""

    def __init__(self) -> None:
        self.images: list[NDArray[np.uint8]] = []
        self._numbers: dict[tuple[str, tuple[int, ...]], int] = {}

    def add(self, texels: NDArray[np.uint8]) -> int:
        """Number of a texture (H, W, 4), from 1 on."""
        key = (hashlib.sha256(texels.tobytes()).hexdigest(), texels.shape)
        if key not in self._numbers:
            self.images.append(texels)
            self._numbers[key] = len(self.images)
        return self._numbers[key]


def assemble(path: Path, parts: Sequence[Part], textures: Textures, up: str) -> SceneMesh:
    """One mesh of all parts, in the y-up world frame.

    Raises:
        SceneError: no triangles, too many, or coordinates that are not finite or beyond reason.
    """
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise SceneError(f"scene {path}: it has no triangles; give a mesh with faces (points and lines do not count)")
    check_triangles(path, sum(len(part.faces) for part in parts))
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = to_y_up(np.concatenate([part.vertices for part in parts]), up)
    _check_coordinates(path, vertices)
    uvs = [np.zeros((len(part.vertices), 2)) if part.uvs is None else part.uvs for part in parts]
    colors = [np.broadcast_to(part.colors, (len(part.vertices), 3)) for part in parts]
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts[:-1], strict=True)])
    counts = [len(part.faces) for part in parts]
    with np.errstate(over="ignore"):  # what becomes infinite is refused with the mesh
        all_uvs = np.concatenate(uvs).astype(np.float32)
    return SceneMesh(
        name=path.name,
        vertices=vertices.astype(np.float32),
        uvs=all_uvs,
        colors=np.floor(np.clip(np.concatenate(colors), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8),
        faces=faces.astype(np.int32),
        face_texture=np.repeat(np.array([part.texture for part in parts], np.int32), counts),
        atlas=TextureAtlas.from_images(textures.images),
    )


def check_triangles(path: Path, count: int) -> None:
    """Refuse more triangles than memory is likely to hold."""
    if count > MAX_TRIANGLES:
        raise SceneError(f"scene {path}: {count} triangles; at most {MAX_TRIANGLES} are loaded: simplify the mesh")


def _check_coordinates(path: Path, vertices: NDArray[np.float64]) -> None:
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
