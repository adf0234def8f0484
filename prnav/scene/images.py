"""Image files to texels, whatever the kind of pixels, and no bigger than asked for."""

from __future__ import annotations

import io
import struct
import warnings
import zlib

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from prnav.errors import SceneError

MAX_SIDE = 16384
"""Longest side of an image [pixels] that is decoded at all; PIL's own limit on their product (179 M) holds too."""


def decode_image(data: bytes, max_texture_size: int, where: str) -> NDArray[np.uint8]:
    """RGBA texels (H, W, 4), top row first, of a PNG, JPEG or any other image that PIL reads.

    An image with a side over ``max_texture_size`` is reduced by the smallest power of two that brings it under, each
    texel the mean of those it replaces.

    Raises:
        SceneError: not an image, cut off, or too big; ``where`` names it.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(data))
        if max(image.size) > MAX_SIDE or min(image.size) < 1:
            size = f"{image.size[0]} x {image.size[1]} pixels"
            raise SceneError(f"{where} has {size}; valid are 1 to {MAX_SIDE} a side: shrink it")
        image.load()
    except Image.DecompressionBombError as error:
        raise SceneError(f"{where} is too big to decode ({error}); shrink it under {MAX_SIDE} a side") from error
    except (OSError, ValueError, SyntaxError, EOFError, IndexError, struct.error, zlib.error) as error:
        reason = str(error).split("\n")[0].replace(repr(error), "")
        if isinstance(error, Image.UnidentifiedImageError):
            reason = f"starts with {data[:8]!r}"
        raise SceneError(f"{where} is not an image that can be read ({reason}); valid: PNG, JPEG, WebP") from error
    return _texels(image, max_texture_size)


def _texels(image: Image.Image, max_texture_size: int) -> NDArray[np.uint8]:
    factor = 1
    while -(-max(image.size) // factor) > max_texture_size:
        factor *= 2
    if image.mode[0] in "IF":
        image = _eight_bits(image)
    alpha = image.convert("RGBA").getchannel("A") if image.mode in ("LA", "La", "PA", "RGBA", "RGBa") else None
    if alpha is None and "transparency" in image.info:
        alpha = image.convert("RGBA").getchannel("A")
    rgb = image.convert("RGB")
    if factor > 1:  # colour and alpha apart: PIL would weigh colours by alpha
        rgb = rgb.reduce(factor)
        alpha = alpha.reduce(factor) if alpha is not None else None
    texels = np.full((rgb.height, rgb.width, 4), 255, np.uint8)
    texels[..., :3] = np.asarray(rgb)
    if alpha is not None:
        texels[..., 3] = np.asarray(alpha)
    return texels


def _eight_bits(image: Image.Image) -> Image.Image:
    """Greyscale of 16 bits or real numbers as 8 bits; PIL alone would clip it."""
    values = np.asarray(image)
    if image.mode == "F":
        grey = np.clip(np.nan_to_num(values), 0.0, 1.0) * 255.0 + 0.5
    else:
        grey = np.clip(values, 0, 65535) / 257.0 + 0.5
    return Image.fromarray(grey.astype(np.uint8))
