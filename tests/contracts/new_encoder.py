"""An encoder in one module: sines of the vectors."""

import torch
from torch import nn


class SineEncoder(nn.Module):
    """Sines of a linear map of all vector observations."""

    def __init__(self, config, specs):
        super().__init__()
        self.keys = sorted(name for name, spec in specs.items() if spec.kind == "vector")
        self.layer = nn.Linear(sum(specs[name].shape[0] for name in self.keys), config.width)

    def forward(self, observations):
        return torch.sin(self.layer(torch.cat([observations[name] for name in self.keys], dim=-1)))
