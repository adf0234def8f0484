"""MuJoCo's own rasteriser behind the caster's interface: slow, exact, and only where OpenGL is.

``mujoco.Renderer`` needs a display or a headless OpenGL (EGL or OSMesa, named by MUJOCO_GL) and PyOpenGL; both are
looked for when a :class:`Rasteriser` is made. One picture is drawn for each sensor of each state.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from prnav.domains.control.caster import WorldPoses
from prnav.domains.control.engine import mujoco
from prnav.errors import RenderError

Float32 = NDArray[np.float32]


class Rasteriser:
    """Readings and pictures of sensors by ``mujoco.Renderer``; the methods are those of the caster."""

    def __init__(self, model: mujoco.MjModel, pixels: int = 256) -> None:
        """Rasteriser of a compiled model.

        Args:
            model: what is drawn.
            pixels: side of the picture whose pixels a sensor's receptors average.

        Raises:
            RenderError: there is no OpenGL, or no PyOpenGL.
        """
        self.model, self.pixels = model, pixels
        self._data = mujoco.MjData(model)
        mujoco.mj_forward(model, self._data)
        self._renderers: dict[int, mujoco.Renderer] = {}
        self._renderer(pixels)

    def close(self) -> None:
        """Give back what OpenGL holds."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers = {}

    def read(
        self, poses: WorldPoses, places: ArrayLike, axes: ArrayLike, fovs: ArrayLike, grid: int = 4, threads: int = 1
    ) -> Float32:
        """Readings, 0 to 1, (N, K, grid, grid, 3): means of a picture's pixels; see the caster's :meth:`read`.

        ``threads`` is ignored: OpenGL draws one picture after another.

        Raises:
            RenderError: the picture's side is no multiple of ``grid``.
        """
        if self.pixels % grid:
            raise RenderError(f"a picture of {self.pixels} pixels a side cannot be cut into {grid} x {grid} receptors")
        pictures = self.image(poses, places, axes, fovs, self.pixels)
        patch = self.pixels // grid
        cut = pictures.reshape(*pictures.shape[:2], grid, patch, grid, patch, 3)
        return np.asarray(cut.mean(axis=(3, 5), dtype=np.float64), np.float32)

    def image(self, poses: WorldPoses, places: ArrayLike, axes: ArrayLike, fovs: ArrayLike, size: int = 84) -> Float32:
        """Square pictures, 0 to 1, (N, K, size, size, 3); see the caster's :meth:`image`."""
        places_NK3, axes_NK33 = np.asarray(places, np.float64), np.asarray(axes, np.float64)
        fovs_NK = np.broadcast_to(np.asarray(fovs, np.float64), places_NK3.shape[:2])
        renderer = self._renderer(size)
        pictures = np.empty((*places_NK3.shape[:2], size, size, 3), np.float32)
        for n in range(len(places_NK3)):
            self._place(poses, n)
            for k in range(places_NK3.shape[1]):
                renderer.update_scene(self._data)
                self._aim(renderer.scene, places_NK3[n, k], axes_NK33[n, k], float(fovs_NK[n, k]))
                pictures[n, k] = renderer.render() / np.float32(255.0)
        return pictures

    def _renderer(self, size: int) -> mujoco.Renderer:
        if size not in self._renderers:
            try:
                self._renderers[size] = mujoco.Renderer(self.model, size, size)
            except Exception as error:  # what is raised depends on the OpenGL that is missing
                raise RenderError(
                    f"mujoco.Renderer cannot draw here ({error}); it needs OpenGL and PyOpenGL, for example "
                    f"MUJOCO_GL=egl and pip install pyopengl"
                ) from error
        return self._renderers[size]

    def _place(self, poses: WorldPoses, n: int) -> None:
        data = self._data
        data.geom_xpos[:], data.geom_xmat[:] = poses.geom_xpos[n], poses.geom_xmat[n].reshape(-1, 9)
        data.site_xpos[:], data.site_xmat[:] = poses.site_xpos[n], poses.site_xmat[n].reshape(-1, 9)
        data.light_xpos[:], data.light_xdir[:] = poses.light_xpos[n], poses.light_xdir[n]

    def _aim(self, scene: mujoco.MjvScene, place: NDArray[np.float64], axes: NDArray[np.float64], fov: float) -> None:
        near = float(self.model.vis.map.znear) * float(self.model.stat.extent)
        far = float(self.model.vis.map.zfar) * float(self.model.stat.extent)
        half = near * math.tan(0.5 * fov)
        for camera in scene.camera:
            camera.pos[:], camera.forward[:], camera.up[:] = place, -axes[:, 2], axes[:, 1]
            camera.frustum_center, camera.frustum_width = 0.0, 0.0
            camera.frustum_bottom, camera.frustum_top = -half, half
            camera.frustum_near, camera.frustum_far = near, far
        for light in scene.lights[: scene.nlight]:
            if light.headlight:
                light.pos[:], light.dir[:] = place, -axes[:, 2]
