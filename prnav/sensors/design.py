"""Sensor designs: where on the body each sensor sits, where it looks and how wide; and what may be changed about it.

A sensor is seven numbers in the body's frame (origin at the feet, x right, y up, -z ahead): x, y, z [m], yaw, pitch,
roll and fov [rad]; its rotation is Ry(yaw) Rx(pitch) Rz(roll). :mod:`prnav.sensors.design_map` says how designs are
searched around an initial one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import DesignError
from prnav.sensors.body import Body, BodySurface

Float64 = NDArray[np.float64]

AXES = ("x", "y", "z", "yaw", "pitch", "roll", "fov")
"""Columns of a design."""

FOV_LIMITS = (math.radians(1.0), math.radians(179.0))
"""Smallest and largest field of view [rad] of any sensor."""

MIRROR = np.array([-1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
"""Signs of a pose's mirror image in the plane x = 0."""

SURFACE_TOLERANCE = 1e-3
"""How far from the body's surface [m] a design may put a sensor; it is then moved onto the surface."""


@dataclass(frozen=True)
class DesignSpace:
    """Scale of each axis (what one unit of theta is worth), and what holds the axes.

    The defaults let a standard deviation of 0.2 move a sensor by 0.1 m sideways and 0.2 m in height, turn it by 18
    degrees about any axis, and change its field of view by 9 degrees.
    """

    x: float = 0.5
    """[m]"""
    y: float = 1.0
    """[m]"""
    z: float = 0.5
    """[m]"""
    yaw: float = math.pi / 2
    """[rad]"""
    pitch: float = math.pi / 2
    """[rad]"""
    roll: float = math.pi / 2
    """[rad]"""
    fov: float = math.pi / 4
    """[rad]"""
    fov_min: float = FOV_LIMITS[0]
    """[rad]"""
    fov_max: float = FOV_LIMITS[1]
    """[rad]"""
    frozen: tuple[str, ...] = ()
    """Axes that no sensor moves along."""
    limits: tuple[tuple[str, float, float], ...] = ()
    """(axis, smallest, largest) value [m or rad] of axes other than fov, for all sensors."""

    def __post_init__(self) -> None:
        for name in AXES:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise DesignError(f"design space: scale of {name} is {value!r}; it must be a positive number")
        if not FOV_LIMITS[0] - 1e-9 <= self.fov_min <= self.fov_max <= FOV_LIMITS[1] + 1e-9:
            low, high = math.degrees(self.fov_min), math.degrees(self.fov_max)
            raise DesignError(
                f"design space: fov limits are {low:g} to {high:g} degrees; they must lie within 1 to 179"
            )
        _check_axes(self.frozen, "design space: frozen")
        named = [axis for axis, _, _ in self.limits]
        _check_axes(tuple(named), "design space: limits")
        for axis, low, high in self.limits:
            if axis == "fov":
                raise DesignError("design space: limits of fov are given as fov_min and fov_max")
            if not low <= high:
                raise DesignError(
                    f"design space: limits of {axis} are {low!r} to {high!r}; the first must be the smaller"
                )

    @property
    def scale(self) -> Float64:
        """Scales in the order of :data:`AXES`, shape (7,)."""
        return np.array([getattr(self, name) for name in AXES])

    @property
    def low(self) -> Float64:
        """Smallest values in the order of :data:`AXES`, shape (7,); -inf where there is no limit."""
        given = {axis: low for axis, low, _ in self.limits} | {"fov": self.fov_min}
        return np.array([given.get(axis, -math.inf) for axis in AXES])

    @property
    def high(self) -> Float64:
        """Largest values in the order of :data:`AXES`, shape (7,); inf where there is no limit."""
        given = {axis: high for axis, _, high in self.limits} | {"fov": self.fov_max}
        return np.array([given.get(axis, math.inf) for axis in AXES])


@dataclass(frozen=True)
class Link:
    """A sensor that has no coordinates of its own, but follows another one."""

    follower: int
    """Its index."""
    leader: int
    """Index of the sensor that it follows."""
    mirrored: bool
    """True: it is the leader's mirror image, left and right exchanged. False: it makes the leader's moves from its own
    initial pose, turned by the angle between the two about the body's axis."""


@dataclass(frozen=True, eq=False)
class Seat:
    """One of an agent's bodies that a sensor can sit on."""

    body: str
    """Its name, as design files give it."""
    surface: BodySurface
    """Its surface, in the frame that the sensor's pose is given in."""


