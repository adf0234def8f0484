"""What a sensor is, and what it is told of the agents that it is read for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.contracts import ObservationSpec
from prnav.domains.navigation.light import Light, Viewpoints

if TYPE_CHECKING:
    from prnav.domains.navigation.env.config import NavigationConfig
    from prnav.sensors import Design

PI = float(np.float32(np.pi) + np.float32(1e-6))
"""Bound of angles in float32."""


class Situation(NamedTuple):
    """Where n agents are in their episodes; K sensors on each body."""

    scenes: NDArray[np.integer[Untyped]]
    """Index of each agent's scene in the world, (n,)."""
    positions: NDArray[np.float64]
    """Feet [m], (n, 3)."""
    yaws: NDArray[np.float64]
    """Headings [rad], (n,)."""
    starts: NDArray[np.float64]
    """Where their episodes started [m], (n, 3)."""
    start_yaws: NDArray[np.float64]
    """Headings there [rad], (n,)."""
    goals: NDArray[np.float64]
    """Where to go [m], (n, 3)."""
    theta: NDArray[np.float64]
    """Normalised designs, (n, K, 7)."""
    poses: NDArray[np.float64]
    """The same as sensor poses on the body, (n, K, 7)."""
    spheres: NDArray[np.float64] | None
    """Centres and radii [m] of targets that can be seen, (n, 4); None in tasks without."""
    keys: NDArray[np.uint64] | None
    """Key of each agent's episode, from which a sensor draws its noise, (n,); None where the light has none."""
    steps: NDArray[np.int64]
    """Steps taken in the episode, (n,)."""
    light: Light | None
    """Renders; None where no sensor needs it."""
    on_device: bool = False
    """Whether readings may stay on the light's device, as tensors."""

    @property
    def viewpoints(self) -> Viewpoints:
        """The part that light depends on."""
        return Viewpoints(
            self.scenes, self.positions, self.yaws, self.poses, self.spheres, self.keys, self.steps, self.on_device
        )


class Sensor(Protocol):
    """One named observation of the agents of an environment."""

    name: str
    """As observations and ``env.sensors`` have it."""

    @property
    def spec(self) -> ObservationSpec:
        """What one agent is shown."""
        ...

    @property
    def space(self) -> spaces.Box:
        """The same as a Gymnasium space; :func:`box` where the spec says all."""
        ...

    def read(self, now: Situation) -> Untyped:
        """Readings (n, ...) as :attr:`spec` has them: a new array."""
        ...


SensorType = Callable[["NavigationConfig", "Design"], Sensor]
"""Makes a sensor from an environment's settings and the initial design of its agents."""


def box(spec: ObservationSpec) -> spaces.Box:
    """The space of a spec, with the same bounds for all entries."""
    dtype = np.uint8 if spec.dtype == "uint8" else np.float32
    return spaces.Box(dtype(spec.low), dtype(spec.high), spec.shape, dtype)
