"""How a search looks for a design: the methods by name, and what each is given and gives back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypedDict

import numpy as np
from numpy.typing import NDArray

from prnav.registry import resolve

if TYPE_CHECKING:
    from prnav.design.config import OptimizeConfig
    from prnav.design.specialist import Judge, ResultRow
    from prnav.sensors import Design

METHODS: dict[str, str] = {
    "joint": "prnav.design.joint_search:JOINT",
    "random": "prnav.design.study:RANDOM",
    "cmaes": "prnav.design.study:CMAES",
    "tpe": "prnav.design.study:TPE",
    "gp": "prnav.design.study:GP",
    "halving": "prnav.design.halving:HALVING",
}
"""Name of a method in a config -> module and attribute of its :class:`SearchMethod`."""


class SearchFacts(TypedDict, total=False):
    """What a method tells of one start."""

    initial: float
    """Score of the initial design, by the search's own measure."""
    found: float
    """Score of the found one."""
    trials: int
    """Designs that were tried."""
    steps: int
    """Steps that were spent: of specialists, of readings, or of the joint training."""
    scores: list[float]
    """Of all designs in the order they were tried."""
    rows: list[ResultRow]
    """Results of generalists, where there are any."""


class Search(Protocol):
    """What a method works with: the search it is part of."""

    config: OptimizeConfig
    storage: str | None
    """Address of the database that holds studies; None where a file in the folder does."""
    say: Callable[[str, int, int, str], None]
    """Told (stage, done, of, text) as things get on."""
    warn: Callable[[str], None]
    """Told what trainings warn of."""

    @property
    def judge(self) -> Judge:
        """Homes and episodes of specialists."""
        ...

    def place(self, number: int) -> Path:
        """Folder of a start."""
        ...

    def score(self, initial: Design, theta: NDArray[np.float64], number: int) -> float:
        """Score of theta (K, 7) around the initial design of a start: the proxy's or a specialist's, less its cost."""
        ...


class SearchMethod(NamedTuple):
    """One method."""

    find: Callable[[Search, Design, int], tuple[Design, SearchFacts]]
    """Searches from an initial design, of the start with that number; resumes what an earlier call left in its folder.
    """
    scored_by: str | None = None
    """What its scores are of: "generalist" or "specialist"; None where the config's ``score`` says it."""
    shared: bool = False
    """Whether several processes can work on the same start, where designs are scored by the proxy."""


def search_method(name: str) -> SearchMethod:
    """The method of that name in :data:`METHODS`."""
    method: SearchMethod = resolve(METHODS, name)
    return method
