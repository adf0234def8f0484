"""Build the wheel, install it into a second environment, and use it from another folder.

The second environment sees the first one's dependencies (through a ``.pth`` file), so that nothing is downloaded
twice; prnav itself comes from the wheel alone.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command; its output. Ends the program when it fails."""
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run([str(part) for part in command], cwd=cwd, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"wheel test: {' '.join(map(str, command))} failed:\n{done.stdout}\n{done.stderr}")
    return done.stdout


def main() -> None:
    """Build, install, run ``prnav-eval --help`` and a two-episode evaluation."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
        wheel = next(folder.glob("prnav-*.whl"))
        venv.create(folder / "venv", with_pip=False)
        python = folder / "venv" / "bin" / "python"
        site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder).strip())
        # the dependencies alone: a path entry in a .pth file does not run the first environment's own .pth files, so
        # its editable prnav stays out of sight
        (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
        run(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", wheel, cwd=folder)
        origin = run(python, "-c", "import prnav; print(prnav.__file__)", cwd=folder).strip()
        if not Path(origin).is_relative_to(site):
            sys.exit(f"wheel test: prnav was imported from {origin}, not from the wheel")
        command = folder / "venv" / "bin" / "prnav-eval"
        run(command, "--help", cwd=folder)
        out = folder / "result.json"
        run(command, "--agent", "shortest-path", "--split", "test", "--episodes", "2", "--json", out, cwd=folder)
        if not out.is_file():
            sys.exit("wheel test: prnav-eval wrote no result")
    sys.stdout.write("wheel test: the installed wheel evaluates two episodes\n")


if __name__ == "__main__":
    main()
