"""Photoreceptor readings per second: two sensors of 4 x 4 receptors for 64 agents, by engine and rays."""

from __future__ import annotations

import importlib.util
import time

import numpy as np

from prnav.aliases import Untyped
from prnav.bench.table import Row, rate, row
from prnav.bench.views import Poses, real_scene, two_sensors, walking_poses
from prnav.errors import RenderError
from prnav.render import Renderer
from prnav.scene import SceneMesh, load_scene, scene_ids

AGENTS = 64
MANY_SCENES = 16
RASTERISED_AGENTS = 4

CUDA_AGENTS = 1024
CUDA_SCENES = 61


def measure_render(seconds: float = 2.0, scene: SceneMesh | None = None, device: str = "cpu") -> list[Row]:
    """Rows for a built-in home, the real house where ``PRNAV_REAL_DATA`` is set, and a mix of homes.

    On the CPU all engines that run here are measured, per second of CPU time; of the rasterisers one process can only
    have one, EGL if it is there. On CUDA it is engine "warp", per second of the clock.

    Raises:
        RenderError: there is no such device.
    """
    if device != "cpu":
        return _measure_cuda(device, seconds, scene)
    scenes = [scene] if scene else [load_scene("prhouses/test/00"), real_scene("small_house")]
    rows: list[Row] = []
    for mesh in scenes:
        if mesh is not None:
            rows += _measure_cpu(mesh, seconds)
    if scene is None:
        rows.append(row("render", f"mix_of_{MANY_SCENES}_homes_4_rays", _mixed(seconds), "agent readings/s"))
    return rows


def _measure_cpu(mesh: SceneMesh, seconds: float) -> list[Row]:
    label = _label(mesh)
    poses = walking_poses(mesh, AGENTS, two_sensors())
    rows = [row("render", f"{label}_triangles", len(mesh.faces), "triangles")]
    start = time.perf_counter()
    renderer = Renderer([mesh])
    _read(renderer, poses)
    rows.append(row("render", f"{label}_first_reading", time.perf_counter() - start, "s (wall clock)"))
    speeds = {}
    for rays in (1, 4, 16, 64):
        renderer = Renderer([mesh], rays_per_receptor=rays)
        speeds[rays] = rate(lambda r=renderer, p=poses: _read(r, p), seconds)  # type: ignore[misc]
        rows.append(row("render", f"{label}_{renderer.engine}_{rays}_rays", speeds[rays], "agent readings/s"))
    camera = Renderer([mesh])
    one = tuple(a[:8] for a in poses)
    pictures = rate(lambda r=camera, p=one: 2 * len(r.image(*p, size=128)), seconds)  # type: ignore[misc]
    rows.append(row("render", f"{label}_{camera.engine}_picture_128", pictures, "pictures/s"))
    if importlib.util.find_spec("warp"):
        caster = Renderer([mesh], engine="warp")
        speed = rate(lambda r=caster, p=poses: _read(r, p), seconds)  # type: ignore[misc]
        rows.append(row("render", f"{label}_warp_16_rays", speed, "agent readings/s"))
    for engine in ("egl", "osmesa"):
        try:
            drawn = Renderer([mesh], engine=engine)
        except RenderError:
            continue  # not on this machine, or the other one has the process
        few: Poses = tuple(a[:RASTERISED_AGENTS] for a in poses)  # type: ignore[assignment]
        speed = rate(lambda r=drawn, p=few: _read(r, p), seconds)  # type: ignore[misc]
        rows.append(row("render", f"{label}_{engine}", speed, "agent readings/s"))
        rows.append(row("render", f"{label}_times_faster_than_{engine}", speeds[16] / speed, "times"))
    return rows


def _measure_cuda(device: str, seconds: float, scene: SceneMesh | None) -> list[Row]:
    """1,024 agents with two sensors of 8 x 8 receptors, 4 rays each, in as many homes as there are for training."""
    scenes = [scene] if scene else [load_scene(name) for name in scene_ids("train")[:CUDA_SCENES]]
    renderer = Renderer(scenes, device=device, rays_per_receptor=4)
    where = _device_label(renderer)
    poses = _spread(scenes, CUDA_AGENTS)
    start = time.perf_counter()
    renderer.read_on_device(*poses, grid=8).numpy()
    rows = [
        row("render", "scenes", len(scenes), "scenes", where),
        row("render", "first_reading", time.perf_counter() - start, "s (wall clock)", where),
        row("render", "scenes_memory", renderer.resident_bytes / 1e9, "GB", where),
    ]
    for grid, rays, agents in ((8, 4, 64), (8, 4, 256), (8, 4, CUDA_AGENTS), (4, 16, CUDA_AGENTS), (8, 4, 4096)):
        caster = renderer if rays == 4 else Renderer(scenes, device=device, rays_per_receptor=rays)
        some = _spread(scenes, agents)
        speed = _device_rate(caster, some, grid, seconds)
        label = f"{agents}_agents_{grid}x{grid}_{rays}_rays"
        rows.append(row("render", label, speed, "agent readings/s (wall clock)", where))
        rows.append(row("render", f"{label}_traced", speed * 2 * grid * grid * rays / 1e6, "Mray/s", where))
    return rows


def _device_rate(renderer: Renderer, poses: Poses, grid: int, seconds: float) -> float:
    """Agents read per second of the clock; the device is waited for at the end of each run of 20, as a policy would."""
    renderer.read_on_device(*poses, grid=grid).numpy()
    done, start = 0, time.perf_counter()
    while True:
        for _ in range(20):
            last = renderer.read_on_device(*poses, grid=grid)
            done += len(last)
        last.numpy()
        spent = time.perf_counter() - start
        if spent >= seconds:
            return done / spent


def _device_label(renderer: Renderer) -> str:
    device: Untyped = renderer._engine.device  # type: ignore[attr-defined]
    return str(device.name)


def _label(mesh: SceneMesh) -> str:
    return mesh.name.split(".")[0].replace("/", "-")


def _read(renderer: Renderer, poses: Poses) -> int:
    return len(renderer.read(*poses, grid=4))


def _spread(scenes: list[SceneMesh], agents: int) -> Poses:
    """Agents in all scenes, neighbours in the batch in different ones."""
    each = -(-agents // len(scenes))
    parts = [walking_poses(mesh, each, two_sensors()) for mesh in scenes]
    _, feet, yaws, designs = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    order = np.arange(each * len(scenes)).reshape(len(scenes), each).T.ravel()[:agents]
    return order // each, feet[order], yaws[order], designs[order]


def _mixed(seconds: float) -> float:
    scenes = [load_scene(name) for name in scene_ids("train")[:MANY_SCENES]]
    renderer, poses = Renderer(scenes, rays_per_receptor=4), _spread(scenes, AGENTS)
    return rate(lambda: _read(renderer, poses), seconds)
