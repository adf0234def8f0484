"""The body that sensors sit on, and how they move over its surface.

A body answers the same few questions whatever its shape (:class:`BodySurface`): the closest place on it, whether a
point is inside, where a sensor gets to when it is pushed (:meth:`BodySurface.move`) and which push leads from one place
to another (:meth:`BodySurface.push`, its inverse). :class:`Body` is the upright cylinder;
:class:`prnav.sensors.mesh_body.MeshBody` any closed mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import DesignError

Float64 = NDArray[np.float64]

ON_SURFACE = 1e-9
"""Points this close to the side [m] count as on it and stay as they are: rounding must not move a sensor twice."""

FREE = (False, False, False)
"""No coordinate held."""


class BodySurface(Protocol):
    """What a design needs of a body; points are (..., 3) [m] in its frame: feet at the origin, y up, -z ahead."""

    @property
    def shape(self) -> str:
        """The body in words, for messages."""
        ...

    @property
    def height(self) -> float:
        """Of its highest place [m]."""
        ...

    def project(self, points: ArrayLike) -> Float64:
        """Closest points of the surface (..., 3); points on it stay as they are."""
        ...

    def distance(self, points: ArrayLike) -> Float64:
        """Distance to the surface [m], (...)."""
        ...

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points lie strictly inside, (...)."""
        ...

    def move(self, points: ArrayLike, pushes: ArrayLike, held: tuple[bool, bool, bool] = FREE) -> Float64:
        """Where sensors at ``points`` (..., 3) on the surface get to when pushed by ``pushes`` (..., 3) [m]."""
        ...

    def push(self, points: ArrayLike, targets: ArrayLike) -> Float64:
        """Pushes (..., 3) [m] with which :meth:`move` takes ``points`` to ``targets``, both on the surface."""
        ...

    def sample(self, uniforms: Float64) -> Float64:
        """Places (n, 3) even over the surface, from numbers (n, 3) even over 0..1."""
        ...

    def outline(self) -> tuple[Float64, NDArray[np.int64]]:
        """Vertices (V, 3) and triangles (F, 3) to draw."""
        ...


