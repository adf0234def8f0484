"""Sensor designs: where on the body each sensor sits, where it looks and how wide; and the space around them.

A sensor is seven numbers in the body's frame (origin at the feet, x right, y up, -z ahead): x, y, z [m], yaw, pitch,
roll and fov [rad]; its rotation is Ry(yaw) Rx(pitch) Rz(roll). Designs are searched in normalised coordinates theta
around an initial design, one unit being one *scale* of the axis:

    position = closest point of the body's surface to (initial position + scale * theta)
    angle    = initial angle + scale * theta
    fov      = initial fov + scale * theta, held within its limits

so theta = 0 is the initial design, and a standard deviation of 0.2 (the paper's, section "Design Optimization") is a
fifth of a scale. The map is continuous where the closest point is (everywhere but on the cylinder's axis and on the
cone of points as near to its top as to its side) and smooth but for the rim and the limits. Its inverse is
``(pose - initial pose) / scale``: exact for poses on the surface with a field of view within the limits, because
these the projection leaves alone. Of the many theta that land on one pose, the inverse gives the one that needs no
projection.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import DesignError
from prnav.sensors.body import Body

Float64 = NDArray[np.float64]

AXES = ("x", "y", "z", "yaw", "pitch", "roll", "fov")
"""Columns of a design."""

FOV_LIMITS = (math.radians(1.0), math.radians(179.0))
"""Smallest and largest field of view [rad] of any sensor."""

SURFACE_TOLERANCE = 1e-3
"""How far from the body's surface [m] a design may put a sensor; it is then moved onto the surface."""


