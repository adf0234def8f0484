"""Where the files that travel with the package are: ``configs/``, ``scenes/`` and ``episodes/``.

In a checkout they stand at the top level; in an installed wheel they lie in ``prnav/data``.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def resource(*parts: str) -> Path:
    """Path of a shipped file or folder, for example ``resource("configs", "quickstart.toml")``."""
    installed = _PACKAGE / "data"
    return (installed if installed.is_dir() else _PACKAGE.parent).joinpath(*parts)
