"""The record of a triangle for shading: 64 bytes, the same on the CPU and on the GPU."""

from __future__ import annotations

import numpy as np

SURFACE = np.dtype(
    [
        *((name, np.float32) for name in ("u", "v", "u1", "v1", "u2", "v2", "texels", "density")),
        *((name, np.int32) for name in ("offset", "width", "height", "coarsest", "color0", "color1", "color2")),
        ("tinted", np.int32),
    ]
)
"""Record of a triangle, 64 bytes.

u, v of corner 0 and the differences of corners 1 and 2 to it; its doubled area in texels of level 0, and texels per
square metre; its texture's first texel, width, height and coarsest level allowed; the corners' colours as
``red | green << 8 | blue << 16``, and 1 where any is not white.
"""
