"""Designs made from designs, for the paper's analyses (appendix, "Analysis Experiments and Ablations")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prnav.errors import DesignError
from prnav.sensors import AXES, Design, library_designs, load_design, moved_design, pose_to_theta, random_design

ALPHAS = (0.05, 0.1, 0.2, 0.4, 0.8)
"""The paper's steps from the found design towards the initial one."""

Named = list[tuple[str, Design]]
"""(group, design): the group says what a design stands for in a figure."""


def interpolated(initial: Design, found: Design, alphas: Sequence[float] = ALPHAS) -> Named:
    """``(1 - alpha) found + alpha initial`` in normalised coordinates, with both ends (the paper's equation)."""
    theta = _difference(initial, found)
    steps = [0.0, *alphas, 1.0]
    return [(f"{alpha:g}", moved_design(initial, (1.0 - alpha) * theta, f"alpha-{alpha:g}")) for alpha in steps]


def single_axes(initial: Design, found: Design) -> Named:
    """The found design with all axes but one set back to the initial design, one for each axis; and both designs."""
    theta = _difference(initial, found)
    result = [("initial", replace(initial, name="initial")), ("found", moved_design(initial, theta, "found"))]
    for column, axis in enumerate(AXES):
        only = np.zeros_like(theta)
        only[:, column] = theta[:, column]
        if np.abs(only).max() > 1e-6:
            result.append((axis, moved_design(initial, only, f"only-{axis}")))
    return result


def without_each(found: Design) -> Named:
    """The design, and what is left of it without each of its sensors.

    Raises:
        DesignError: it has a single sensor.
    """
    if found.num_sensors < 2:
        raise DesignError(f"design {found.name} has one sensor; leaving it out leaves nothing to compare")
    result = [("all", found)]
    for sensor in range(found.num_sensors):
        rows = np.delete(found.sensors, sensor, axis=0)
        left = Design(f"without-{sensor}", rows, found.grid, found.body, found.space)
        result.append((f"without {sensor}", left))
    return result


def spread(found: Sequence[Design], count: int, sensors: int, grid: int, seed: int = 0) -> Named:
    """Random designs of a seed, the library's of as many receptors, and designs that were found."""
    result: Named = [("random", random_design(seed + index, sensors, grid)) for index in range(count)]
    for name in library_designs():
        design = load_design(name)
        if design.num_sensors == sensors:
            result.append(("intuitive", replace(design, grid=grid)))
    return result + [("optimised", design) for design in found]


def pairs(initial: Sequence[Design], found: Sequence[Design]) -> Named:
    """Initial and found designs of several starts, pair by pair.

    Raises:
        DesignError: their numbers differ.
    """
    if len(initial) != len(found):
        raise DesignError(f"{len(initial)} initial and {len(found)} found designs are no pairs; give as many of each")
    result: Named = []
    for start, (before, after) in enumerate(zip(initial, found, strict=True)):
        result += [(f"initial {start}", replace(before, name=f"initial-{start}"))]
        result += [(f"optimised {start}", replace(after, name=f"optimised-{start}"))]
    return result


def _difference(initial: Design, found: Design) -> np.ndarray:
    """Theta of ``found`` around ``initial``."""
    found.require_sensors(initial.num_sensors)
    if found.body.shape != initial.body.shape:
        raise DesignError(f"designs {initial.name} and {found.name} sit on different bodies; give two of one body")
    return pose_to_theta(found.sensors, initial)
