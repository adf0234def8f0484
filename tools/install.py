"""Install prnav into the running interpreter's environment: the work behind ``make setup``.

PyTorch is taken as its CPU build unless this machine has an NVIDIA device; everything is held to the versions in
``constraints.txt``. Only the standard library is used, so that it runs on a bare Python.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ("control", "data", "gpu", "search", "video")
"""Extras of pyproject.toml that are taken where pip finds them; the tests that need a missing one skip and say so."""


def pip(*arguments: str) -> bool:
    """Run pip; whether it succeeded."""
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", *arguments]
    return subprocess.run(command, cwd=ROOT).returncode == 0


def pinned(package: str) -> str:
    """Version of a package in constraints.txt."""
    match = re.search(rf"^{package}==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    if match is None:
        sys.exit(f"tools/install.py: constraints.txt does not pin {package}")
    return match.group(1)


def has_nvidia_device() -> bool:
    """Whether an NVIDIA driver with a device answers."""
    smi = shutil.which("nvidia-smi")
    if smi is None:
        return False
    listing = subprocess.run([smi, "-L"], capture_output=True, text=True)
    return listing.returncode == 0 and "GPU" in listing.stdout


def install_torch() -> bool:
    """Install the right build of torch, unless a fitting one is there."""
    version = pinned("torch")
    try:
        if metadata.version("torch").split("+")[0] == version:
            return True
    except metadata.PackageNotFoundError:
        pass
    if has_nvidia_device() or sys.platform != "linux":
        return pip("--quiet", f"torch=={version}")
    index = os.environ.get("TORCH_INDEX")
    extra = ("--extra-index-url", index) if index else ()
    if pip("--quiet", *extra, f"torch=={version}+cpu"):
        return True
    print(
        f"tools/install.py: no CPU build of torch {version} is at hand, so the default build follows (with several GB\n"
        "  of CUDA packages). To have the small one: make setup TORCH_INDEX=<index of PyTorch's CPU wheels>; its\n"
        "  address stands on PyTorch's 'Get Started' page under 'Compute Platform: CPU'.",
        flush=True,
    )
    return pip("--quiet", f"torch=={version}")


def main() -> None:
    """Install torch, then prnav (editable) with its development tools, then the extras that are to be had."""
    if not (3, 11) <= sys.version_info[:2] <= (3, 13):
        sys.exit(f"tools/install.py: Python {sys.version.split()[0]} is not supported; use 3.11, 3.12 or 3.13")
    if not install_torch():
        sys.exit("tools/install.py: torch could not be installed; see pip's message above")
    if not pip("--quiet", "--constraint", "constraints.txt", "--editable", ".[dev]"):
        sys.exit("tools/install.py: prnav could not be installed; see pip's message above")
    for extra in EXTRAS:
        if not pip("--quiet", "--constraint", "constraints.txt", "--editable", f".[{extra}]"):
            print(f"tools/install.py: the extra {extra!r} is left out (pip's message above says why)", flush=True)


if __name__ == "__main__":
    main()
