"""Light as an environment's settings have it: the renderer, and what stands between light and readings.

Shapes: n agents, K sensors on each, B x B receptors or H x W pixels a sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.render import Renderer
from prnav.sensors import read_out

if TYPE_CHECKING:
    from prnav.domains.navigation.env.settings.sensors import SensorSettings
    from prnav.scene import SceneMesh


class Viewpoints(NamedTuple):
    """Where the sensors of n agents are, and what readings depend on beside."""

    scenes: NDArray[np.integer[Untyped]]
    """Index of each agent's scene, (n,)."""
    positions: NDArray[np.float64]
    """Feet [m], (n, 3)."""
    yaws: NDArray[np.float64]
    """Headings [rad], (n,)."""
    poses: NDArray[np.float64]
    """Sensor poses on the body, (n, K, 7)."""
    spheres: NDArray[np.float64] | None
    """Centre and radius [m] of a sphere that each agent alone sees, (n, 4)."""
    keys: NDArray[np.uint64] | None
    """Whose noise it is, (n,): of an episode; needed where there is noise."""
    steps: NDArray[np.int64] | None
    """Steps taken in the episode, (n,); needed where there is noise."""
    on_device: bool = False
    """Whether results may stay on the renderer's device, as tensors."""


class Light:
    """Reads receptors and cameras in scenes."""

    def __init__(
        self, scenes: Sequence[SceneMesh], settings: SensorSettings, rays_per_receptor: int | None = None
    ) -> None:
        """Light in ``scenes``, with as many rays as ``settings`` say where none are given.

        Raises:
            RenderError: the engine cannot run here, or not on that device.
        """
        self.readout = settings.readout
        self.renderer = Renderer(
            scenes,
            settings.device,
            settings.engine,
            settings.rays_per_receptor if rays_per_receptor is None else rays_per_receptor,
            acceptance=settings.readout.acceptance,
        )

    @property
    def is_on_gpu(self) -> bool:
        """Whether the renderer's device is a GPU."""
        return self.renderer.device != "cpu"

    def readings(self, at: Viewpoints, grid: int) -> Untyped:
        """What receptors read, (n, K, B * B, 3) float32 in 0 to 1, row by row from the top left.

        An array on the host, or, where they may stay on the device and nothing is done to them there, a tensor.
        """
        view, shape = at[:4], (*at.poses.shape[:2], grid * grid, 3)
        if at.on_device and self.readout.is_ideal:
            return _tensor(self.renderer.read_on_device(*view, grid=grid, spheres=at.spheres))
        light = self.renderer.read(*view, grid=grid, spheres=at.spheres).reshape(shape)
        return read_out(light, self.readout, at.keys, at.steps)

    def pictures(self, at: Viewpoints, size: int) -> Untyped:
        """What cameras see as the nearest bytes, (n, K, H, W, 3) uint8; on the device as :meth:`readings`."""
        view, shape = at[:4], (*at.poses.shape[:2], size, size, 3)
        if at.on_device and self.readout.is_ideal:
            import torch

            there = _tensor(self.renderer.image_on_device(*view, size=size, spheres=at.spheres))
            return (there * 255.0 + 0.5).to(torch.uint8).reshape(shape)
        light = self.renderer.image(*view, size=size, spheres=at.spheres)
        return as_bytes(read_out(light, self.readout, at.keys, at.steps))


def as_bytes(pictures: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Pictures in 0..1 as the nearest bytes."""
    return (pictures * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)


def _tensor(values: Untyped) -> Untyped:
    """An array that lies on a device as a tensor over the same memory, through DLPack."""
    import torch

    return torch.from_dlpack(values)
