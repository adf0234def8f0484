"""Encoders of pictures: the shallow transformer of the paper's camera agent, and a ResNet-50.

Letters in shapes: B batch, K cameras, H and W pixels, D encoder width. Pictures are (B, K, H, W, 3) uint8.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.autograd.function import once_differentiable
from torch.nn import functional

from prnav.aliases import Untyped
from prnav.contracts import ObservationSpecs
from prnav.errors import ConfigError
from prnav.policy.actions.head import orthogonal
from prnav.policy.block_kernels import COMPILED, Floats
from prnav.policy.config import PolicyConfig
from prnav.policy.encoders import TokenTransformer, scale_readings, token_parts
from prnav.policy.features import vector_features
from prnav.policy.observed import Observations, seen_with_design, vector_keys

PATCH = 16
"""Pixels per side of a patch (paper, section "Architecture")."""

PICTURES_AT_ONCE, PICTURES_AT_ONCE_ON_GPU = 16, 4096
"""Pictures that are turned into patches at a time: on a CPU (3 MB at 128 x 128), patches are read while in cache."""


def _pictures(specs: ObservationSpecs, encoder: str) -> tuple[str, str, tuple[int, int, int]]:
    """Names of pictures and design; K, pixels per side, and the length of one design vector."""
    pictures, design = seen_with_design(specs, "image", encoder, "set env.camera_size, or use another encoder")
    cameras, rows, columns, _ = specs[pictures].shape
    if rows % PATCH or columns % PATCH:
        raise ConfigError(
            f"policy encoder {encoder!r} needs pictures whose sides are multiples of {PATCH}; they have {rows} x "
            f"{columns} pixels: change env.camera_size"
        )
    return pictures, design, (cameras, rows, specs[design].shape[1])


def pixels(pictures: Tensor) -> Tensor:
    """Pictures of bytes as readings about 0 with about unit variance, float32."""
    return scale_readings(pictures.float() / 255.0)


def patches(pictures: Tensor) -> Tensor:
    """Patches (N, P, PATCH * PATCH * 3) of pictures (N, H, W, 3), row by row from the top left, as :func:`pixels`."""
    count, rows, columns, colours = pictures.shape
    shape = (count, (rows // PATCH) * (columns // PATCH), PATCH * PATCH * colours)
    grid = pictures.reshape(count, rows // PATCH, PATCH, columns // PATCH, PATCH * colours)
    if not _compiled(pictures):
        return pixels(grid.transpose(2, 3)).reshape(shape)
    out = np.empty((count, rows // PATCH, columns // PATCH, PATCH, PATCH * colours), dtype=np.float32)
    _cut(grid.numpy(), out)
    return torch.from_numpy(out).view(shape)


def _compiled(pictures: Tensor) -> bool:
    """Whether a compiled loop makes the patches: on a CPU."""
    return pictures.device.type == "cpu" and not torch.compiler.is_compiling()


@njit(**COMPILED)
def _cut(grid: NDArray[np.uint8], out: Floats) -> None:
    """Patches (N, R, C, PATCH, PATCH * 3) of pictures (N, R, PATCH, C, PATCH * 3) in one pass."""
    count, rows, height, columns, width = grid.shape
    for n in range(count):
        for r in range(rows):
            for y in range(height):
                for c in range(columns):
                    line, result = grid[n, r, y, c], out[n, r, c, y]
                    for i in range(width):
                        result[i] = np.float32(line[i]) * np.float32(4.0 / 255.0) - np.float32(2.0)


def _batches(pictures: Tensor) -> Iterator[tuple[slice, Tensor]]:
    """Patches of some pictures at a time, and which."""
    size = PICTURES_AT_ONCE if _compiled(pictures) else PICTURES_AT_ONCE_ON_GPU
    for first in range(0, max(1, len(pictures)), size):
        some = slice(first, first + size)
        yield some, patches(pictures[some])


class PatchMap(torch.autograd.Function):
    """A linear map of patches that keeps only the pictures' bytes for the way back, a quarter of the patches' size.

    Patches are made twice, which costs less than to store and fetch them.
    """

    @staticmethod
    def forward(ctx: Untyped, pictures: Tensor, weight: Tensor) -> Tensor:
        """Tokens (N, P, D) of pictures (N, H, W, 3) by a weight (D, PATCH * PATCH * 3)."""
        ctx.save_for_backward(pictures)
        return torch.cat([functional.linear(some, weight) for _, some in _batches(pictures)])

    @staticmethod
    @once_differentiable
    def backward(ctx: Untyped, grad: Tensor) -> tuple[None, Tensor]:
        """Gradient of the weight, float32 whatever the tokens are."""
        (pictures,) = ctx.saved_tensors
        total = torch.zeros(grad.shape[-1], PATCH * PATCH * pictures.shape[-1], device=grad.device)
        for which, some in _batches(pictures):
            total.addmm_(grad[which].flatten(0, 1).t().float(), some.flatten(0, 1))
        return None, total


class CameraEncoder(TokenTransformer):
    """The photoreceptors' transformer over patches: one token [flat patch of 16 x 16 pixels, design, its place]."""

    def make_sight(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        """Places in the picture, and the map to tokens."""
        self.pictures, self.design, (_, side, design) = _pictures(specs, config.encoder)
        self.positions = nn.Parameter(0.02 * torch.randn((side // PATCH) ** 2, config.position_width))
        self.patch_token = nn.Linear(PATCH * PATCH * 3 + design + config.position_width, config.width)

    def sight_tokens(self, observations: Observations) -> Tensor:
        """Tokens (B, K * patches, D) of the patches of each camera in turn, row by row from the top left."""
        pictures = observations[self.pictures]
        of_patch, designs, places = token_parts(self.patch_token, observations[self.design], self.positions)
        sight: Tensor = PatchMap.apply(pictures.flatten(0, 1), of_patch).view(*pictures.shape[:2], len(places), -1)  # type: ignore[no-untyped-call]
        return (sight + designs[:, :, None] + places).flatten(1, 2)


class ResNetEncoder(nn.Module):
    """torchvision's ResNet-50 with group norm in place of batch norm, as DD-PPO has it, and an MLP that joins all.

    Each picture makes 2048 features after the mean over its places; these, the designs and the vector observations
    go through one linear layer.
    """

    def __init__(self, config: PolicyConfig, specs: ObservationSpecs) -> None:
        super().__init__()
        self.pictures, self.design, (cameras, _, design) = _pictures(specs, config.encoder)
        try:
            resnet = importlib.import_module("torchvision.models").resnet50
        except (
            ImportError,
            RuntimeError,
            AttributeError,
        ) as error:  # one for another torch fails so
            raise ConfigError(
                f"policy encoder 'resnet50' needs torchvision ({' '.join(str(error).split())[:80]}); install the one "
                f"that belongs to torch {torch.__version__} (pip install torchvision), or use encoder 'camera'"
            ) from error
        self.backbone = resnet(norm_layer=lambda channels: nn.GroupNorm(32, channels))
        features = self.backbone.fc.in_features
        self.backbone.fc = nn.Identity()
        self.keys = vector_keys(specs)
        vectors = sum(vector_features(key, specs[key].shape[0])[1] for key in self.keys)
        self.join = nn.Sequential(
            orthogonal(nn.Linear(cameras * (features + design) + vectors, config.width)), nn.ReLU()
        )

    def forward(self, observations: Observations) -> Tensor:
        """Encoding (B, D)."""
        pictures = pixels(observations[self.pictures])
        batch = len(pictures)
        channels_first = pictures.flatten(0, 1).permute(0, 3, 1, 2)
        parts = [self.backbone(channels_first).view(batch, -1), observations[self.design].flatten(1)]
        parts += [vector_features(key, 0)[0](observations[key]) for key in self.keys]
        encoding: Tensor = self.join(torch.cat(parts, dim=-1))
        return encoding
