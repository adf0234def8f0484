"""What ``prnav doctor`` looks at: each check says what was found and, where something is missing, how to get it."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from prnav.cache import cache_dir
from prnav.errors import PrnavError
from prnav.resources import available_cores

Status = Literal["ok", "missing", "broken"]

GL_SECONDS = 60.0
"""How long a graphics library may take to answer."""

_GL_PROBE = """
import numpy as np
from prnav.render import Renderer
from prnav.scene import SceneMesh, TextureAtlas
scene = SceneMesh(
    name="triangle",
    vertices=np.array([[-5, -5, -1], [5, -5, -1], [0, 9, -1]], np.float32),
    uvs=np.zeros((3, 2), np.float32),
    colors=np.full((3, 3), 200, np.uint8),
    faces=np.array([[0, 1, 2]], np.int32),
    face_texture=np.zeros(1, np.int32),
    atlas=TextureAtlas.from_images([]),
)
renderer = Renderer([scene], engine="ENGINE")
sensor = np.array([[[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]])
seen = renderer.image(np.zeros(1, int), np.zeros((1, 3)), np.zeros(1), sensor, 8)
assert abs(float(seen.mean()) - 200 / 255) < 0.02, seen.mean()
"""


@dataclass(frozen=True)
class Finding:
    """Outcome of one check."""

    name: str
    status: Status
    detail: str
    remedy: str = ""
    required: bool = False


def examine() -> list[Finding]:
    """All findings, in the order they are shown."""
    findings = [_python(), _cores(), _memory(), *_packages(), _torch(), _cuda(), _ray_casting()]
    findings.append(_package("pyrender", "pyrender", 'pip install "prnav[gl]"; only engines egl and osmesa use it'))
    findings += [_rasteriser(engine, packages) for engine, packages in _RASTERISERS]
    findings += [_package(name, module, f'pip install "prnav[{extra}]"; {use}') for name, module, extra, use in _EXTRAS]
    findings += [_cache(), _shipped(), *(_folder(name, text) for name, text in _FOLDERS)]
    return findings


def healthy(findings: list[Finding]) -> bool:
    """Whether everything that is required works."""
    return all(finding.status == "ok" or not finding.required for finding in findings)


_REQUIRED = ("numpy", "scipy", "numba", "trimesh", "gymnasium", "safetensors", "matplotlib", "tensorboard")
_RASTERISERS = (("egl", "libegl1 libgl1-mesa-dri"), ("osmesa", "libosmesa6"))
_EXTRAS = (
    ("warp-lang", "warp", "gpu", "only engine warp uses it"),
    ("DracoPy", "DracoPy", "data", "only meshes compressed by Draco need it"),
    ("meshopt", "meshopt", "data", "only meshes compressed by meshopt need it"),
    ("opengl-basisu", "opengl_basisu", "data", "only KTX2 and Basis textures need it"),
    ("imageio-ffmpeg", "imageio_ffmpeg", "video", "only prnav-report --video uses it"),
    ("mujoco-core", "prnav.domains.control.engine", "control", "only continuous control uses it"),
    ("optuna", "optuna", "search", "only searches of prnav-design use it"),
)
_FOLDERS = (
    ("PRNAV_REAL_DATA", "real meshes and episodes for the tests; unset, those tests are skipped"),
    ("PRNAV_GOLDEN", "recorded answers for the tests; unset, those tests are skipped"),
)


def _python() -> Finding:
    found = f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    fits = (3, 11) <= sys.version_info[:2] <= (3, 13)
    remedy = "" if fits else "use Python 3.11, 3.12 or 3.13"
    return Finding("Python", "ok" if fits else "broken", found, remedy, True)


def _cores() -> Finding:
    cores = available_cores()
    return Finding("cores", "ok", str(cores))


def _memory() -> Finding:
    pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    amount = pages * size / 2**30
    little = amount < 3.5
    remedy = "the quick-start needs about 2 GB; take fewer environments (num_envs=8)" if little else ""
    return Finding("memory", "broken" if little else "ok", f"{amount:.1f} GB", remedy)


def _packages() -> list[Finding]:
    """One line for all packages that work, one for each that does not."""
    each = [_package(name, name, required=True) for name in _REQUIRED]
    fine = ", ".join(f"{finding.name} {finding.detail}" for finding in each if finding.status == "ok")
    return [Finding("packages", "ok", fine, "", True), *(finding for finding in each if finding.status != "ok")]


def _package(name: str, module: str, remedy: str = "pip install prnav", required: bool = False) -> Finding:
    try:
        version = importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, "missing", "not installed", remedy, required)
    failure = _fails(f"import {module}", 120.0)
    if failure:
        return Finding(name, "broken", f"{version}: {failure}", f"pip install --force-reinstall {name}", required)
    return Finding(name, "ok", version, "", required)


def _torch() -> Finding:
    return _package("torch", "torch", "pip install torch (see README for the build without CUDA)", required=True)


def _cuda() -> Finding:
    script = "import torch; print('; '.join(map(torch.cuda.get_device_name, range(torch.cuda.device_count()))))"
    answer = _run([sys.executable, "-c", script], 120.0)
    names = answer.stdout.strip() if isinstance(answer, subprocess.CompletedProcess) and not answer.returncode else ""
    if names:
        return Finding("CUDA", "ok", names)
    return Finding("CUDA", "missing", "torch sees no device", "not needed; for one, torch's CUDA build and a driver")


def _ray_casting() -> Finding:
    failure = _fails(_GL_PROBE.replace("ENGINE", "embree"), 180.0)
    if failure:
        return Finding("ray casting", "broken", failure, "pip install --force-reinstall embreex numba", True)
    return Finding("ray casting", "ok", "Embree traced a triangle", "", True)


def _rasteriser(engine: str, packages: str) -> Finding:
    failure = _fails(_GL_PROBE.replace("ENGINE", engine), GL_SECONDS)
    name = {"egl": "EGL", "osmesa": "OSMesa"}[engine]
    if not failure:
        return Finding(name, "ok", "pyrender drew a triangle")
    remedy = f'pip install "prnav[gl]", then "PyOpenGL>=3.1.10"; on Debian apt install {packages}'
    return Finding(name, "missing", failure, remedy)


def _cache() -> Finding:
    folder = cache_dir()
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    free = shutil.disk_usage(existing).free / 2**30
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        return Finding("cache", "broken", f"{folder}: {error}", "set PRNAV_CACHE to a folder that can be written")
    used = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) / 2**30
    detail = f"{folder}: {used:.2f} GB used, {free:.1f} GB free"
    if free < 1.0:
        return Finding("cache", "broken", detail, "free some space, or set PRNAV_CACHE to another disk")
    return Finding("cache", "ok", detail)


def _shipped() -> Finding:
    from prnav.episodes.builtin import SHIPPED_SPLITS, builtin_path
    from prnav.sensors import library_designs

    try:
        missing = [split for split in SHIPPED_SPLITS if not builtin_path(split).is_file()]
    except PrnavError as error:
        return Finding("shipped files", "broken", str(error), "install prnav again", True)
    if missing or not library_designs():
        what = ", ".join([*(f"episodes of {split}" for split in missing), *([] if library_designs() else ["designs"])])
        return Finding("shipped files", "broken", f"missing: {what}", "install prnav again", True)
    detail = f"episodes of {', '.join(SHIPPED_SPLITS)}; designs {', '.join(library_designs())}"
    return Finding("shipped files", "ok", detail, "", True)


def _folder(variable: str, purpose: str) -> Finding:
    value = os.environ.get(variable)
    if not value:
        return Finding(variable, "missing", "not set", purpose)
    if not Path(value).is_dir():
        return Finding(variable, "broken", f"{value}: no such folder", "set it to a folder, or unset it")
    return Finding(variable, "ok", value)


def _fails(script: str, seconds: float) -> str:
    """Why a Python script fails in a process of its own, in one line; empty where it does not."""
    answer = _run([sys.executable, "-c", script], seconds)
    if isinstance(answer, str):
        return answer
    if answer.returncode == 0:
        return ""
    lines = answer.stderr.strip().splitlines()
    return (
        lines[-1].removeprefix("prnav.errors.RenderError: ")[:200]
        if lines
        else f"ended with status {answer.returncode}"
    )


def _run(arguments: list[str], seconds: float) -> subprocess.CompletedProcess[str] | str:
    try:
        return subprocess.run(arguments, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return f"no answer within {seconds:.0f} s"
