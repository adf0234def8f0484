"""Small meshes, and small data sets on disk, laid out as Habitat lays them out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from prnav.scene import SceneMesh, TextureAtlas
from prnav.scene.export import save_glb

QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
QUAD_UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
QUAD_FACES = np.array([0, 1, 2, 0, 2, 3], np.uint16)


def room(width=6.0, depth=4.0, up="y", color=(200, 100, 50)) -> SceneMesh:
    """A floor from (0, 0, 0) to (width, 0, depth), in a file's frame of the given up axis."""
    corners = np.array([[0, 0, 0], [0, 0, depth], [width, 0, depth], [width, 0, 0]], np.float32)
    if up == "z":
        corners = np.stack([corners[:, 0], -corners[:, 2], corners[:, 1]], axis=1)
    return SceneMesh(
        name="room",
        vertices=corners,
        uvs=np.zeros((4, 2), np.float32),
        colors=np.full((4, 3), color, np.uint8),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        face_texture=np.zeros(2, np.int32),
        atlas=TextureAtlas.from_images([]),
    )


def write_room(path: Path, **options) -> Path:
    """A room as a GLB."""
    path.parent.mkdir(parents=True, exist_ok=True)
    save_glb(room(**options), path)
    return path


def write_ply(path: Path, up="y") -> Path:
    """A room as an ASCII PLY of one quad with vertex colours, as Replica's are quads."""
    scene = room(up=up)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [
        " ".join(f"{x:g}" for x in p) + " " + " ".join(map(str, c))
        for p, c in zip(scene.vertices, scene.colors, strict=True)
    ]
    properties = [f"property float {axis}" for axis in "xyz"]
    properties += [f"property uchar {color}" for color in ("red", "green", "blue")]
    head = ["ply", "format ascii 1.0", "element vertex 4", *properties, "element face 1"]
    head += ["property list uchar int vertex_indices", "end_header"]
    path.write_text("\n".join([*head, *rows, "4 0 1 2 3", ""]))
    return path


def write_json(path: Path, value) -> Path:
    """A JSON file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(value))
    return path


def hssd(root: Path) -> Path:
    """A data set like HSSD: a stage, two objects of which one stands twice, and one scene instance."""
    folder = root / "scene_datasets" / "hssd-hab"
    write_room(folder / "stages" / "102.glb")
    write_json(folder / "stages" / "102.stage_config.json", {"render_asset": "102.glb"})
    write_room(folder / "objects" / "a" / "a1.glb", width=1.0, depth=2.0, color=(10, 20, 30))
    write_json(
        folder / "objects" / "a" / "a1.object_config.json",
        {"render_asset": "a1.glb", "up": [0, 1, 0], "front": [0, 0, -1]},
    )
    write_room(folder / "objects" / "openings" / "door.glb", width=1.0, depth=1.0, color=(1, 2, 3))
    write_json(
        folder / "hssd-hab.scene_dataset_config.json",
        {
            "stages": {
                "default_attributes": {"up": [0, 1, 0], "front": [0, 0, -1]},
                "paths": {".json": ["stages"]},
            },
            "objects": {"paths": {".json": ["objects/*"], ".glb": ["objects/openings/*.glb"]}},
            "scene_instances": {"paths": {".json": ["scenes"]}},
            "navmesh_instances": {},
        },
    )
    half = 2.0**-0.5
    write_json(
        folder / "scenes" / "102.scene_instance.json",
        {
            "translation_origin": "asset_local",
            "stage_instance": {"template_name": "stages/102"},
            "object_instances": [
                {"template_name": "a1", "translation": [1, 0.5, 1], "rotation": [half, 0, half, 0]},
                {"template_name": "objects/a/a1", "translation": [3, 0.5, 1], "translation_origin": "COM"},
                {"template_name": "door", "translation": [0, 1, 0], "non_uniform_scale": [2, 1, 3]},
            ],
        },
    )
    return folder
