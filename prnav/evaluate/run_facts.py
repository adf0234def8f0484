"""``run.json`` of a run, as evaluations and reports read it."""

from __future__ import annotations

from pathlib import Path

from prnav.contracts import Header
from prnav.errors import PrnavError
from prnav.schema import Anything, MapOf, Maybe, Table, Text, read_json

FACTS = "run.json"

KIND = Table(allowed={"data": MapOf(Anything()), "benchmark": Maybe(Text()), "prnav": Text(), "warm_start": Text()})
"""What is held to a type; the rest is shown as it is."""


def read_facts(run: Path, error: type[PrnavError]) -> Header:
    """What a run was made from; empty where its folder does not say.

    Args:
        run: the run's folder.
        error: what is raised where the file is broken.

    Raises:
        error: the file cannot be read.
    """
    path = run / FACTS
    if not path.exists():
        return {}
    facts: Header = read_json(path, KIND, error, "restore it or delete it")
    return facts