@dataclass(frozen=True)
class Body:
    """Upright cylinder, feet at the origin; sensors may sit on its side and on its top, not on its sole."""

    radius: float = 0.1
    """Radius [m]."""
    height: float = 1.5
    """Height [m]."""

    def __post_init__(self) -> None:
        for name in ("radius", "height"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise DesignError(f"body: {name} is {value!r}; it must be a positive number of metres")

    @property
    def shape(self) -> str:
        """The body in words."""
        return f"cylinder of radius {self.radius:g} m, height {self.height:g} m"

    def project(self, points: ArrayLike) -> Float64:
        """Closest points of the surface (side and top), shape (..., 3); points on it stay as they are.

        A point outside goes to the closest point of the cylinder; one below the sole to the lower rim of the side
        next to it. A point inside goes straight out through the side or the top, whichever is nearer, through the
        side if both are as near; from the axis it goes ahead (-z).
        """
        p = np.asarray(points, dtype=np.float64)
        x, y, z = p[..., 0], p[..., 1], p[..., 2]
        reach = np.hypot(x, z)
        on_axis = reach == 0.0
        safe = np.where(on_axis, 1.0, reach)
        level = np.clip(y, 0.0, self.height)
        above = y >= self.height  # over the top: onto it, or onto its rim
        inside = (y > 0.0) & ~above & (reach < self.radius)
        to_top = above | (inside & (self.height - y < self.radius - reach))
        new_reach = np.where(to_top, np.minimum(reach, self.radius), self.radius)
        factor = np.where(np.abs(new_reach - reach) <= ON_SURFACE, 1.0, new_reach / safe)
        ahead = on_axis & ~to_top
        return np.stack(
            [
                np.where(ahead, 0.0, x * factor),
                np.where(to_top, self.height, level),
                np.where(ahead, -self.radius, z * factor),
            ],
            axis=-1,
        )

    def distance(self, points: ArrayLike) -> Float64:
        """Distance to the surface [m], shape (...), never negative."""
        p = np.asarray(points, dtype=np.float64)
        return np.linalg.norm(self.project(p) - p, axis=-1)

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points lie strictly inside, shape (...)."""
        p = np.asarray(points, dtype=np.float64)
        return (np.hypot(p[..., 0], p[..., 2]) < self.radius) & (p[..., 1] > 0.0) & (p[..., 1] < self.height)

    def move(self, points: ArrayLike, pushes: ArrayLike, held: tuple[bool, bool, bool] = FREE) -> Float64:
        """Places (..., 3) that sensors reach when pushed over the surface; no metre of the push is lost to the body.

        On the side, the part of the push along the tangent turns the sensor around the axis (metres along the
        circumference) and the vertical part lifts it; past the upper rim it goes on over the top towards the centre
        and down to the rim beyond, where it stops, as it does at the foot. On the top the push's horizontal part
        moves it straight; past the rim it goes on down the side. What points into the body has no effect. The map is
        continuous, and smooth but at the rim, at the foot and at the top's centre.

        Args:
            points: on the surface, (..., 3) [m].
            pushes: (..., 3) [m].
            held: which of x, y and z must not change. On the side a sensor that holds x or z stays above its place on
                the floor; one that holds y keeps its height.
        """
        points, pushes = np.broadcast_arrays(np.asarray(points, np.float64), np.asarray(pushes, np.float64))
        on_top = self._on_top(points)[..., None]
        return np.where(on_top, self._move_on_top(points, pushes, held), self._move_on_side(points, pushes, held))

    def push(self, points: ArrayLike, targets: ArrayLike) -> Float64:
        """The push (..., 3) with which :meth:`move` takes ``points`` to ``targets``: the shorter of two ways around."""
        points, targets = np.broadcast_arrays(np.asarray(points, np.float64), np.asarray(targets, np.float64))
        return np.where(
            self._on_top(points)[..., None], self._push_on_top(points, targets), self._push(points, targets)
        )

    def sample(self, uniforms: Float64) -> Float64:
        """Places (n, 3) even over side and top, from numbers (n, 3) even over 0..1."""
        side = 2.0 * np.pi * self.radius * self.height
        top = np.pi * self.radius**2
        on_top = uniforms[:, 0] * (side + top) >= side
        turn = 2.0 * np.pi * uniforms[:, 1]
        reach = np.where(on_top, self.radius * np.sqrt(uniforms[:, 2]), self.radius)
        level = np.where(on_top, self.height, self.height * uniforms[:, 2])
        return np.stack([reach * np.sin(turn), level, -reach * np.cos(turn)], axis=1)

    def outline(self) -> tuple[Float64, NDArray[np.int64]]:
        """A prism of 48 sides with its lid, to draw."""
        turn = np.linspace(0.0, 2.0 * np.pi, 49)[:-1]
        ring = np.stack([self.radius * np.sin(turn), np.zeros(48), -self.radius * np.cos(turn)], axis=1)
        vertices = np.concatenate([ring, ring + [0.0, self.height, 0.0], [[0.0, self.height, 0.0]]])
        a, b = np.arange(48), (np.arange(48) + 1) % 48
        faces = [np.stack(rows, axis=1) for rows in ((a, b, b + 48), (a, b + 48, a + 48), (a + 48, b + 48, b * 0 + 96))]
        return vertices, np.concatenate(faces)

    def _on_top(self, points: Float64) -> NDArray[np.bool_]:
        reach = np.hypot(points[..., 0], points[..., 2])
        return (points[..., 1] >= self.height - ON_SURFACE) & (reach < self.radius - ON_SURFACE)

    def _move_on_side(self, points: Float64, pushes: Float64, held: tuple[bool, bool, bool]) -> Float64:
        x, y, z = points[..., 0], points[..., 1], points[..., 2]
        turn = np.arctan2(x, -z)
        over = held[0] or held[1] or held[2]  # a held coordinate also keeps a sensor from climbing onto the top
        along = pushes[..., 0] * np.cos(turn) + pushes[..., 2] * np.sin(turn)
        along = np.zeros_like(along) if held[0] or held[2] else along
        lift = np.zeros_like(y) if held[1] else pushes[..., 1]
        climbed = np.clip(y + lift, 0.0, self.height if over else self.height + 2.0 * self.radius)
        turned = turn + along / self.radius
        reach = self.radius - np.maximum(climbed - self.height, 0.0)
        straight = (along == 0.0) & (climbed <= self.height)
        return np.stack(
            [
                np.where(straight, x, reach * np.sin(turned)),
                np.minimum(climbed, self.height),
                np.where(straight, z, -reach * np.cos(turned)),
            ],
            axis=-1,
        )

    def _move_on_top(self, points: Float64, pushes: Float64, held: tuple[bool, bool, bool]) -> Float64:
        keep = np.array(held)
        place = points + np.where(keep, 0.0, pushes)
        x, z = place[..., 0], place[..., 2]
        if held[0] or held[2]:  # along a chord, from rim to rim
            fixed = x if held[0] else z
            reach = np.sqrt(np.maximum(self.radius**2 - fixed**2, 0.0))
            x = x if held[0] else np.clip(x, -reach, reach)
            z = z if held[2] else np.clip(z, -reach, reach)
            return np.stack([x, points[..., 1], z], axis=-1)
        away = np.hypot(x, z)
        over = np.maximum(away - self.radius, 0.0)
        factor = np.where(over > 0.0, self.radius / np.where(away > 0.0, away, 1.0), 1.0)
        level = points[..., 1] if held[1] else np.maximum(points[..., 1] - over, 0.0)
        return np.stack([x * factor, level, z * factor], axis=-1)

    def _push(self, points: Float64, targets: Float64) -> Float64:
        turn = np.arctan2(points[..., 0], -points[..., 2])
        goal = np.arctan2(targets[..., 0], -targets[..., 2])
        away = np.hypot(targets[..., 0], targets[..., 2])
        on_top = self._on_top(targets)
        near_turn, near_lift = _wrapped(goal - turn), np.where(on_top, self.radius - away, 0.0)
        far_turn, far_lift = _wrapped(goal + np.pi - turn), self.radius + away
        rise = targets[..., 1] - points[..., 1]
        shorter = np.hypot(self.radius * far_turn, rise + far_lift) < np.hypot(
            self.radius * near_turn, rise + near_lift
        )
        beyond = on_top & shorter  # over the centre of the top
        along = self.radius * np.where(beyond, far_turn, near_turn)
        lift = rise + np.where(beyond, far_lift, near_lift)
        return np.stack([along * np.cos(turn), lift, along * np.sin(turn)], axis=-1)

    def _push_on_top(self, points: Float64, targets: Float64) -> Float64:
        away = np.hypot(targets[..., 0], targets[..., 2])
        below = np.where(self._on_top(targets), 0.0, self.height - targets[..., 1])
        factor = 1.0 + below / np.where(away > 0.0, away, 1.0)
        place = np.stack([targets[..., 0] * factor, points[..., 1], targets[..., 2] * factor], axis=-1)
        return place - points


def _wrapped(angle: Float64) -> Float64:
    """Angle in -pi..pi; exactly 0 stays 0."""
    return np.arctan2(np.sin(angle), np.cos(angle))
