"""Designs around an initial one: normalised coordinates theta, the map to poses on the body, and its inverse.

theta has seven numbers per sensor, one unit being one *scale* of the axis (:class:`DesignSpace`):

    position = body.move(initial position, scale * theta)     a push over the surface, see :meth:`BodySurface.move`
    angle    = initial angle + scale * theta                  held within its limits
    fov      = initial fov + scale * theta                    held within its limits

so theta = 0 is the initial design, and a standard deviation of 0.2 (the paper's, section "Design Optimization") is a
fifth of a scale. Before that, theta of frozen axes is set to 0 and followers get their leader's theta
(:func:`effective_theta`): a mirrored one with the signs of x, yaw and roll changed, a tied one with the push turned by
the angle between the two initial places about the body's axis.

The map is continuous on the cylinder and on star-shaped meshes, and smooth but at rims, edges and limits. A surface
has two dimensions and a push three: what points into the body has no effect. The inverse gives the push along the
surface. Limits of positions stop a sensor on its way: it stays where the push would first carry it beyond; then the
map is continuous along each push.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.errors import DesignError
from prnav.sensors.body import Body, BodySurface
from prnav.sensors.design import AXES, MIRROR, Design, DesignSpace

Float64 = NDArray[np.float64]

_STAGES, _HALVINGS = 48, 40


def theta_to_pose(theta: ArrayLike, design: Design) -> Float64:
    """Poses (..., K, 7) at normalised coordinates theta (..., K, 7) around ``design``; see the module's text.

    Raises:
        DesignError: theta does not fit the design's number of sensors, or is not finite.
    """
    theta = effective_theta(theta, design)
    space = design.space
    pose = design.sensors + space.scale * theta
    for sensor in range(design.num_sensors):
        held = _held(design, sensor)
        start, pushes = design.sensors[sensor, :3], space.scale[:3] * theta[..., sensor, :3]
        pose[..., sensor, :3] = _within(design.surface(sensor), start, pushes, held, space)
    pose[..., 3:] = np.clip(pose[..., 3:], space.low[3:], space.high[3:])
    for link in design.links:
        if link.mirrored:  # exactly, whatever rounding did
            pose[..., link.follower, :] = pose[..., link.leader, :] * MIRROR
    return pose


def pose_to_theta(pose: ArrayLike, design: Design) -> Float64:
    """Normalised coordinates (..., K, 7) of poses (..., K, 7): :func:`theta_to_pose` of them gives the poses again.

    That holds for all poses on the surface and within limits that leave frozen axes and links as they are.

    Raises:
        DesignError: the poses do not fit the design's number of sensors, or are not finite.
    """
    pose = _check_shape(pose, design, "pose")
    change = pose - design.sensors
    for sensor in range(design.num_sensors):
        place, surface = design.sensors[sensor, :3], design.surface(sensor)
        change[..., sensor, :3] = surface.push(place, pose[..., sensor, :3])
    return change / design.space.scale


def effective_theta(theta: ArrayLike, design: Design) -> Float64:
    """Theta (..., K, 7) with frozen axes at 0 and followers as their leaders make them.

    Raises:
        DesignError: theta does not fit the design's number of sensors, or is not finite.
    """
    theta = np.array(_check_shape(theta, design, "theta"))
    theta[..., ~design.free] = 0.0
    scale = design.space.scale
    for link in design.links:
        leader = theta[..., link.leader, :]
        if link.mirrored:
            theta[..., link.follower, :] = leader * MIRROR
            continue
        turn = _azimuth(design.sensors[link.follower]) - _azimuth(design.sensors[link.leader])
        right, back = leader[..., 0] * scale[0], leader[..., 2] * scale[2]
        theta[..., link.follower, :] = leader
        theta[..., link.follower, 0] = (right * math.cos(turn) - back * math.sin(turn)) / scale[0]
        theta[..., link.follower, 2] = (right * math.sin(turn) + back * math.cos(turn)) / scale[2]
    return theta


def free_values(theta: ArrayLike, design: Design) -> Float64:
    """The coordinates (..., n) of theta (..., K, 7) that may change on their own; what a search works on."""
    return np.asarray(theta, np.float64)[..., design.free]


def with_free_values(values: ArrayLike, design: Design) -> Float64:
    """Theta (..., K, 7) from its free coordinates (..., n): the inverse of :func:`free_values`."""
    values = np.asarray(values, np.float64)
    theta = np.zeros((*values.shape[:-1], design.num_sensors, 7))
    theta[..., design.free] = values
    return effective_theta(theta, design)


def moved_design(design: Design, theta: ArrayLike, name: str, description: str = "") -> Design:
    """``design`` at theta (K, 7) as a design of its own, with the same space, links and frozen axes around it."""
    poses = theta_to_pose(theta, design)
    return Design(
        name,
        poses,
        design.grid,
        design.body,
        design.space,
        description or design.description,
        design.frozen,
        design.links,
        design.seats,
        design.model,
    )


def random_design(
    seed: int, sensors: int, grid: int = 4, body: BodySurface | None = None, space: DesignSpace | None = None
) -> Design:
    """Design drawn from a seed: positions even over the body's surface, directions even over the sphere.

    Rolls are even over the circle, fields of view even over 20 to 120 degrees; all is cut to the space's limits, where
    positions are drawn again until they lie within. The first K sensors of a seed are the same whatever the number
    asked for.

    Raises:
        DesignError: no sensors are asked for, or no place of the body lies within the limits.
    """
    body, space = body or Body(), space or DesignSpace()
    if sensors < 1:
        raise DesignError(f"random design: number of sensors is {sensors!r}; it must be at least 1")
    u = np.random.Generator(np.random.PCG64(seed)).random((sensors, 7))
    rows = np.empty((sensors, 7))
    rows[:, :3] = body.sample(u[:, :3])
    low, high = space.low, space.high
    for sensor in range(sensors):
        again = np.random.Generator(np.random.PCG64([seed, sensor]))
        for _ in range(1000):
            if (rows[sensor, :3] >= low[:3]).all() and (rows[sensor, :3] <= high[:3]).all():
                break
            rows[sensor, :3] = body.sample(again.random((1, 3)))[0]
        else:
            raise DesignError(
                f"random design: no place of the body ({body.shape}) found within the limits of x, y and z"
            )
    rows[:, 3] = math.pi * (2.0 * u[:, 3] - 1.0)
    rows[:, 4] = np.arcsin(2.0 * u[:, 4] - 1.0)
    rows[:, 5] = math.pi * (2.0 * u[:, 5] - 1.0)
    rows[:, 6] = np.radians(20.0 + 100.0 * u[:, 6])
    rows[:, 3:] = np.clip(rows[:, 3:], low[3:], high[3:])
    return Design(f"random-{seed}", rows, grid, body, space, f"{sensors} sensors drawn from seed {seed}.")


def _held(design: Design, sensor: int) -> tuple[bool, bool, bool]:
    """Which of x, y and z the sensor holds; a follower holds what its leader does."""
    leader = next((link.leader for link in design.links if link.follower == sensor), sensor)
    free = design.free[leader, :3]
    return not free[0], not free[1], not free[2]


def _within(
    body: BodySurface, start: Float64, pushes: Float64, held: tuple[bool, bool, bool], space: DesignSpace
) -> Float64:
    """Places (..., 3) reached from ``start`` (3,), stopped where a push leaves the limits of x, y and z."""
    low, high = space.low[:3], space.high[:3]
    place = body.move(start, pushes, held)
    if not (np.isfinite(low).any() or np.isfinite(high).any()):
        return place

    def inside(shares: Float64) -> NDArray[np.bool_]:
        there = body.move(start, shares[..., None] * pushes, held)
        return np.asarray(((there >= low - 1e-12) & (there <= high + 1e-12)).all(axis=-1))

    good, bad = np.zeros(pushes.shape[:-1]), np.full(pushes.shape[:-1], np.nan)
    for stage in range(1, _STAGES + 1):
        share = np.full(good.shape, stage / _STAGES)
        stopped = np.isfinite(bad)
        fine = inside(share)
        bad = np.where(~stopped & ~fine, share, bad)
        good = np.where(~stopped & fine, share, good)
    stopped = np.isfinite(bad)
    for _ in range(_HALVINGS if stopped.any() else 0):
        middle = np.where(stopped, 0.5 * (good + np.where(stopped, bad, 0.0)), 1.0)
        fine = inside(middle)
        good, bad = np.where(stopped & fine, middle, good), np.where(stopped & ~fine, middle, bad)
    return np.where(stopped[..., None], body.move(start, good[..., None] * pushes, held), place)


def _azimuth(pose: Float64) -> float:
    """Where a sensor sits around the body's axis [rad]: 0 ahead, positive to the right."""
    return math.atan2(pose[0], -pose[2])


def _check_shape(values: ArrayLike, design: Design, what: str) -> Float64:
    values = np.asarray(values, dtype=np.float64)
    k = design.num_sensors
    if values.ndim < 2 or values.shape[-2:] != (k, 7):
        raise DesignError(f"{what} has shape {values.shape}; design {design.name} has {k} sensors: (..., {k}, 7)")
    if not np.isfinite(values).all():
        sensor, axis = np.argwhere(~np.isfinite(values))[0][-2:]
        raise DesignError(f"{what}: {AXES[axis]} of sensor {sensor} is not finite; it must be a number")
    return values
