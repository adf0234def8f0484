"""Rays to radiance: what sensors on agents' bodies see, by ray casting or by rasteriser."""

from prnav.render.renderer import ENGINES, Renderer

__all__ = ["ENGINES", "Renderer"]
