"""A mesh file of any kind to one :class:`SceneMesh`."""

from __future__ import annotations

from prnav.errors import SceneError
from prnav.frames import to_y_up
from prnav.scene.gltf_scene import gltf_parts
from prnav.scene.mesh import SceneMesh
from prnav.scene.parts import Textures, assemble
from prnav.scene.polygon_files import polygon_parts
from prnav.scene.source import MeshSource

MAX_TEXTURE_SIZE = 1024
"""Default of the longest side that a texture keeps [texels]; finer detail than a sensor of some hundred pixels sees."""


def load_mesh(source: MeshSource, up: str = "y", max_texture_size: int = MAX_TEXTURE_SIZE) -> SceneMesh:
    """Mesh of a file that was read with :func:`prnav.scene.source.read_source`.

    Every part of the file's scene is kept, with its transform, texture, vertex colours and material colour; points and
    lines are not. Textures shared between parts are stored once; one with a side over ``max_texture_size`` is reduced
    by a power of two.

    Args:
        source: the file's bytes.
        up: the file's up axis, "y" or "z"; z-up files are turned.
        max_texture_size: longest side of a texture [texels].

    Raises:
        SceneError: anything in the file that cannot be used.
    """
    to_y_up((0.0, 0.0, 0.0), up)  # a wrong axis is told before the work
    if max_texture_size < 1:
        raise SceneError(f"scene {source.path}: max_texture_size {max_texture_size} is not a number of texels >= 1")
    textures = Textures()
    read = polygon_parts if source.suffix in (".obj", ".ply") else gltf_parts
    return assemble(source.path, read(source, max_texture_size, textures), textures, up)
