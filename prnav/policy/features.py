"""Vector observations (where the agent is, where its goal is) as bounded, well-scaled network inputs.

Distances span centimetres (is this the goal?) to tens of metres (is it in another room?), so they enter as a logarithm,
as an exponential that tells the last metre, and as a Gaussian bump that is steepest where a stop is decided (at 0.2 m);
angles enter as sine and cosine, so that nothing jumps at pi.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import torch
from torch import Tensor

Features = Callable[[Tensor], Tensor]


def direction_features(distance: Tensor, bearing: Tensor) -> Tensor:
    """Features (..., 5) of a place at ``distance`` [m] and ``bearing`` [rad], both (...)."""
    near = torch.exp(-((4.0 * distance) ** 2))
    return torch.stack([torch.log1p(distance), torch.exp(-2.0 * distance), near, bearing.sin(), bearing.cos()], dim=-1)


def pointgoal_features(pointgoal: Tensor) -> Tensor:
    """Features (..., 5) of a goal given as distance [m] and bearing [rad], (..., 2)."""
    return direction_features(pointgoal[..., 0], pointgoal[..., 1])


def gps_features(gps: Tensor) -> Tensor:
    """Features (..., 5) of a position [m] in the frame of the episode's start, ahead and right, (..., 2)."""
    ahead, right = gps[..., 0], gps[..., 1]
    return direction_features(torch.hypot(ahead, right), torch.atan2(right, ahead))


def compass_features(compass: Tensor) -> Tensor:
    """Features (..., 2) of a heading [rad] relative to the episode's start, (..., 1)."""
    return torch.cat([compass.sin(), compass.cos()], dim=-1)


def displacement_features(fixes: Tensor, last: Tensor) -> Tensor:
    """Features (..., 2) of the way moved since the last step: ahead and right of the heading then, a step being near 1.

    Where it is short of what was asked for, something was in the way.

    Args:
        fixes: GPS (ahead, right of the start) and compass now, (..., 3) [m, m, rad].
        last: The same at the last step.
    """
    ahead, right = (fixes - last)[..., :2].unbind(-1)
    cosine, sine = last[..., 2].cos(), last[..., 2].sin()
    return 4.0 * torch.stack([ahead * cosine - right * sine, ahead * sine + right * cosine], dim=-1)


def symmetric_log(values: Tensor) -> Tensor:
    """Features of any other vector: sign(x) log(1 + abs(x)), shape of the input."""
    return torch.sign(values) * torch.log1p(values.abs())


KNOWN: Mapping[str, tuple[Features, int]] = {
    "gps": (gps_features, 5),
    "compass": (compass_features, 2),
    "pointgoal": (pointgoal_features, 5),
}
"""Observation key -> (function, number of features)."""


def vector_features(key: str, size: int) -> tuple[Features, int]:
    """Function and number of features for the vector observation ``key`` with ``size`` entries."""
    return KNOWN.get(key, (symmetric_log, size))
