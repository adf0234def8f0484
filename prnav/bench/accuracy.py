"""Error of photoreceptor readings against rays per receptor, on each scene at hand."""

from __future__ import annotations

import numpy as np

from prnav.bench.table import Row, row
from prnav.bench.views import REAL_SCENES, real_scene, walking_poses
from prnav.render import Renderer
from prnav.scene import SceneMesh, load_scene

AGENTS = 48
RAYS = (1, 4, 16, 64, 256)
REFERENCE_RAYS = 64 * 64


def measure_accuracy(seconds: float = 0.0, scene: SceneMesh | None = None) -> list[Row]:
    """Mean and 99th percentile error on the 0 to 255 scale against 64 x 64 rays per receptor.

    One sensor 1.25 m up, 90 degrees wide, at random places of the floor; grids of 1 x 1 and 4 x 4; both patterns of
    rays. ``seconds`` changes nothing: each figure is computed once.
    """
    scenes = [scene] if scene else [load_scene("prhouses/test/00"), *(real_scene(name) for name in REAL_SCENES)]
    design = np.array([[0.0, 1.25, 0.0, 0.0, 0.0, 0.0, np.radians(90.0)]])
    rows: list[Row] = []
    for mesh in scenes:
        if mesh is None:
            continue
        label = mesh.name.split(".")[0].replace("/", "-")
        poses = walking_poses(mesh, AGENTS, design)
        for grid in (1, 4):
            truth = Renderer([mesh], rays_per_receptor=REFERENCE_RAYS).read(*poses, grid=grid)
            for pattern in ("grid", "lattice"):
                for rays in RAYS:
                    readings = Renderer([mesh], rays_per_receptor=rays, pattern=pattern).read(*poses, grid=grid)
                    error = np.abs(readings - truth) * 255.0
                    metric = f"{label}_{grid}x{grid}_{pattern}_{rays}_rays"
                    rows.append(row("accuracy", f"{metric}_mean", float(error.mean()), "of 255"))
                    rows.append(row("accuracy", f"{metric}_p99", float(np.percentile(error, 99)), "of 255"))
    return rows
