"""What an agent sees: sensors that a design puts on its bodies, or the suite's camera beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from prnav.domains.control.caster import Caster, WorldPoses
from prnav.domains.control.engine import mujoco
from prnav.domains.control.frames import to_world
from prnav.domains.control.physics import Physics

if TYPE_CHECKING:
    from prnav.domains.control.env.config import ControlConfig

Float64 = NDArray[np.float64]
Rows = slice | NDArray[np.int64]
"""Which simulations: all, or those with these numbers."""


class Mounts(Protocol):
    """K sensors on a model's bodies, placed by normalised designs."""

    @property
    def num_sensors(self) -> int:
        """K."""
        ...

    @property
    def body_ids(self) -> NDArray[np.int64]:
        """Number of the body that each sensor sits on, (K,)."""
        ...

    def theta_to_pose(self, theta: Float64) -> tuple[Float64, Float64, Float64]:
        """Sensors' places (n, K, 3) [m] and axes (n, K, 3, 3) in their bodies' frames, and fields of view (n, K) [rad].

        Axes are right, up and back as columns. A theta (n, K, 7) of zeros is the design itself.
        """
        ...


class Eyes(Protocol):
    """A way to see, in N simulations at once."""

    derived: tuple[str, ...]
    """Fields of MjData that it reads."""
    num_sensors: int
    """K."""

    def aim(self, rows: NDArray[np.int64], theta: Float64) -> None:
        """Place the sensors of simulations ``rows`` (n,) by normalised designs (n, K, 7)."""
        ...

    def read(self, physics: Physics, rows: Rows) -> NDArray[np.float32]:
        """Readings in simulations ``rows``, (n, K, B*B, 3), 0 to 1."""
        ...

    def picture(self, physics: Physics, rows: Rows) -> NDArray[np.uint8]:
        """Pictures in simulations ``rows``, (n, K, H, W, 3), top row first."""
        ...


def open_eyes(model: mujoco.MjModel, config: ControlConfig, num: int, mounts: Mounts | None = None) -> Eyes | None:
    """The eyes that a config asks for in ``num`` simulations; None for an agent that is given the state.

    Args:
        model: the body.
        config: senses and design.
        num: N.
        mounts: sensors to take in place of the config's design.

    Raises:
        PrnavError: the design does not fit the body, or a setting of the caster is wrong.
    """
    if config.senses == "state":
        return None
    caster = Caster(model, config.floor, config.rays_per_receptor)
    if config.senses == "third-person":
        return ThirdPerson(caster, model, config.camera_size, config.threads)
    if mounts is None:
        from prnav.domains.control.mounts import load_mounts

        mounts = load_mounts(config.design, model)
    return BodySensors(caster, mounts, num, config.grid, config.camera_size, config.threads)


class BodySensors:
    """Sensors on bodies."""

    derived: tuple[str, ...] = ("xpos", "xmat", *WorldPoses._fields)
    num_sensors: int

    def __init__(self, caster: Caster, mounts: Mounts, num: int, grid: int, size: int, threads: int = 1):
        """Sensors at the design's own poses in all simulations.

        Args:
            caster: of the bodies' model.
            mounts: where designs put the sensors.
            num: N.
            grid: receptors per row of each sensor.
            size: pixels per side of pictures.
            threads: that cast rays.
        """
        self.caster, self.mounts, self.grid, self.size, self.threads = caster, mounts, grid, size, threads
        self.num_sensors = mounts.num_sensors
        theta = np.zeros((num, self.num_sensors, 7))
        self.places, self.axes, self.fovs = (np.array(value) for value in mounts.theta_to_pose(theta))

    def aim(self, rows: NDArray[np.int64], theta: Float64) -> None:
        """Place the sensors of simulations ``rows`` (n,) by normalised designs (n, K, 7)."""
        for array, value in zip((self.places, self.axes, self.fovs), self.mounts.theta_to_pose(theta), strict=True):
            array[rows] = value

    def read(self, physics: Physics, rows: Rows) -> NDArray[np.float32]:
        """Readings in simulations ``rows``, (n, K, B*B, 3), 0 to 1."""
        places, axes = self._in_world(physics, rows)
        seen = self.caster.read(
            world_poses(physics, rows), places, axes, self.fovs[rows], grid=self.grid, threads=self.threads
        )
        return seen.reshape(len(seen), self.num_sensors, -1, 3)

    def picture(self, physics: Physics, rows: Rows) -> NDArray[np.uint8]:
        """Pictures in simulations ``rows``, (n, K, H, W, 3), top row first."""
        places, axes = self._in_world(physics, rows)
        poses = world_poses(physics, rows)
        return as_bytes(self.caster.image(poses, places, axes, self.fovs[rows], self.size, threads=self.threads))

    def _in_world(self, physics: Physics, rows: Rows) -> tuple[Float64, Float64]:
        bodies = self.mounts.body_ids
        body_places = physics.derived["xpos"][rows][:, bodies]
        body_axes = physics.derived["xmat"][rows].reshape(len(body_places), -1, 3, 3)[:, bodies]
        return to_world(self.places[rows], self.axes[rows], body_places, body_axes)


class ThirdPerson:
    """The first of the suite's own cameras of each body, as agents that learn from pixels are usually given."""

    derived: tuple[str, ...] = ("cam_xpos", "cam_xmat", *WorldPoses._fields)
    num_sensors: int = 1

    def __init__(self, caster: Caster, model: mujoco.MjModel, size: int, threads: int = 1):
        self.caster, self.size, self.threads = caster, size, threads
        self.fov = float(np.radians(model.cam_fovy[0]))

    def aim(self, rows: NDArray[np.int64], theta: Float64) -> None:
        """The camera stays where it is."""

    def read(self, physics: Physics, rows: Rows) -> NDArray[np.float32]:
        """What one photoreceptor in the camera's place reads, (n, 1, 1, 3)."""
        return self.caster.read(*self._view(physics, rows), grid=1, threads=self.threads).reshape(-1, 1, 1, 3)

    def picture(self, physics: Physics, rows: Rows) -> NDArray[np.uint8]:
        """Pictures in simulations ``rows``, (n, 1, H, W, 3), top row first."""
        return as_bytes(self.caster.image(*self._view(physics, rows), self.size, threads=self.threads))

    def _view(self, physics: Physics, rows: Rows) -> tuple[WorldPoses, Float64, Float64, Float64]:
        places = physics.derived["cam_xpos"][rows][:, :1]
        axes = physics.derived["cam_xmat"][rows].reshape(len(places), -1, 3, 3)[:, :1]
        return world_poses(physics, rows), places, axes, np.full((len(places), 1), self.fov)


def world_poses(physics: Physics, rows: Rows) -> WorldPoses:
    """Where the parts of simulations ``rows`` are."""
    return WorldPoses(*(physics.derived[name][rows] for name in WorldPoses._fields))


def as_bytes(pictures: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Pictures in 0..1 as the nearest bytes."""
    return (pictures * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)
