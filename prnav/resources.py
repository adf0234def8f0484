"""What there is to work with: the files that travel with the package (``configs/``, ``scenes/``, ``episodes/``), cores.

In a checkout they stand at the top level; in an installed wheel they lie in ``prnav/data``.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def resource(*parts: str) -> Path:
    """Path of a shipped file or folder, for example ``resource("configs", "quickstart.toml")``."""
    installed = _PACKAGE / "data"
    return (installed if installed.is_dir() else _PACKAGE.parent).joinpath(*parts)


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
