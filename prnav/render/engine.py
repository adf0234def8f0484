"""What every rendering engine offers, whatever it is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from prnav.render.rays import Views
from prnav.render.sampling import Sampling

Float32 = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class EngineOptions:
    """What an engine is made with, apart from its scenes."""

    background: NDArray[np.float64]
    """Colour of misses, 0 to 1, (3,)."""
    sphere_color: NDArray[np.float64]
    """Colour of spheres, 0 to 1, (3,)."""
    device: str = "cpu"
    memory: float = 8e9
    """Bytes that prepared scenes may take; see :class:`prnav.render.residents.Residents`."""


class Engine(Protocol):
    """Light and depth of views in scenes; ``scene_of_view`` (M,) are indices into the engine's scenes.

    Engines are made from the scenes and an :class:`EngineOptions`.
    """

    name: str

    def radiance(
        self,
        scene_of_view: NDArray[np.int64],
        views: Views,
        grid: int,
        sampling: Sampling,
        spheres: NDArray[np.float64] | None = None,
    ) -> Float32:
        """Weighted mean colour of each of grid x grid patches' rays, shape (M, grid, grid, 3), 0 to 1.

        ``spheres`` (M, 4) are centre and radius [m] of an opaque sphere per view, radius 0 for none.
        """
        ...

    def depth(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: NDArray[np.float64] | None = None
    ) -> Float32:
        """z-depth [m] at the pixel centres, shape (M, size, size); inf on a miss."""
        ...
