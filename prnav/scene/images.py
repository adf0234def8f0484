"""Image files to texels, whatever the kind of pixels, and no bigger than asked for.

A few kilobytes can hold hundreds of millions of pixels. An image is therefore decoded only where its pixels, at the
scale at which its format can be decoded, are no more than :data:`MAX_PIXELS`, and is turned into texels strip by strip,
so that no second copy of it is ever needed.
"""

from __future__ import annotations

import io
import math
import struct
import warnings
import zlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from prnav.errors import SceneError
from prnav.scene import decoders

MAX_SIDE = 16384
"""Longest side of an image [pixels] that is looked at; PIL's own limit on their product (179 M) holds too."""

MAX_PIXELS = 1 << 26
"""Most pixels of an image that are ever decoded: as many as a scene's textures keep together by default. A JPEG that
has more is decoded at a half, a quarter or an eighth of its size where that is enough; any other is refused."""

_STRIP = 1 << 20
"""About how many pixels of an image are turned into texels at once."""

_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF", "TIFF", "TGA", "PPM")
"""What PIL may take a file for: kinds that textures have, and none that starts another program."""

_PIL_ERRORS = (OSError, ValueError, SyntaxError, EOFError, IndexError, KeyError, TypeError, struct.error, zlib.error)
"""What PIL's readers raise for files that are not what they say."""


@dataclass(frozen=True, eq=False)
class EncodedImage:
    """A PNG, JPEG, KTX 2 or other image whose size is known and whose pixels are not decoded yet.

    Attributes:
        data: the file's bytes.
        where: what errors call it.
    """

    data: bytes | memoryview
    where: str

    @property
    def alteration(self) -> bytes:
        """What is done to the texels, so that two images of the same data are told apart; nothing here."""
        return b""

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, read from the header.

        Raises:
            SceneError: not an image, or too big.
        """
        if decoders.is_basis(self.data):
            return self._checked(self._basis_size())
        try:
            return self._checked(self._open().size)
        except Image.DecompressionBombError as error:
            raise self._too_big(error) from error
        except _PIL_ERRORS as error:
            raise self._unreadable(error) from error

    def decode(self, factor: int = 1) -> NDArray[np.uint8]:
        """RGBA texels (ceil(H / factor), ceil(W / factor), 4), top row first, each the mean of those it replaces.

        Raises:
            SceneError: not an image, cut off, or too big.
        """
        size = self.size  # refuses what is too big before it is decoded
        if decoders.is_basis(self.data):
            self._bounded(size)
            try:
                return reduced_texels(np.asarray(decoders.decode_basis(self.data)), size, factor)
            except ValueError as error:
                raise self._broken_basis(error) from error
        try:
            image = self._open()
            if size[0] * size[1] > MAX_PIXELS:  # only a JPEG can be decoded smaller than it is, by up to 8
                scale = min(factor, 8)
                image.draft(None, (-(-size[0] // scale), -(-size[1] // scale)))
                factor //= max(1, round(size[0] / image.size[0]))
            self._bounded(image.size)
            image.load()
            return reduced_texels(image, image.size, factor)
        except Image.DecompressionBombError as error:
            raise self._too_big(error) from error
        except _PIL_ERRORS as error:
            raise self._unreadable(error) from error

    def _open(self) -> Image.Image:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            return Image.open(io.BytesIO(self.data), formats=_FORMATS)

    def _basis_size(self) -> tuple[int, int]:
        if not decoders.available("KHR_texture_basisu"):
            raise SceneError(
                f"{self.where} is a KTX 2 / Basis Universal texture, and no decoder for it is installed; "
                f"{decoders.INSTALL}, or export with PNG or JPEG textures"
            )
        try:
            return decoders.basis_size(self.data)
        except ValueError as error:
            raise self._broken_basis(error) from error

    def _checked(self, size: tuple[int, int]) -> tuple[int, int]:
        if max(size) > MAX_SIDE or min(size) < 1:
            raise SceneError(
                f"{self.where} has {size[0]} x {size[1]} pixels; valid are 1 to {MAX_SIDE} a side: shrink it"
            )
        return size

    def _bounded(self, size: tuple[int, int]) -> None:
        if size[0] * size[1] > MAX_PIXELS:
            raise SceneError(
                f"{self.where} has {size[0]} x {size[1]} pixels; at most {MAX_PIXELS} are decoded: shrink it to "
                f"{math.isqrt(MAX_PIXELS)} a side"
            )

    def _too_big(self, error: Exception) -> SceneError:
        return SceneError(f"{self.where} is too big to decode ({error}); shrink it under {MAX_SIDE} a side")

    def _broken_basis(self, error: Exception) -> SceneError:
        return SceneError(
            f"{self.where} is a Basis texture that cannot be read ({error}); copy or export the file again"
        )

    def _unreadable(self, error: Exception) -> SceneError:
        reason = str(error).split("\n")[0].replace(repr(error), "")
        if isinstance(error, Image.UnidentifiedImageError):
            reason = f"starts with {bytes(self.data[:8])!r}"
        return SceneError(f"{self.where} is not an image that can be read ({reason}); valid: PNG, JPEG, WebP, KTX 2")


def reduction(size: tuple[int, int], max_texture_size: int) -> int:
    """Smallest power of two by which an image must shrink for no side to be over ``max_texture_size``."""
    factor = 1
    while -(-max(size) // factor) > max_texture_size:
        factor *= 2
    return factor


def reduced_texels(image: Image.Image | NDArray[np.uint8], size: tuple[int, int], factor: int) -> NDArray[np.uint8]:
    """RGBA texels of a decoded image of a size (width, height), strip by strip."""
    width, height = size
    texels = np.empty((-(-height // factor), -(-width // factor), 4), np.uint8)
    rows = factor * max(1, _STRIP // (width * factor))
    for top in range(0, height, rows):
        end = min(top + rows, height)
        if isinstance(image, np.ndarray):
            strip = Image.fromarray(np.ascontiguousarray(image[top:end]))
        else:
            strip = image.crop((0, top, width, end)) if rows < height else image
        texels[top // factor : -(-end // factor)] = _strip_texels(strip, factor)
    return texels


def _strip_texels(image: Image.Image, factor: int) -> NDArray[np.uint8]:
    """RGBA texels of some rows of an image, each the mean of factor x factor pixels."""
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
