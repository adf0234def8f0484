"""A body given as a closed mesh: a robot's hull, for example.

Its surface is parametrised by the directions in which its centre sees it (a star-shaped body, which every convex one
is): a push turns the direction along a great circle, and the sensor is where the new direction leaves the body. Where
parts of a body hide behind others no such centre exists; a push then leads to the closest place of the surface, a map
that jumps where two places are equally close. N points, F triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Untyped
from prnav.errors import DesignError, PrnavError
from prnav.sensors.body import FREE, ON_SURFACE, Float64

_CHUNK = 1_000_000
"""Point-triangle pairs worked on at once."""


@dataclass(frozen=True, eq=False)
class MeshBody:
    """Closed triangle mesh in the body's frame, feet at the origin, y up, -z ahead; outward faces turn left."""

    vertices: Float64
    """(V, 3) [m]."""
    faces: NDArray[np.int64]
    """(F, 3)."""
    file: str = ""
    """Where it comes from, as a design file names it."""

    def __post_init__(self) -> None:
        vertices, faces = np.array(self.vertices, np.float64), np.array(self.faces, np.int64)
        where = f"body {self.file}" if self.file else "body"
        if vertices.ndim != 2 or vertices.shape[1:] != (3,) or faces.ndim != 2 or faces.shape[1:] != (3,):
            raise DesignError(f"{where}: vertices {vertices.shape} and faces {faces.shape} must be (V, 3) and (F, 3)")
        if not len(faces) or not np.isfinite(vertices).all():
            raise DesignError(f"{where}: it has no triangles, or vertices that are not finite; give a closed mesh")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise DesignError(f"{where}: a triangle names a vertex that is not there (0 to {len(vertices) - 1})")
        vertices, faces = _welded(vertices, faces)
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        there, times = np.unique(edges, axis=0, return_counts=True)
        if (times > 1).any() or len(np.unique(np.concatenate([there, there[:, ::-1]]), axis=0)) != len(there):
            raise DesignError(f"{where}: the mesh is not closed (an edge has no second triangle, or too many); mend it")
        corners = vertices[faces]
        volume = float(np.einsum("ij,ij->i", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]).sum()) / 6.0
        if abs(volume) < 1e-12:
            raise DesignError(f"{where}: the mesh has no volume; give a closed mesh in metres")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces if volume > 0.0 else faces[:, ::-1].copy())

    @property
    def shape(self) -> str:
        """The body in words."""
        size = self.vertices.max(axis=0) - self.vertices.min(axis=0)
        return f"mesh {self.file or ''} of {size[0]:g} x {size[1]:g} x {size[2]:g} m".replace("  ", " ")

    @property
    def height(self) -> float:
        """Of its highest vertex [m]."""
        return float(self.vertices[:, 1].max())

    @cached_property
    def centre(self) -> Float64 | None:
        """A place that sees all of the surface from inside, (3,), or None where the volume's centre does not."""
        corners = self._corners
        signed = np.einsum("ij,ij->i", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2])
        centre = (signed[:, None] * corners.sum(axis=1)).sum(axis=0) / (4.0 * signed.sum())
        inward = np.einsum("ij,ij->i", self._normals, corners[:, 0] - centre)
        return centre if (inward > 1e-9).all() else None

    def project(self, points: ArrayLike) -> Float64:
        """Closest points of the surface, (..., 3); points on it stay as they are."""
        p = np.asarray(points, np.float64)
        rows = p.reshape(-1, 3)
        step = max(1, _CHUNK // len(self.faces))
        found = [_closest(rows[start : start + step], self._corners) for start in range(0, len(rows), step)]
        closest = np.concatenate(found) if found else rows
        near = np.linalg.norm(closest - rows, axis=1) <= ON_SURFACE
        return np.where(near[:, None], rows, closest).reshape(p.shape)

    def distance(self, points: ArrayLike) -> Float64:
        """Distance to the surface [m], (...)."""
        p = np.asarray(points, np.float64)
        return np.linalg.norm(self.project(p) - p, axis=-1)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points lie strictly inside, (...): the surface winds around them (Van Oosterom and Strackee 1983)."""
        p = np.asarray(points, np.float64)
        result = []
        for row in p.reshape(-1, 3):
            a, b, c = np.moveaxis(self._corners - row, 1, 0)
            la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
            top = np.einsum("ij,ij->i", a, np.cross(b, c))
            dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
            angles = 2.0 * np.arctan2(top, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
            result.append(angles.sum() > 2.0 * np.pi)
        inside = np.array(result, np.bool_).reshape(p.shape[:-1])
        return inside & (self.distance(p) > ON_SURFACE)

    def move(self, points: ArrayLike, pushes: ArrayLike, held: tuple[bool, bool, bool] = FREE) -> Float64:
        """Places (..., 3) that sensors at ``points`` reach when pushed by ``pushes`` (..., 3) [m].

        Raises:
            DesignError: some of x, y and z are held and others are not: on a mesh they go together.
        """
        if any(held) and not all(held):
            raise DesignError("a mesh body holds x, y and z together; freeze all three or none of them")
        points, pushes = np.broadcast_arrays(np.asarray(points, np.float64), np.asarray(pushes, np.float64))
        if all(held):
            return points.copy()
        still = (pushes == 0.0).all(axis=-1, keepdims=True)
        if self.centre is None:
            return np.where(still, points, self.project(points + pushes))
        start = points - self.centre
        far = np.linalg.norm(start, axis=-1, keepdims=True)
        start = start / far
        across = (pushes - (pushes * start).sum(axis=-1, keepdims=True) * start) / far
        angle = np.linalg.norm(across, axis=-1, keepdims=True)
        towards = across / np.where(angle > 0.0, angle, 1.0)
        return np.where(still, points, self._seen(np.cos(angle) * start + np.sin(angle) * towards))

    def push(self, points: ArrayLike, targets: ArrayLike) -> Float64:
        """The push (..., 3) with which :meth:`move` takes ``points`` to ``targets``, the shorter way around."""
        points, targets = np.broadcast_arrays(np.asarray(points, np.float64), np.asarray(targets, np.float64))
        if self.centre is None:
            return targets - points
        start, end = points - self.centre, targets - self.centre
        far = np.linalg.norm(start, axis=-1, keepdims=True)
        start, end = start / far, end / np.linalg.norm(end, axis=-1, keepdims=True)
        along = (start * end).sum(axis=-1, keepdims=True)
        across = end - along * start
        size = np.linalg.norm(across, axis=-1, keepdims=True)
        return far * np.arctan2(size, along) * across / np.where(size > 0.0, size, 1.0)

    def sample(self, uniforms: Float64) -> Float64:
        """Places (n, 3) even over the surface, from numbers (n, 3) even over 0..1."""
        corners = self._corners
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        total = np.cumsum(areas) / areas.sum()
        face = np.minimum(np.searchsorted(total, uniforms[:, 0], side="right"), len(corners) - 1)
        root, second = np.sqrt(uniforms[:, 1:2]), uniforms[:, 2:3]
        a, b, c = np.moveaxis(corners[face], 1, 0)
        return (1.0 - root) * a + root * (1.0 - second) * b + root * second * c

    def outline(self) -> tuple[Float64, NDArray[np.int64]]:
        """The mesh itself."""
        return self.vertices, self.faces

    @cached_property
    def _corners(self) -> Float64:
        return self.vertices[self.faces]

    @cached_property
    def _normals(self) -> Float64:
        corners = self._corners
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)

    def _seen(self, directions: Float64) -> Float64:
        """Where unit directions (..., 3) from the centre leave the body, (..., 3)."""
        assert self.centre is not None
        rows = directions.reshape(-1, 3)
        spokes = self._corners - self.centre
        inverse = np.linalg.inv(np.moveaxis(spokes, 1, 2))  # corners as columns: weights of a direction
        places = np.empty_like(rows)
        step = max(1, _CHUNK // len(spokes))
        for first in range(0, len(rows), step):
            part = rows[first : first + step]
            weights = np.einsum("fij,nj->nfi", inverse, part)
            face = np.argmax(weights.min(axis=2) / np.abs(weights).sum(axis=2), axis=1)  # the one it is most inside of
            chosen = np.maximum(weights[np.arange(len(part)), face], 0.0)
            chosen /= chosen.sum(axis=1, keepdims=True)
            places[first : first + step] = np.einsum("ni,nij->nj", chosen, self._corners[face])
        return places.reshape(directions.shape)


def load_mesh_body(path: Path, name: str) -> MeshBody:
    """Body from an STL, OBJ, PLY or GLB file in metres, y up, feet at the origin.

    Raises:
        DesignError: it cannot be read, or is not closed.
    """
    import trimesh

    try:
        mesh: Untyped = trimesh.load(path, force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except PrnavError:
        raise
    except Exception as error:  # noqa: BLE001 (trimesh's readers raise whatever they like)
        raise DesignError(
            f"body {path}: cannot be read ({' '.join(str(error).split())}); give STL, OBJ, PLY or GLB"
        ) from error
    return MeshBody(vertices, faces, name)


def _welded(vertices: Float64, faces: NDArray[np.int64]) -> tuple[Float64, NDArray[np.int64]]:
    """The mesh with equal vertices made one, and without triangles that this made into lines."""
    unique, index = np.unique(vertices, axis=0, return_inverse=True)
    faces = index.reshape(-1)[faces]
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return unique, faces[proper].astype(np.int64)


def _closest(points: Float64, corners: Float64) -> Float64:
    """Closest points (N, 3) of triangles (F, 3, 3): the foot of the perpendicular, else a place on an edge."""
    best, result = np.full(len(points), np.inf), np.zeros_like(points)

    def offer(candidates: Float64, valid: NDArray[np.bool_]) -> None:
        away = np.where(valid, np.linalg.norm(candidates - points[:, None], axis=2), np.inf)
        face = np.argmin(away, axis=1)
        rows = np.arange(len(points))
        better = away[rows, face] < best
        best[better] = away[rows, face][better]
        result[better] = candidates[rows, face][better]

    for i in range(3):
        a, edge = corners[:, i], corners[:, (i + 1) % 3] - corners[:, i]
        length = np.maximum((edge**2).sum(axis=1), 1e-300)
        share = np.clip(np.einsum("nfi,fi->nf", points[:, None] - a, edge) / length, 0.0, 1.0)
        offer(a + share[..., None] * edge, np.ones(share.shape, np.bool_))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    square = np.maximum((normal**2).sum(axis=1), 1e-300)
    height = np.einsum("nfi,fi->nf", points[:, None] - corners[:, 0], normal) / square
    foot = points[:, None] - height[..., None] * normal
    inside = np.ones(height.shape, np.bool_)
    for i in range(3):
        edge = corners[:, (i + 1) % 3] - corners[:, i]
        inside &= np.einsum("nfi,fi->nf", foot - corners[:, i], np.cross(normal, edge)) >= 0.0
    offer(foot, inside)
    return result
