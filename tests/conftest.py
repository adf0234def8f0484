"""Fixtures that all tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory):
    """Tests keep their derived data apart from the user's, in one folder per run that its workers share."""
    if "PRNAV_CACHE" not in os.environ:
        base = tmp_path_factory.getbasetemp()
        shared = base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base
        os.environ["PRNAV_CACHE"] = str(shared / "prnav-cache")
    yield


def _folder(variable: str) -> Path:
    value = os.environ.get(variable)
    if not value:
        pytest.skip(f"{variable} is not set; point it at the folder of recorded test data to run this test")
    return Path(value)


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real meshes, navmeshes and episodes."""
    return _folder("PRNAV_REAL_DATA")


@pytest.fixture(scope="session")
def golden() -> Path:
    """Folder of recorded Habitat answers."""
    return _folder("PRNAV_GOLDEN")
