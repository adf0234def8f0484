"""Engines "egl" and "osmesa": pyrender draws the pictures, readings are their patches' means.

For comparison with rasterisers; ray casting is far faster here. Drawn flat (no lights), from both sides, with the
driver's own texture filtering and four samples per pixel. A sensor's picture has at least ``MIN_SIZE`` pixels per
side, as a rasteriser takes the same time for small ones.

OpenGL binds to one platform per process, when it is first imported: a process can use EGL or OSMesa, not both. Its
contexts belong to threads, so that all drawing is done in one thread, whichever thread asks.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.metadata
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Untyped
from prnav.errors import RenderError
from prnav.render.engine import EngineOptions, Float32
from prnav.render.rays import Float64, Views
from prnav.render.sampling import Sampling

if TYPE_CHECKING:
    from prnav.scene.mesh import SceneMesh

MIN_SIZE = 128
"""Fewest pixels per side of a drawn picture."""

NEAR = 0.005
"""Distance of the near plane [m]; what is closer is not drawn."""

MIN_PYOPENGL = (3, 1, 10)
"""First PyOpenGL that works with NumPy 2 and has OSMesa's core profile."""

_LIBRARIES = {"egl": ("libEGL.so.1", "libegl1 libgl1-mesa-dri"), "osmesa": ("libOSMesa.so.8", "libosmesa6")}


