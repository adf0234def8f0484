"""Encoders of pictures: the shallow transformer of the paper's camera agent, and a ResNet-50.

Letters in shapes: B batch, K cameras, H and W pixels, D encoder width. Pictures are (B, K, H, W, 3) uint8.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping

import torch
from torch import Tensor, nn

from prnav.errors import ConfigError
from prnav.policy.config import PolicyConfig
from prnav.policy.encoders import (
    DESIGN,
    ENCODERS,
    Observations,
    Shapes,
    TokenTransformer,
    orthogonal,
    scale_readings,
    vector_keys,
)
from prnav.policy.features import vector_features

CAMERA = "camera"
PATCH = 16
"""Pixels per side of a patch (paper, section "Architecture")."""


def _camera_shape(shapes: Shapes, encoder: str) -> tuple[int, int, int]:
    """K, pixels per side, and the length of one design vector."""
    if CAMERA not in shapes or DESIGN not in shapes:
        raise ConfigError(
            f"policy encoder {encoder!r} needs the observations {CAMERA!r} and {DESIGN!r}; the environment gives "
            f"{', '.join(sorted(shapes))}; set env.camera_size, or use another encoder"
        )
    cameras, rows, columns, _ = shapes[CAMERA]
    if rows % PATCH or columns % PATCH:
        raise ConfigError(
            f"policy encoder {encoder!r} needs pictures whose sides are multiples of {PATCH}; they have {rows} x "
            f"{columns} pixels: change env.camera_size"
        )
    return cameras, rows, shapes[DESIGN][1]


def pixels(pictures: Tensor) -> Tensor:
    """Pictures of bytes as readings about 0 with about unit variance, float32."""
    return scale_readings(pictures.float() / 255.0)


class CameraEncoder(TokenTransformer):
    """The photoreceptors' transformer over patches: one token [flat patch of 16 x 16 pixels, design, its place]."""

    def make_sight(self, config: PolicyConfig, shapes: Shapes) -> None:
        """Places in the picture, and the map to tokens."""
        _, side, design = _camera_shape(shapes, config.encoder)
        self.positions = nn.Parameter(0.02 * torch.randn((side // PATCH) ** 2, config.position_width))
        self.patch_token = nn.Linear(PATCH * PATCH * 3 + design + config.position_width, config.width)

    def sight_tokens(self, observations: Observations) -> Tensor:
        """Tokens (B, K * patches, D) of the patches of each camera in turn, row by row from the top left."""
        pictures = pixels(observations[CAMERA])
        batch, cameras, rows, columns, colours = pictures.shape
        grid = pictures.view(batch, cameras, rows // PATCH, PATCH, columns // PATCH, PATCH, colours)
        patches = grid.transpose(3, 4).reshape(batch, cameras, -1, PATCH * PATCH * colours)
        count = patches.shape[2]
        designs = observations[DESIGN][:, :, None].expand(-1, -1, count, -1)
        places = self.positions.expand(batch, cameras, -1, -1)
        return self.patch_token(torch.cat([patches, designs, places], dim=-1)).flatten(1, 2)


class ResNetEncoder(nn.Module):
    """torchvision's ResNet-50 with group norm in place of batch norm, as DD-PPO has it, and an MLP that joins all.

    Each picture makes 2048 features after the mean over its places; these, the designs and the vector observations
    go through one linear layer.
    """

    def __init__(self, config: PolicyConfig, shapes: Shapes) -> None:
        super().__init__()
        cameras, _, design = _camera_shape(shapes, config.encoder)
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
        self.keys = vector_keys(shapes)
        vectors = sum(vector_features(key, shapes[key][0])[1] for key in self.keys)
        self.join = nn.Sequential(
            orthogonal(nn.Linear(cameras * (features + design) + vectors, config.width)), nn.ReLU()
        )

    def forward(self, observations: Observations) -> Tensor:
        """Encoding (B, D)."""
        pictures = pixels(observations[CAMERA])
        batch = len(pictures)
        channels_first = pictures.flatten(0, 1).permute(0, 3, 1, 2)
        parts = [self.backbone(channels_first).view(batch, -1), observations[DESIGN].flatten(1)]
        parts += [vector_features(key, 0)[0](observations[key]) for key in self.keys]
        return self.join(torch.cat(parts, dim=-1))


ALL_ENCODERS: Mapping[str, type[nn.Module]] = {**ENCODERS, "camera": CameraEncoder, "resnet50": ResNetEncoder}
"""All by the name that a config gives them."""
