"""Some rounds of ``tools/fuzz.py``; ten minutes of each are marked slow."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "fuzz.py"


@pytest.mark.parametrize("reader", ["navmesh", "episodes", "obj", "mtl", "ply", "gltf"])
@pytest.mark.parametrize("length", [("--rounds", "200"), pytest.param(("--minutes", "10"), marks=pytest.mark.slow)])
def test_broken_files_give_our_own_errors_and_nothing_else(reader, length, tmp_path):
    command = [sys.executable, str(TOOL), reader, *length, "--limit", "60", "--keep", str(tmp_path / "finding")]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    found = re.search(r"([\d,]+) files \(([\d,]+) (NavMesh|Episode|Scene)Error, ([\d,]+) accepted\)", run.stdout)
    least = 1 if reader == "mtl" else 15  # materials refuse few meshes
    assert found and all(int(number.replace(",", "")) > least for number in found.group(1, 2, 4)), run.stdout