@dataclass(frozen=True)
class DesignSpace:
    """Scale of each axis (what one unit of theta is worth) and the limits of the field of view.

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

    @property
    def scale(self) -> Float64:
        """Scales in the order of :data:`AXES`, shape (7,)."""
        return np.array([getattr(self, name) for name in AXES])


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
    body: Body = field(default_factory=Body)
    space: DesignSpace = field(default_factory=DesignSpace)
    description: str = ""
    """The idea behind the design."""

    def __post_init__(self) -> None:
        sensors = np.array(self.sensors, dtype=np.float64)
        where = f"design {self.name}"
        if not isinstance(self.grid, int) or self.grid < 1:
            raise DesignError(f"{where}: grid is {self.grid!r}; it must be a whole number of at least 1")
        if sensors.ndim != 2 or sensors.shape[1] != 7 or not len(sensors):
            raise DesignError(f"{where}: sensors have shape {sensors.shape}; they must be (K, 7): {', '.join(AXES)}")
        check_poses(sensors, self.body, where, (self.space.fov_min, self.space.fov_max))
        sensors[:, :3] = self.body.project(sensors[:, :3])
        sensors.flags.writeable = False
        object.__setattr__(self, "sensors", sensors)

    @property
    def num_sensors(self) -> int:
        """Number of sensors K."""
        return len(self.sensors)

    def require_sensors(self, count: int) -> Design:
        """This design, if it has ``count`` sensors.

        Raises:
            DesignError: it has another number.
        """
        if self.num_sensors != count:
            raise DesignError(f"design {self.name} has {self.num_sensors} sensors; {count} are needed")
        return self


def check_poses(
    poses: ArrayLike, body: Body, where: str = "design", fov_limits: tuple[float, float] = FOV_LIMITS
) -> None:
    """Pass if every pose (..., 7) is a sensor on the body.

    Raises:
        DesignError: the first sensor that is not, and why.
    """
    rows = np.asarray(poses, dtype=np.float64).reshape(-1, 7)
    for index, row in enumerate(rows):
        if not np.isfinite(row).all():
            axis = AXES[int(np.argmin(np.isfinite(row)))]
            raise DesignError(f"{where}: sensor {index}: {axis} is {row[AXES.index(axis)]}; it must be a finite number")
    off = np.flatnonzero(body.distance(rows[:, :3]) > SURFACE_TOLERANCE)
    if len(off):
        index = int(off[0])
        point = rows[index, :3]
        nearest = body.project(point)
        side = "inside" if body.contains(point) else "off"
        raise DesignError(
            f"{where}: sensor {index}: position {_metres(point)} lies {side} the body (cylinder of radius "
            f"{body.radius:g} m, height {body.height:g} m); the nearest place on its surface is {_metres(nearest)}"
        )
    low, high = fov_limits
    bad = np.flatnonzero((rows[:, 6] < low - 1e-9) | (rows[:, 6] > high + 1e-9))
    if len(bad):
        index = int(bad[0])
        raise DesignError(
            f"{where}: sensor {index}: fov is {math.degrees(rows[index, 6]):g} degrees; it must lie within "
            f"{math.degrees(low):g} to {math.degrees(high):g}"
        )


def theta_to_pose(theta: ArrayLike, design: Design) -> Float64:
    """Poses (..., K, 7) at normalised coordinates theta (..., K, 7) around ``design``; see the module's text.

    Raises:
        DesignError: theta does not fit the design's number of sensors, or is not finite.
    """
    theta = _check_shape(theta, design, "theta")
    pose = design.sensors + design.space.scale * theta
    pose[..., :3] = design.body.project(pose[..., :3])
    pose[..., 6] = np.clip(pose[..., 6], design.space.fov_min, design.space.fov_max)
    return pose


def pose_to_theta(pose: ArrayLike, design: Design) -> Float64:
    """Normalised coordinates (..., K, 7) of poses (..., K, 7); exact for poses that :func:`theta_to_pose` can give.

    Raises:
        DesignError: the poses do not fit the design's number of sensors, or are not finite.
    """
    return (_check_shape(pose, design, "pose") - design.sensors) / design.space.scale


def _check_shape(values: ArrayLike, design: Design, what: str) -> Float64:
    values = np.asarray(values, dtype=np.float64)
    k = design.num_sensors
    if values.ndim < 2 or values.shape[-2:] != (k, 7):
        raise DesignError(f"{what} has shape {values.shape}; design {design.name} has {k} sensors: (..., {k}, 7)")
    if not np.isfinite(values).all():
        sensor, axis = np.argwhere(~np.isfinite(values))[0][-2:]
        raise DesignError(f"{what}: {AXES[axis]} of sensor {sensor} is not finite; it must be a number")
    return values


def _metres(point: Float64) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in point) + ")"


def random_design(
    seed: int, sensors: int, grid: int = 4, body: Body | None = None, space: DesignSpace | None = None
) -> Design:
    """Design drawn from a seed: positions even over the body's surface, directions even over the sphere.

    Rolls are even over the circle, fields of view even over 20 to 120 degrees (cut to the space's limits). The first
    K sensors of a seed are the same whatever the number asked for.
    """
    body, space = body or Body(), space or DesignSpace()
    if sensors < 1:
        raise DesignError(f"random design: number of sensors is {sensors!r}; it must be at least 1")
    u = np.random.Generator(np.random.PCG64(seed)).random((sensors, 7))
    side = 2.0 * math.pi * body.radius * body.height
    top = math.pi * body.radius**2
    on_top = u[:, 0] * (side + top) >= side
    turn = 2.0 * math.pi * u[:, 1]
    reach = np.where(on_top, body.radius * np.sqrt(u[:, 2]), body.radius)
    rows = np.empty((sensors, 7))
    rows[:, 0] = reach * np.sin(turn)
    rows[:, 1] = np.where(on_top, body.height, body.height * u[:, 2])
    rows[:, 2] = -reach * np.cos(turn)
    rows[:, 3] = math.pi * (2.0 * u[:, 3] - 1.0)
    rows[:, 4] = np.arcsin(2.0 * u[:, 4] - 1.0)
    rows[:, 5] = math.pi * (2.0 * u[:, 5] - 1.0)
    rows[:, 6] = np.clip(np.radians(20.0 + 100.0 * u[:, 6]), space.fov_min, space.fov_max)
    return Design(f"random-{seed}", rows, grid, body, space, f"{sensors} sensors drawn from seed {seed}.")
