"""Photoreceptor readings per second: two sensors of 4 x 4 receptors for 64 agents, by engine and rays."""

from __future__ import annotations

import numpy as np

from prnav.bench.table import Row, rate, row
from prnav.bench.views import Poses, real_scene, two_sensors, walking_poses
from prnav.errors import RenderError
from prnav.render import Renderer
from prnav.scene import SceneMesh, load_scene, scene_ids

AGENTS = 64
MANY_SCENES = 16
RASTERISED_AGENTS = 4


def measure_render(seconds: float = 2.0, scene: SceneMesh | None = None) -> list[Row]:
    """Rows for a built-in home, the real house where ``PRNAV_REAL_DATA`` is set, and a mix of homes.

    The rasterisers are measured too where they run; one process can only have one, EGL if it is there.
    """
    scenes = [scene] if scene else [load_scene("prhouses/test/00"), real_scene("small_house")]
    rows: list[Row] = []
    for mesh in scenes:
        if mesh is None:
            continue
        label = mesh.name.split(".")[0].replace("/", "-")
        poses = walking_poses(mesh, AGENTS, two_sensors())
        rows.append(row("render", f"{label}_triangles", len(mesh.faces), "triangles"))
        speeds = {}
        for rays in (1, 4, 16, 64):
            renderer = Renderer([mesh], rays_per_receptor=rays)
            speeds[rays] = rate(lambda r=renderer, p=poses: _read(r, p), seconds)  # type: ignore[misc]
            rows.append(row("render", f"{label}_{renderer.engine}_{rays}_rays", speeds[rays], "agent readings/s"))
        camera = Renderer([mesh])
        one = tuple(a[:8] for a in poses)
        pictures = rate(lambda r=camera, p=one: 2 * len(r.image(*p, size=128)), seconds)  # type: ignore[misc]
        rows.append(row("render", f"{label}_{camera.engine}_picture_128", pictures, "pictures/s"))
        for engine in ("egl", "osmesa"):
            try:
                drawn = Renderer([mesh], engine=engine)
            except RenderError:
                continue  # not on this machine, or the other one has the process
            few: Poses = tuple(a[:RASTERISED_AGENTS] for a in poses)  # type: ignore[assignment]
            speed = rate(lambda r=drawn, p=few: _read(r, p), seconds)  # type: ignore[misc]
            rows.append(row("render", f"{label}_{engine}", speed, "agent readings/s"))
            rows.append(row("render", f"{label}_times_faster_than_{engine}", speeds[16] / speed, "times"))
    if scene is None:
        rows.append(row("render", f"mix_of_{MANY_SCENES}_homes_4_rays", _mixed(seconds), "agent readings/s"))
    return rows


def _read(renderer: Renderer, poses: Poses) -> int:
    return len(renderer.read(*poses, grid=4))


def _mixed(seconds: float) -> float:
    scenes = [load_scene(name) for name in scene_ids("train")[:MANY_SCENES]]
    each = AGENTS // MANY_SCENES
    parts = [walking_poses(mesh, each, two_sensors()) for mesh in scenes]
    _, feet, yaws, designs = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    # neighbours in the batch are in different scenes
    order = np.arange(AGENTS).reshape(MANY_SCENES, each).T.ravel()
    poses = (order // each, feet[order], yaws[order], designs[order])
    renderer = Renderer(scenes, rays_per_receptor=4)
    return rate(lambda: _read(renderer, poses), seconds)
