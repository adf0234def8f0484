"""``run.json`` of a run, as evaluations and reports read it."""

from __future__ import annotations

import json
from pathlib import Path

from prnav.contracts import Header
from prnav.errors import PrnavError

FACTS = "run.json"


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
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as cause:
        raise error(f"{path}: cannot be read ({cause}); restore it or delete it") from cause
    return facts if isinstance(facts, dict) else {}
