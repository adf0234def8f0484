"""A search over two small homes with a tiny policy."""

import sys
from pathlib import Path

import pytest

from prnav.design.config import load_optimize_config

sys.path.insert(0, str(Path(__file__).parent))

from tiny_search import TINY  # noqa: E402


@pytest.fixture
def tiny():
    return lambda *more: load_optimize_config("design-quick", (*TINY, *more))
