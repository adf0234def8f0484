"""What shading needs of each triangle, in one record of one cache line: the same bytes on the CPU and on the GPU."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.errors import RenderError
from prnav.render.charts import cached_coarsest_levels
from prnav.render.kernels import fill_surfaces
from prnav.render.surface_record import SURFACE

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

LINE = 64
"""Bytes of a cache line."""


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Records of a mesh's triangles and its texels."""

    records: Array
    """Of type :data:`prnav.render.surface_record.SURFACE`, shape (F,), each in a cache line of its own."""
    texels: NDArray[np.uint32]
    """``red | green << 8 | blue << 16 | alpha << 24``, shape (T,)."""

    @classmethod
    def of(cls, mesh: SceneMesh) -> Surfaces:
        """Records of a mesh.

        Raises:
            RenderError: its textures have 2^31 texels or more.
        """
        count = len(mesh.atlas.texels)
        if count >= 2**31:
            raise RenderError(f"scene {mesh.name}: its textures have {count} texels; fewer than 2^31 are supported")
        space = np.zeros(len(mesh.faces) * SURFACE.itemsize + LINE, dtype=np.uint8)
        first = -space.ctypes.data % LINE
        records = space[first : first + len(mesh.faces) * SURFACE.itemsize].view(SURFACE)
        table = mesh.atlas.table
        levels = cached_coarsest_levels(mesh)
        fill_surfaces(mesh.vertices, mesh.faces, mesh.uvs, mesh.face_texture, mesh.colors, table, levels, records)
        texels = np.ascontiguousarray(mesh.atlas.texels).view(np.uint32).ravel()
        return cls(records, texels if sys.byteorder == "little" else texels.byteswap())

    @property
    def nbytes(self) -> int:
        """Memory [bytes]."""
        return int(self.records.nbytes + self.texels.nbytes)