@dataclass(frozen=True, eq=False)
class Design:
    """Sensors on a body. Positions within :data:`SURFACE_TOLERANCE` of the surface are moved exactly onto it.

    Raises:
        DesignError: no sensors, a wrong shape, a number that is not finite, a sensor off the surface, a field of view
            out of range, or a grid below 1.
    """

    name: str
    sensors: Float64
    """Poses in the body's frame, shape (K, 7); see :data:`AXES`."""
    grid: int = 4
    """Receptors per row of each sensor."""
    body: BodySurface = field(default_factory=Body)
    space: DesignSpace = field(default_factory=DesignSpace)
    description: str = ""
    """The idea behind the design."""
    frozen: tuple[tuple[str, ...], ...] = ()
    """Axes along which each sensor does not move, beside those that the space freezes; empty for none."""
    links: tuple[Link, ...] = ()
    """Sensors that follow others."""
    seats: tuple[Seat, ...] = ()
    """Where each sensor sits, if the agent's body is made of several; empty for all on ``body``."""
    model: str = ""
    """The model whose bodies the seats are."""

    def __post_init__(self) -> None:
        sensors = np.array(self.sensors, dtype=np.float64)
        where = f"design {self.name}"
        if not isinstance(self.grid, int) or self.grid < 1:
            raise DesignError(f"{where}: grid is {self.grid!r}; it must be a whole number of at least 1")
        if sensors.ndim != 2 or sensors.shape[1] != 7 or not len(sensors):
            raise DesignError(f"{where}: sensors have shape {sensors.shape}; they must be (K, 7): {', '.join(AXES)}")
        if self.seats:
            _check_seats(self.seats, sensors, self.links, where)
            for index, (row, seat) in enumerate(zip(sensors, self.seats, strict=True)):
                check_poses(row, seat.surface, where, self.space, first=index)
                row[:3] = seat.surface.project(row[:3])
        else:
            check_poses(sensors, self.body, where, self.space)
            sensors[:, :3] = self.body.project(sensors[:, :3])
        if self.frozen and len(self.frozen) != len(sensors):
            raise DesignError(
                f"{where}: frozen names axes of {len(self.frozen)} sensors; the design has {len(sensors)}"
            )
        for index, axes in enumerate(self.frozen):
            _check_axes(axes, f"{where}: sensor {index}: frozen")
        _check_links(self.links, sensors, where)
        sensors.flags.writeable = False
        object.__setattr__(self, "sensors", sensors)

    @property
    def num_sensors(self) -> int:
        """Number of sensors K."""
        return len(self.sensors)

    def surface(self, sensor: int) -> BodySurface:
        """What a sensor sits on and moves over."""
        return self.seats[sensor].surface if self.seats else self.body

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which coordinates may change on their own, (K, 7): not those that are frozen, nor a follower's."""
        free = np.ones((self.num_sensors, 7), np.bool_)
        free[:, [AXES.index(axis) for axis in self.space.frozen]] = False
        for index, axes in enumerate(self.frozen):
            free[index, [AXES.index(axis) for axis in axes]] = False
        free[[link.follower for link in self.links]] = False
        return free

    def require_sensors(self, count: int) -> Design:
        """This design, if it has ``count`` sensors.

        Raises:
            DesignError: it has another number.
        """
        if self.num_sensors != count:
            raise DesignError(f"design {self.name} has {self.num_sensors} sensors; {count} are needed")
        return self


def check_poses(
    poses: ArrayLike, body: BodySurface, where: str = "design", space: DesignSpace | None = None, first: int = 0
) -> None:
    """Pass if every pose (..., 7) is a sensor on the body and within the limits of its space.

    ``first`` is the number by which errors call the first sensor.

    Raises:
        DesignError: the first sensor that is not, and why.
    """
    rows = np.asarray(poses, dtype=np.float64).reshape(-1, 7)
    for index, row in enumerate(rows):
        if not np.isfinite(row).all():
            axis = AXES[int(np.argmin(np.isfinite(row)))]
            raise DesignError(
                f"{where}: sensor {first + index}: {axis} is {row[AXES.index(axis)]}; it must be a finite number"
            )
    off = np.flatnonzero(body.distance(rows[:, :3]) > SURFACE_TOLERANCE)
    if len(off):
        index = int(off[0])
        point = rows[index, :3]
        nearest = body.project(point)
        side = "inside" if body.contains(point) else "off"
        raise DesignError(
            f"{where}: sensor {first + index}: position {_metres(point)} lies {side} the body ({body.shape}); the "
            f"nearest place on its surface is {_metres(nearest)}"
        )
    space = space or DesignSpace()
    for index, row in enumerate(rows):
        for axis, value, low, high in zip(AXES, row, space.low, space.high, strict=True):
            if not low - 1e-9 <= value <= high + 1e-9:
                raise DesignError(
                    f"{where}: sensor {first + index}: {axis} is {_quantity(axis, value)}; it must lie within "
                    f"{_number(axis, low)} to {_number(axis, high)}"
                )


def _check_axes(axes: tuple[str, ...], what: str) -> None:
    for axis in axes:
        if axis not in AXES:
            raise DesignError(f"{what}: {axis!r} is not an axis; valid: {', '.join(AXES)}")
    if len(set(axes)) != len(axes):
        raise DesignError(f"{what}: {', '.join(axes)}: an axis stands there twice")


def _check_seats(seats: tuple[Seat, ...], sensors: Float64, links: tuple[Link, ...], where: str) -> None:
    if len(seats) != len(sensors):
        raise DesignError(f"{where}: seats name bodies of {len(seats)} sensors; the design has {len(sensors)}")
    if links:
        raise DesignError(
            f"{where}: sensor {links[0].follower}: mirror_of and tied_to need one body with an axis; they are not for "
            f"sensors on named bodies"
        )


def _check_links(links: tuple[Link, ...], sensors: Float64, where: str) -> None:
    followers = {link.follower for link in links}
    for link in links:
        name = f"{where}: sensor {link.follower}"
        if not (0 <= link.follower < len(sensors) and 0 <= link.leader < len(sensors)):
            raise DesignError(f"{name}: it follows sensor {link.leader}; valid: 0 to {len(sensors) - 1}")
        if link.leader in followers:
            raise DesignError(f"{name}: it follows sensor {link.leader}, which must not be itself or a follower")
        image = sensors[link.leader] * MIRROR
        if link.mirrored and np.abs(sensors[link.follower] - image).max() > SURFACE_TOLERANCE:
            raise DesignError(
                f"{name}: it is not the mirror image of sensor {link.leader} (x, yaw and roll with the other sign)"
            )
    if len(followers) != len(links):
        raise DesignError(f"{where}: a sensor follows two others; one link per sensor")


def _metres(point: Float64) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in point) + ")"


def _number(axis: str, value: float) -> str:
    return f"{value if axis in AXES[:3] else math.degrees(value):g}"


def _quantity(axis: str, value: float) -> str:
    return f"{_number(axis, value)} {'m' if axis in AXES[:3] else 'degrees'}"
