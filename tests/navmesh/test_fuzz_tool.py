"""A few seconds of ``tools/fuzz.py``; ten minutes of each are run by hand before a release."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "fuzz.py"


@pytest.mark.parametrize(
    ("reader", "minutes"),
    [("navmesh", 0.04), ("episodes", 0.04)]
    + [pytest.param(reader, 10.0, marks=pytest.mark.slow) for reader in ("navmesh", "episodes")],
)
def test_broken_files_give_our_own_errors_and_nothing_else(reader, minutes, tmp_path):
    command = [sys.executable, str(TOOL), reader, "--minutes", str(minutes), "--keep", str(tmp_path / "finding")]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    found = re.search(r"([\d,]+) files \(([\d,]+) (NavMesh|Episode)Error, ([\d,]+) accepted\)", run.stdout)
    assert found and all(int(number.replace(",", "")) > 5 for number in found.group(1, 2, 4))
