"""A camera: one sensor of a design, read as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.render import Renderer
from prnav.sensors.design import Design
from prnav.sensors.design_file import load_design
from prnav.sensors.readout import Readout, read_out

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh


@dataclass(frozen=True)
class CameraConfig:
    """A camera on the body; the defaults are the paper's size and Habitat's usual pose."""

    design: str = "habitat-camera"
    """Name in the design library, or path of a design file with one sensor."""
    size: int = 128
    """Pixels per side."""
    engine: Literal["auto", "embree", "warp", "reference", "egl", "osmesa"] = "auto"
    device: str = "cpu"
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Colour (0 to 1) where a ray meets nothing."""
    exposure: float = 1.0
    """Factor on the light; see :class:`prnav.sensors.readout.Readout`."""
    noise: float = 0.0
    """Standard deviation of the read-out noise as a share of full scale."""
    bits: int = 0
    """Bits that a pixel's colours are quantised to; 0 for none."""

    @property
    def readout(self) -> Readout:
        """The settings between light and pictures."""
        return Readout((self.exposure,), (self.noise,), (self.bits,))

    def __post_init__(self) -> None:
        if self.size < 1:
            raise ValueError(f"size is {self.size}; it must be at least 1")
        Readout((self.exposure,), (self.noise,), (self.bits,))


class Camera:
    """The cameras of a batch of agents: one initial design, any design per agent."""

    def __init__(self, config: CameraConfig, scenes: Sequence[SceneMesh]) -> None:
        """Camera in ``scenes``.

        Raises:
            DesignError: the design cannot be used, or has more than one sensor.
            RenderError: the engine cannot be used.
        """
        self.config = config
        self.design: Design = load_design(config.design, sensors=1)
        self.renderer = Renderer(scenes, config.device, config.engine, background=config.background)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of one agent's picture: rows, columns, colours."""
        return self.config.size, self.config.size, 3

    def read(
        self,
        scene_ids: ArrayLike,
        positions: ArrayLike,
        yaws: ArrayLike,
        designs: ArrayLike | None = None,
        seeds: ArrayLike | None = None,
        steps: ArrayLike | None = None,
    ) -> NDArray[np.float32]:
        """Pictures, shape (N, H, W, 3), 0 to 1, top row first; arguments as for photoreceptors, K = 1."""
        light = self.renderer.image(scene_ids, positions, yaws, self._designs(yaws, designs), self.config.size)
        return read_out(light, self.config.readout, seeds, steps)[:, 0]

    def depth(
        self, scene_ids: ArrayLike, positions: ArrayLike, yaws: ArrayLike, designs: ArrayLike | None = None
    ) -> NDArray[np.float32]:
        """z-depth [m], shape (N, H, W); inf where there is nothing."""
        return self.renderer.depth(scene_ids, positions, yaws, self._designs(yaws, designs), self.config.size)[:, 0]

    def _designs(self, yaws: ArrayLike, designs: ArrayLike | None) -> ArrayLike:
        if designs is not None:
            return designs
        return np.broadcast_to(self.design.sensors, (len(np.asarray(yaws)), 1, 7))
