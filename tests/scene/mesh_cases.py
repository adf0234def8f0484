"""Small meshes as text, and how a test looks at what became of them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

RED, GREEN, BLUE, YELLOW, WHITE = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0), (255, 255, 255)
QUARTERS = np.array([[RED, GREEN], [BLUE, YELLOW]], np.uint8)
"""A picture whose four texels tell which way up it is."""

CORNERS = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
UVS = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
SQUARE = CORNERS + UVS
"""The square [-1, 1]^2 at z = 0, with a picture's corners at its own."""


def load(path, root=None):
    """Scene of a file, past the cache."""
    return load_mesh(read_source(path, root))


def picture(texels=QUARTERS) -> bytes:
    """A PNG of some texels."""
    stream = io.BytesIO()
    Image.fromarray(np.asarray(texels, np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def write(folder: Path, **files) -> Path:
    """Write files of a scene; the first one's path. Underscores before the suffix stand for dots."""
    paths = []
    for name, content in files.items():
        stem, _, suffix = name.rpartition("_")
        path = folder / f"{stem}.{suffix}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        paths.append(path)
    return paths[0]


def area(scene) -> float:
    """Area of all triangles."""
    a, b, c = (scene.vertices[scene.faces[:, k]].astype(np.float64) for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def colour_at(scene, x, y):
    """Colour of the point (x, y) of a scene that lies in the plane z = 0, by the definition in SceneMesh."""
    for face, texture in zip(scene.faces, scene.face_texture, strict=True):
        p = scene.vertices[face, :2].astype(np.float64)
        system = np.array([p[1] - p[0], p[2] - p[0]]).T
        if abs(np.linalg.det(system)) < 1e-12:
            continue
        s, t = np.linalg.solve(system, np.array([x, y]) - p[0])
        if s < -1e-9 or t < -1e-9 or s + t > 1 + 1e-9:
            continue
        weights = np.array([1 - s - t, s, t])
        u, v = weights @ scene.uvs[face].astype(np.float64)
        image = scene.atlas.image(int(texture))
        texel = image[int(v % 1.0 * image.shape[0]), int(u % 1.0 * image.shape[1]), :3]
        return tuple(int(round(value)) for value in texel * (weights @ scene.colors[face]) / 255.0)
    return None


def quarters(scene) -> tuple:
    """Colours of the four quarters of the square: upper left, upper right, lower left, lower right."""
    return tuple(colour_at(scene, x, y) for x, y in ((-0.52, 0.48), (0.52, 0.48), (-0.52, -0.48), (0.52, -0.48)))


UPRIGHT = (RED, GREEN, BLUE, YELLOW)
"""What :func:`quarters` finds where the picture is right."""
