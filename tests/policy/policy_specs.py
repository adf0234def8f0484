"""Specs of made-up observations."""

import torch

from prnav.contracts import DiscreteActions, ObservationSpec, ObservationSpecs

KINDS = {"photoreceptors": "receptors", "camera": "image", "design": "design"}
SHAPES = {"photoreceptors": (2, 16, 3), "design": (2, 7), "gps": (2,), "compass": (1,), "pointgoal": (2,)}
FOUR = DiscreteActions(4)


def specs(shapes: dict[str, tuple[int, ...]] = SHAPES) -> ObservationSpecs:
    """Specs of observations with these shapes, by their names in navigation."""
    types = {"camera": "uint8"}
    return {
        name: ObservationSpec(shape, KINDS.get(name, "vector"), types.get(name, "float32"))
        for name, shape in shapes.items()
    }


def observations(*batch: int, shapes: dict[str, tuple[int, ...]] = SHAPES) -> dict[str, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    return {key: torch.rand(*batch, *shape, generator=generator) for key, shape in shapes.items()}
