"""Photoreceptor grids: averages of light over patches of each sensor's view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.aliases import Untyped
from prnav.errors import DesignError
from prnav.render import Renderer
from prnav.sensors.design import Design
from prnav.sensors.design_file import load_design
from prnav.sensors.readout import Readout, read_out

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh


@dataclass(frozen=True)
class PhotoreceptorConfig:
    """Photoreceptors of an agent and how their light is computed."""

    design: str = "forward"
    """Name in the design library, or path of a design file."""
    grid: int | None = None
    """Receptors per row of each sensor; the design's own if not given."""
    rays_per_receptor: int = 16
    """Rays averaged in a receptor: a square number. Error against cost: see docs/rendering.md."""
    pattern: Literal["grid", "lattice"] = "grid"
    """Where a receptor's rays lie in its patch."""
    engine: Literal["auto", "embree", "warp", "reference", "egl", "osmesa"] = "auto"
    device: str = "cpu"
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Colour (0 to 1) where a ray meets nothing."""
    acceptance: Literal["uniform", "cosine", "gaussian"] = "uniform"
    """How much light counts across a receptor's patch."""
    exposure: tuple[float, ...] = (1.0,)
    """Factor on the light, one for all sensors or one for each; see :class:`prnav.sensors.readout.Readout`."""
    noise: tuple[float, ...] = (0.0,)
    """Standard deviation of the read-out noise as a share of full scale, likewise."""
    bits: tuple[int, ...] = (0,)
    """Bits that a reading is quantised to, likewise; 0 for none."""

    @property
    def readout(self) -> Readout:
        """The settings between light and readings."""
        return Readout(self.exposure, self.noise, self.bits)

    def __post_init__(self) -> None:
        if self.grid is not None and self.grid < 1:
            raise ValueError(f"grid is {self.grid}; it must be at least 1")
        Readout(self.exposure, self.noise, self.bits)


class Photoreceptors:
    """The photoreceptors of a batch of agents: one initial design, any design per agent."""

    def __init__(self, config: PhotoreceptorConfig, scenes: Sequence[SceneMesh]) -> None:
        """Photoreceptors in ``scenes``.

        Raises:
            DesignError: the design cannot be used, or the read-out settings do not fit its sensors.
            RenderError: the engine cannot be used.
        """
        self.config = config
        self.design: Design = load_design(config.design)
        self.grid = self.design.grid if config.grid is None else config.grid
        config.readout.per_sensor(self.design.num_sensors)
        self.renderer = Renderer(
            scenes,
            config.device,
            config.engine,
            config.rays_per_receptor,
            config.background,
            config.pattern,
            acceptance=config.acceptance,
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of one agent's readings: sensors, receptors per sensor, colours."""
        return self.design.num_sensors, self.grid * self.grid, 3

    def read(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike | None = None,
        seeds: ArrayLike | None = None,
        steps: ArrayLike | None = None,
    ) -> NDArray[np.float32]:
        """Readings, shape (N, K, B * B, 3), 0 to 1, receptors row by row from the top left.

        Args:
            scene_ids: index of each agent's scene, shape (N,).
            positions: feet [m], shape (N, 3).
            yaws: headings [rad], shape (N,).
            designs: sensor poses on the bodies, shape (N, K, 7); the initial design for all if not given.
            seeds: one of each agent's episode, shape (N,); needed where there is noise.
            steps: each agent's step in its episode, shape (N,); needed where there is noise.
        """
        readings = self.renderer.read(scene_ids, positions, yaws, self._designs(yaws, designs), self.grid)
        light = readings.reshape(*readings.shape[:2], self.grid * self.grid, 3)
        return read_out(light, self.config.readout, seeds, steps)

    def read_on_device(
        self, scene_ids: ArrayLike, positions: ArrayLike, yaws: ArrayLike, designs: ArrayLike | None = None
    ) -> Untyped:
        """The same left on the renderer's device; see :meth:`prnav.render.Renderer.read_on_device`.

        Raises:
            DesignError: there are read-out settings, which are applied on the host.
        """
        if not self.config.readout.is_ideal:
            raise DesignError("exposure, noise and bits are applied on the host; leave them at their defaults, or read")
        return self.renderer.read_on_device(scene_ids, positions, yaws, self._designs(yaws, designs), self.grid)

    def _designs(self, yaws: ArrayLike, designs: ArrayLike | None) -> ArrayLike:
        if designs is not None:
            return designs
        return np.broadcast_to(self.design.sensors, (len(np.asarray(yaws)), *self.design.sensors.shape))
