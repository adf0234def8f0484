"""Surfaces of a model's geoms on which sensors sit, each a :class:`prnav.sensors.body.BodySurface` in its body's frame.

Spheres, ellipsoids and boxes are parametrised by the direction in which their centre sees a place: a push turns it
along a great circle, by the push's part across it over the distance from the centre, and the sensor is where the new
direction leaves the shape. Capsules and cylinders are surfaces of revolution: a push's part along the meridian moves a
sensor along it, over the ends and down the other side, in true metres; the part across it turns the sensor around the
axis, in metres along the widest circumference. Both maps have exact inverses (:meth:`push`), which take the shorter way
around. What points into the body has no effect.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.domains.control.appearance import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE
from prnav.domains.control.engine import mujoco
from prnav.domains.control.frames import rotation
from prnav.errors import DesignError
from prnav.sensors.body import FREE

Float64 = NDArray[np.float64]

_WORDS = {SPHERE: "sphere", CAPSULE: "capsule", ELLIPSOID: "ellipsoid", CYLINDER: "cylinder", BOX: "box"}
_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class GeomSurface:
    """The surface of one geom. Points are (..., 3) [m] in its body's frame."""

    kind: int
    """MuJoCo's number of the shape."""
    size: Float64
    """Half lengths as MuJoCo has them [m], (3,)."""
    centre: Float64
    """Of the geom in its body's frame [m], (3,)."""
    axes: Float64
    """Of the geom in its body's frame, as columns, (3, 3)."""

    @property
    def shape(self) -> str:
        """The surface in words."""
        word, (a, b, c) = _WORDS[self.kind], (f"{value:g}" for value in self.size)
        if self.kind == SPHERE:
            return f"{word} of radius {a} m"
        if self.kind in (CAPSULE, CYLINDER):
            return f"{word} of radius {a} m, half length {b} m"
        return f"{word} of half lengths {a}, {b}, {c} m"

    @property
    def height(self) -> float:
        """Of its highest place over the body's origin [m]."""
        return float(self.outline()[0][:, 2].max())

    def project(self, points: ArrayLike) -> Float64:
        """Closest places of the surface (..., 3), by the ray from the centre for ellipsoids; those on it stay."""
        p = self._local(points)
        on = self._project(p)
        return np.where(
            (np.linalg.norm(on - p, axis=-1) <= 1e-9)[..., None], np.asarray(points, np.float64), self._body(on)
        )

    def distance(self, points: ArrayLike) -> Float64:
        """Distance to the surface [m], (...)."""
        p = self._local(points)
        return np.asarray(np.linalg.norm(self._project(p) - p, axis=-1))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether places lie strictly inside, (...)."""
        p, (a, b, _) = self._local(points), self.size
        if self.kind == BOX:
            return np.asarray((np.abs(p) < self.size).all(axis=-1))
        if self.kind == CYLINDER:
            return np.asarray((np.hypot(p[..., 0], p[..., 1]) < a) & (np.abs(p[..., 2]) < b))
        if self.kind == CAPSULE:
            rest = p[..., 2] - np.clip(p[..., 2], -b, b)
            return np.asarray(np.sqrt(p[..., 0] ** 2 + p[..., 1] ** 2 + rest**2) < a)
        return np.asarray(((p / self._radii) ** 2).sum(axis=-1) < 1.0)

    def move(self, points: ArrayLike, pushes: ArrayLike, held: tuple[bool, bool, bool] = FREE) -> Float64:
        """Where sensors at ``points`` (..., 3) on the surface get to when pushed by ``pushes`` (..., 3) [m].

        Raises:
            DesignError: one or two of x, y and z are held; on such a surface a place is held whole or not at all.
        """
        points, pushes = np.broadcast_arrays(np.asarray(points, np.float64), np.asarray(pushes, np.float64))
        if all(held):
            return np.array(points)
        if any(held):
            raise DesignError("on the bodies of a model x, y and z are frozen together or not at all")
        p, push = self._local(points), _turned_by(pushes, self.axes.T)
        if self.kind not in (CAPSULE, CYLINDER):
            moved = self._turned(p, push)
        else:
            along, turn = self._meridian(p)
            meridian, parallel = self._tangents(along, turn)
            moved = self._place(
                along + (push * meridian).sum(axis=-1), turn + (push * parallel).sum(axis=-1) / self.size[0]
            )
        still = (pushes == 0.0).all(axis=-1)
        return np.where(still[..., None], points, self._body(moved))

    def push(self, points: ArrayLike, targets: ArrayLike) -> Float64:
        """Pushes (..., 3) [m] with which :meth:`move` takes ``points`` to ``targets``, both on the surface."""
        points, targets = np.broadcast_arrays(np.asarray(points, np.float64), np.asarray(targets, np.float64))
        p, q = self._local(points), self._local(targets)
        if self.kind not in (CAPSULE, CYLINDER):
            length = np.linalg.norm(p, axis=-1, keepdims=True)
            ahead = p / length
            across = q - (q * ahead).sum(axis=-1, keepdims=True) * ahead
            reach = np.linalg.norm(across, axis=-1, keepdims=True)
            angle = np.arctan2(reach, (q * ahead).sum(axis=-1, keepdims=True))
            way = np.where(reach > _TINY, across / np.where(reach > _TINY, reach, 1.0), _perpendicular(ahead))
            push = angle * length * way
        else:
            push = self._revolved_push(p, q)
        return _turned_by(push, self.axes)

    def sample(self, uniforms: Float64) -> Float64:
        """Places (n, 3) even over the surface (over directions for ellipsoids), from numbers (n, 3) even over 0..1."""
        a, b, _ = self.size
        turn = 2.0 * np.pi * uniforms[:, 1]
        if self.kind in (CAPSULE, CYLINDER):
            side, end = 4.0 * np.pi * a * b, (4.0 if self.kind == CAPSULE else 2.0) * np.pi * a * a
            on_side = uniforms[:, 0] * (side + end) < side
            z = 2.0 * uniforms[:, 2] - 1.0
            lift = np.where(z < 0.0, -b, b)
            reach = a * np.sqrt(1.0 - z * z) if self.kind == CAPSULE else a * np.sqrt(np.abs(z))
            reach = np.where(on_side, a, reach)
            height = np.where(on_side, b * z, lift + (a * z if self.kind == CAPSULE else 0.0))
            return self._body(np.stack([reach * np.cos(turn), reach * np.sin(turn), height], axis=-1))
        if self.kind == BOX:
            return self._body(self._sample_box(uniforms))
        z = 2.0 * uniforms[:, 2] - 1.0
        reach = np.sqrt(1.0 - z * z)
        return self._body(np.stack([reach * np.cos(turn), reach * np.sin(turn), z], axis=-1) * self._radii)

    def outline(self) -> tuple[Float64, NDArray[np.int64]]:
        """Vertices (V, 3) and triangles (F, 3) to draw."""
        across, around = 25, 32
        turn, share = np.meshgrid(np.linspace(-np.pi, np.pi, around + 1), np.linspace(0.0, 1.0, across), indexing="ij")
        if self.kind in (CAPSULE, CYLINDER):
            places = self._place(share * self._length, turn)
        else:
            tilt = np.pi * (share - 0.5)
            ways = np.stack([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)], axis=-1)
            places = ways * self._exit(ways)[..., None]
        index = np.arange(places.shape[0] * across).reshape(-1, across)
        a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
        faces = np.concatenate([np.stack(x, axis=-1).reshape(-1, 3) for x in ((a, b, c), (a, c, d))])
        return self._body(places.reshape(-1, 3)), faces

    def _local(self, points: ArrayLike) -> Float64:
        return _turned_by(np.asarray(points, np.float64) - self.centre, self.axes.T)

    def _body(self, points: Float64) -> Float64:
        return _turned_by(points, self.axes) + self.centre

    @property
    def _radii(self) -> Float64:
        return np.full(3, self.size[0]) if self.kind == SPHERE else self.size

    def _exit(self, ways: Float64) -> Float64:
        """Distance from the centre at which directions (..., 3) of length 1 leave a sphere, ellipsoid or box, (...)."""
        if self.kind == BOX:
            with np.errstate(divide="ignore"):
                return np.asarray((self.size / np.abs(ways)).min(axis=-1))
        return np.asarray(1.0 / np.sqrt(((ways / self._radii) ** 2).sum(axis=-1)))

    def _turned(self, p: Float64, push: Float64) -> Float64:
        length = np.linalg.norm(p, axis=-1, keepdims=True)
        ahead = p / length
        across = push - (push * ahead).sum(axis=-1, keepdims=True) * ahead
        reach = np.linalg.norm(across, axis=-1, keepdims=True)
        way = across / np.where(reach > 0.0, reach, 1.0)
        ways = np.cos(reach / length) * ahead + np.sin(reach / length) * way
        return ways * self._exit(ways)[..., None]

    def _project(self, p: Float64) -> Float64:
        a, b, _ = self.size
        if self.kind == BOX:
            inside = np.asarray((np.abs(p) < self.size).all(axis=-1))
            nearest = np.argmin(self.size - np.abs(p), axis=-1)
            out = np.where(np.arange(3) == nearest[..., None], np.where(p < 0.0, -self.size, self.size), p)
            return np.where(inside[..., None], out, np.clip(p, -self.size, self.size))
        if self.kind in (SPHERE, ELLIPSOID):
            length = np.linalg.norm(p, axis=-1, keepdims=True)
            ways = np.where(length > 0.0, p / np.where(length > 0.0, length, 1.0), np.array([1.0, 0.0, 0.0]))
            return ways * self._exit(ways)[..., None]
        reach = np.hypot(p[..., 0], p[..., 1])
        turn = np.arctan2(p[..., 1], p[..., 0])
        if self.kind == CAPSULE:
            level = np.clip(p[..., 2], -b, b)
            rest = p[..., 2] - level
            away = np.hypot(reach, rest)
            safe = np.where(away > 0.0, away, 1.0)
            reach, height = np.where(away > 0.0, a * reach / safe, a), level + a * rest / safe
        else:
            by_end = (reach < a) & ((np.abs(p[..., 2]) >= b) | (b - np.abs(p[..., 2]) < a - reach))
            height = np.where(by_end, np.where(p[..., 2] < 0.0, -b, b), np.clip(p[..., 2], -b, b))
            reach = np.where(by_end, reach, a)
        return np.stack([reach * np.cos(turn), reach * np.sin(turn), height], axis=-1)

    @property
    def _length(self) -> float:
        """Of a meridian of a capsule or cylinder, from pole to pole [m]."""
        a, b = float(self.size[0]), float(self.size[1])
        return 2.0 * b + (math.pi * a if self.kind == CAPSULE else 2.0 * a)

    def _meridian(self, p: Float64) -> tuple[Float64, Float64]:
        """Way along the meridian from the lower pole [m] and turn around the axis [rad] of places on the surface."""
        a, b, _ = self.size
        reach, z = np.hypot(p[..., 0], p[..., 1]), p[..., 2]
        if self.kind == CAPSULE:
            rest = z - np.clip(z, -b, b)
            along = a * (np.arctan2(rest, reach) + 0.5 * np.pi) + np.clip(z, -b, b) + b
        else:
            end = np.abs(z) >= b - 1e-9
            along = np.where(end, np.where(z < 0.0, reach, 2.0 * b + 2.0 * a - reach), a + b + z)
        return along, np.arctan2(p[..., 1], p[..., 0])

    def _profile(self, along: Float64) -> tuple[Float64, Float64, Float64, Float64]:
        """Distance from the axis, height, and how both change along the meridian."""
        a, b, _ = self.size
        end = a * (0.5 * np.pi) if self.kind == CAPSULE else a
        low, high = along < end, along > end + 2.0 * b
        if self.kind == CAPSULE:
            tilt = np.where(low, along / a - 0.5 * np.pi, np.where(high, (along - end - 2.0 * b) / a, 0.0))
            height = np.clip(along - end, 0.0, 2.0 * b) - b + a * np.sin(tilt)
            return a * np.cos(tilt), height, -np.sin(tilt), np.cos(tilt)
        reach = np.where(low, along, np.where(high, 2.0 * a + 2.0 * b - along, a))
        slope = np.where(low, 1.0, np.where(high, -1.0, 0.0))
        return reach, np.clip(along - end, 0.0, 2.0 * b) - b, slope, np.where(low | high, 0.0, 1.0)

    def _place(self, along: Float64, turn: Float64) -> Float64:
        """The place at a way along the meridian, which goes on over the poles, and a turn."""
        full = 2.0 * self._length
        along = along - full * np.floor(along / full)
        beyond = along > self._length
        along, turn = np.where(beyond, full - along, along), np.where(beyond, turn + np.pi, turn)
        reach, height, _, _ = self._profile(along)
        return np.stack([reach * np.cos(turn), reach * np.sin(turn), height], axis=-1)

    def _tangents(self, along: Float64, turn: Float64) -> tuple[Float64, Float64]:
        """Unit vectors along the meridian and around the axis, (..., 3)."""
        _, _, outward, upward = self._profile(along)
        c, s = np.cos(turn), np.sin(turn)
        return np.stack([outward * c, outward * s, upward], axis=-1), np.stack([-s, c, np.zeros_like(c)], axis=-1)

    def _revolved_push(self, p: Float64, q: Float64) -> Float64:
        (along, turn), (goal, heading) = self._meridian(p), self._meridian(q)
        ways = [  # straight, or over the lower or the upper pole
            (goal - along, _wrapped(heading - turn)),
            (-goal - along, _wrapped(heading + np.pi - turn)),
            (2.0 * self._length - goal - along, _wrapped(heading + np.pi - turn)),
        ]
        steps = np.stack([way for way, _ in ways])
        turns = np.stack([around for _, around in ways]) * self.size[0]
        best = np.argmin(np.hypot(steps, turns), axis=0)[None]
        step, around = (np.take_along_axis(x, best, axis=0)[0] for x in (steps, turns))
        meridian, parallel = self._tangents(along, turn)
        return step[..., None] * meridian + around[..., None] * parallel

    def _sample_box(self, uniforms: Float64) -> Float64:
        a, b, c = self.size
        areas = np.repeat([b * c, a * c, a * b], 2)
        face = np.searchsorted(np.cumsum(areas) / areas.sum(), uniforms[:, 0], side="right").clip(0, 5)
        axis, sign = face // 2, np.where(face % 2, 1.0, -1.0)
        spread = 2.0 * uniforms[:, 1:] - 1.0
        places = np.empty((len(uniforms), 3))
        rows = np.arange(len(uniforms))
        places[rows, axis] = sign
        places[rows, (axis + 1) % 3], places[rows, (axis + 2) % 3] = spread.T
        return places * self.size


def geom_surface(model: mujoco.MjModel, geom: str) -> GeomSurface:
    """Surface of a geom of a compiled model.

    Raises:
        DesignError: the model has no such geom, or it is of a shape that sensors cannot sit on.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
    if number < 0 or int(model.geom_type[number]) not in _WORDS:
        raise DesignError(
            f"geom {geom!r} is not one that sensors can sit on; valid shapes: {', '.join(_WORDS.values())}"
        )
    return GeomSurface(
        int(model.geom_type[number]),
        np.array(model.geom_size[number], np.float64),
        np.array(model.geom_pos[number], np.float64),
        rotation(model.geom_quat[number]),
    )


def _turned_by(vectors: Float64, matrix: Float64) -> Float64:
    """Matrix times vectors (..., 3), written out: one row's bits must not depend on how many there are."""
    x, y, z = vectors[..., 0, None], vectors[..., 1, None], vectors[..., 2, None]
    return np.asarray(matrix[:, 0] * x + matrix[:, 1] * y + matrix[:, 2] * z)


def _wrapped(angle: Float64) -> Float64:
    """Angle in -pi..pi."""
    return np.asarray(np.arctan2(np.sin(angle), np.cos(angle)))


def _perpendicular(ways: Float64) -> Float64:
    """A direction across each of ``ways`` (..., 3)."""
    other = np.where(np.abs(ways[..., :1]) < 0.6, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    across = np.cross(ways, other)
    return np.asarray(across / np.linalg.norm(across, axis=-1, keepdims=True))
