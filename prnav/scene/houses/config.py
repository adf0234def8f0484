"""Settings of the house generator and the benchmark's seeds."""

from __future__ import annotations

from dataclasses import dataclass

from prnav.errors import SceneError

SPLIT_SIZES = {"train": 61, "val": 8, "test": 18}
"""Number of built-in homes per split (as many as Matterport3D has)."""

_FIRST_SEED = {"train": 10_000, "val": 20_000, "test": 30_000}

VERSION = 4
"""Version of the generator: any change to the bytes of any home raises it."""


@dataclass(frozen=True)
class HouseConfig:
    """What kind of homes to generate.

    Attributes:
        min_area: smallest floor area inside the outer walls, all storeys together [m2].
        max_area: largest floor area inside the outer walls, all storeys together [m2].
        storeys: 1 or 2; 0 draws it, by the area.
        furniture: whether rooms are furnished.
    """

    min_area: int = 88
    max_area: int = 480
    storeys: int = 0
    furniture: bool = True

    def __post_init__(self) -> None:
        if not 40 <= self.min_area <= self.max_area <= 500:
            raise ValueError(
                f"min_area {self.min_area} and max_area {self.max_area} must satisfy 40 <= min_area <= max_area <= 500"
            )
        if self.storeys not in (0, 1, 2):
            raise ValueError(f"storeys {self.storeys} is not 0 (drawn by the area), 1 or 2")
        if self.storeys == 1 and self.max_area > 200:
            raise ValueError(f"storeys 1 holds at most 200 m2, max_area is {self.max_area}; lower it or take 2 storeys")
        if self.storeys == 2 and self.min_area < 100:
            raise ValueError(f"storeys 2 needs at least 100 m2, min_area is {self.min_area}; raise it or take 1 storey")


def split_seed(split: str, index: int) -> int:
    """Seed of a built-in home.

    Raises:
        SceneError: no such split or index.
    """
    if split not in SPLIT_SIZES:
        raise SceneError(f"split {split!r} is not known; valid: {', '.join(SPLIT_SIZES)}")
    if not 0 <= index < SPLIT_SIZES[split]:
        raise SceneError(f"home {index} of split {split!r} does not exist; valid: 0 to {SPLIT_SIZES[split] - 1}")
    return _FIRST_SEED[split] + index