class GlEngine:
    """Rasteriser behind :class:`prnav.render.engine.Engine`; ``name`` is also PyOpenGL's platform."""

    name = ""

    def __init__(self, scenes: Sequence[SceneMesh], options: EngineOptions) -> None:
        self._pyrender = load_pyrender(self.name)
        self._meshes = scenes
        self._background = options.background
        self._sphere_color = options.sphere_color
        self._drawable: dict[int, Untyped] = {}
        self._ball: Untyped = None
        self._canvas: Untyped = None

    def radiance(
        self,
        scene_of_view: NDArray[np.int64],
        views: Views,
        grid: int,
        sampling: Sampling,
        spheres: Float64 | None = None,
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.radiance`; the number of rays is a lower bound.

        Raises:
            RenderError: a pattern other than "grid", or an acceptance other than "uniform".
        """
        for name, value, only in (
            ("pattern", sampling.pattern, "grid"),
            ("acceptance", sampling.acceptance, "uniform"),
        ):
            if value != only:
                raise RenderError(
                    f'engine {self.name!r} draws whole pictures; it has no {name} {value!r}, only "{only}"'
                )
        return _gl_thread().submit(self._radiance, scene_of_view, views, grid, sampling.side, spheres).result()

    def depth(
        self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: Float64 | None = None
    ) -> Float32:
        """See :meth:`prnav.render.engine.Engine.depth`; that of one of a pixel's four samples, not of its centre."""
        return _gl_thread().submit(self._depth, scene_of_view, views, size, spheres).result()

    def _radiance(
        self, scene_of_view: NDArray[np.int64], views: Views, grid: int, side: int, spheres: Float64 | None
    ) -> Float32:
        side = max(side, -(-MIN_SIZE // grid))
        readings = np.empty((len(views), grid, grid, 3), dtype=np.float32)
        for row, colour, _ in self._draw(scene_of_view, views, grid * side, spheres):
            patches = colour.reshape(grid, side, grid, side, 3).mean(axis=(1, 3), dtype=np.float64)
            readings[row] = patches / 255.0
        return readings

    def _depth(self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: Float64 | None) -> Float32:
        depths = np.empty((len(views), size, size), dtype=np.float32)
        for row, _, depth in self._draw(scene_of_view, views, size, spheres):
            depths[row] = np.where(depth == 0.0, np.inf, depth)
        return depths

    def _draw(self, scene_of_view: NDArray[np.int64], views: Views, size: int, spheres: Float64 | None) -> Untyped:
        """Per view, scene by scene: its row, colours (size, size, 3) uint8, depths (size, size), 0 on a miss."""
        flags = self._pyrender.RenderFlags.FLAT | self._pyrender.RenderFlags.SKIP_CULL_FACES
        canvas = self._canvas_of(size)
        for row in np.argsort(scene_of_view, kind="stable"):
            scene, far = self._drawable_of(int(scene_of_view[row]))
            tangent = float(np.linalg.norm(views.right[row]))
            camera = self._pyrender.PerspectiveCamera(
                yfov=2.0 * np.arctan(tangent), aspectRatio=1.0, znear=NEAR, zfar=far
            )
            node = scene.add(camera, pose=_pose(views, int(row), tangent))
            scene.main_camera_node = node
            ball = None
            if spheres is not None and spheres[row, 3] > 0.0:
                place = np.diag([*np.full(3, spheres[row, 3]), 1.0])
                place[:3, 3] = spheres[row, :3]
                ball = scene.add(self._ball_of(), pose=place)
            colour, depth = canvas.render(scene, flags=flags)
            scene.remove_node(node)
            if ball is not None:
                scene.remove_node(ball)
            yield row, colour, depth

    def _canvas_of(self, size: int) -> Untyped:
        if self._canvas is None or self._canvas.viewport_width != size:
            if self._canvas is not None:
                self._canvas.delete()
                self._drawable.clear()  # their buffers went with the context
                self._ball = None
            self._canvas = self._pyrender.OffscreenRenderer(size, size)
        return self._canvas

    def _drawable_of(self, index: int) -> tuple[Untyped, float]:
        if index not in self._drawable:
            mesh = self._meshes[index]
            scene = self._pyrender.Scene(bg_color=[*self._background, 1.0])
            scene.add(self._pyrender.Mesh(_primitives(self._pyrender, mesh)))
            far = 2.0 * float(np.linalg.norm(mesh.bounds[1] - mesh.bounds[0])) + 10.0
            self._drawable[index] = scene, far
        return self._drawable[index]

    def _ball_of(self) -> Untyped:
        """A sphere of radius 1 in the spheres' colour, of triangles."""
        if self._ball is None:
            import trimesh

            shape = trimesh.creation.icosphere(subdivisions=4)
            material = self._pyrender.MetallicRoughnessMaterial(
                baseColorFactor=[*self._sphere_color, 1.0], doubleSided=True
            )
            part = self._pyrender.Primitive(
                positions=shape.vertices.astype(np.float32), indices=shape.faces, material=material
            )
            self._ball = self._pyrender.Mesh([part])
        return self._ball


class EglEngine(GlEngine):
    """pyrender through EGL, on a GPU or on Mesa's software driver."""

    name = "egl"


class OsmesaEngine(GlEngine):
    """pyrender through OSMesa, in software."""

    name = "osmesa"


@functools.cache
def _gl_thread() -> ThreadPoolExecutor:
    """The thread that all drawing is done in."""
    return ThreadPoolExecutor(1, thread_name_prefix="prnav-gl")


def load_pyrender(platform: str) -> Untyped:
    """The pyrender module, bound to a platform.

    Raises:
        RenderError: a package or library is missing or too old, or OpenGL is bound to another platform already.
    """
    library, package = _LIBRARIES[platform]
    try:
        ctypes.CDLL(library)
    except OSError as error:
        raise RenderError(
            f"engine {platform!r} needs the library {library}; on Debian and Ubuntu: apt-get install {package}"
        ) from error
    remedy = 'pip install "prnav[gl]", then pip install "PyOpenGL>=3.1.10" (over pyrender\'s pin)'
    versions = {}
    for name in ("pyrender", "PyOpenGL"):
        try:
            versions[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError as error:
            raise RenderError(f"engine {platform!r} needs the package {name}; {remedy}") from error
    found = tuple(int(part) for part in versions["PyOpenGL"].split(".")[:3] if part.isdigit())
    if found < MIN_PYOPENGL:
        raise RenderError(f"engine {platform!r} needs PyOpenGL 3.1.10 or newer, found {versions['PyOpenGL']}; {remedy}")
    bound = os.environ.get("PYOPENGL_PLATFORM")
    if "OpenGL" in sys.modules and bound != platform:
        raise RenderError(
            f"engine {platform!r} cannot start: OpenGL runs on platform {bound or 'default'!r} in this process "
            f"already; use one rasteriser per process"
        )
    os.environ["PYOPENGL_PLATFORM"] = platform
    import pyrender

    return pyrender


def _pose(views: Views, row: int, tangent: float) -> Float64:
    """Camera to world, 4 x 4: x right, y up, looking along -z."""
    pose = np.eye(4)
    pose[:3, 0] = views.right[row] / tangent
    pose[:3, 1] = views.up[row] / tangent
    pose[:3, 2] = -views.forward[row]
    pose[:3, 3] = views.origin[row]
    return pose


def _primitives(pyrender: Untyped, mesh: SceneMesh) -> list[Untyped]:
    """One drawable part per texture."""
    parts = []
    for texture in np.unique(mesh.face_texture):
        used, faces = np.unique(mesh.faces[mesh.face_texture == texture], return_inverse=True)
        image = np.ascontiguousarray(mesh.atlas.image(int(texture))[..., :3])
        uvs = mesh.uvs[used] * np.array([1, -1], np.float32) + np.array([0, 1], np.float32)  # pyrender's v runs up
        colors = np.concatenate([mesh.colors[used] / 255.0, np.ones((len(used), 1))], axis=1)
        material = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=[1.0, 1.0, 1.0, 1.0],
            baseColorTexture=pyrender.Texture(source=image, source_channels="RGB"),
            doubleSided=True,
        )
        parts.append(
            pyrender.Primitive(
                positions=mesh.vertices[used],
                texcoord_0=uvs,
                color_0=colors.astype(np.float32),
                indices=faces.reshape(-1, 3),
                material=material,
            )
        )
    return parts
