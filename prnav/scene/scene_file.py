"""What a scene of a data set is made of: a stage in its own frame, objects placed in it, and the navmesh beside it."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSONObject
from prnav.errors import SceneError
from prnav.frames import quaternion_to_matrix

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class AssetFrame:
    """How a mesh file stands in the world: its up and front become +y and -z.

    A point p of the file is at ``origin + R (scale * p)``, R the rotation that takes up and front there, as in
    Habitat's stage and object configs.
    """

    up: Vector = (0.0, 1.0, 0.0)  #: up direction in the file
    front: Vector = (0.0, 0.0, -1.0)  #: direction in the file that is -z in the world
    scale: Vector = (1.0, 1.0, 1.0)  #: metres per unit along the file's axes
    origin: Vector = (0.0, 0.0, 0.0)  #: where the file's origin is in the world [m]

    def __post_init__(self) -> None:
        """Refuse frames that are none.

        Raises:
            SceneError: up and front are not at right angles, or a number is zero, not finite or beyond reason.
        """
        up, front = np.array(self.up), np.array(self.front)
        lengths = np.linalg.norm(up), np.linalg.norm(front)
        if not all(1e-6 < length < 1e6 for length in lengths):
            raise SceneError(f"up {self.up} and front {self.front} must be directions, neither zero nor infinite")
        if abs(float(up @ front)) > 1e-3 * float(lengths[0] * lengths[1]):
            raise SceneError(f"up {self.up} and front {self.front} must be at right angles; correct one of them")
        if not all(1e-9 < abs(value) < 1e9 for value in self.scale):
            raise SceneError(f"scale {self.scale} must be three numbers of metres per unit, none of them 0")
        if not all(abs(value) < 1e6 for value in self.origin):
            raise SceneError(f"origin {self.origin} must be three finite numbers of metres, at most 1000 km")

    def matrix(self) -> NDArray[np.float64]:
        """From the file to the world, (4, 4)."""
        up = np.array(self.up) / np.linalg.norm(self.up)
        front = np.array(self.front) - up * (np.array(self.front) @ up)
        front /= np.linalg.norm(front)
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack([np.cross(front, up), up, -front]) * np.array(self.scale)
        matrix[:3, 3] = self.origin
        return matrix + 0.0  # no negative zeros: equal frames have equal bytes


Y_UP = AssetFrame()
"""glTF's own."""

Z_UP = AssetFrame(up=(0.0, 0.0, 1.0), front=(0.0, 1.0, 0.0))
"""Habitat's own for bare stage files."""

AXES = {"y": Y_UP, "z": Z_UP}


@dataclass(frozen=True)
class PlacedObject:
    """A mesh file that stands in a scene.

    Attributes:
        path: the mesh.
        frame: of the file.
        translation: of its own origin, or of its centre [m].
        rotation: unit quaternion x, y, z, w.
        scale: along the object's axes, on top of the frame's.
        centred: whether ``translation`` is that of the centre of mass.
        center: centre of mass in the object's frame [m]; None is the middle of its bounding box.
    """

    path: Path
    frame: AssetFrame
    translation: Vector
    rotation: tuple[float, float, float, float]
    scale: Vector = (1.0, 1.0, 1.0)
    centred: bool = True
    center: Vector | None = None

    def matrix(self, bounds: NDArray[np.float64]) -> NDArray[np.float64]:
        """From the file to the world, (4, 4).

        Args:
            bounds: lower and upper corner of the mesh in the object's frame, unscaled, (2, 3).
        """
        local = np.eye(4)
        local[:3, :3] = np.diag(self.scale)
        if self.centred:
            center = np.array(self.center) if self.center is not None else bounds.mean(axis=0)
            local[:3, 3] = -np.array(self.scale) * center
        place = np.eye(4)
        place[:3, :3] = quaternion_to_matrix(self.rotation)
        place[:3, 3] = self.translation
        return place @ local @ self.frame.matrix()


@dataclass(frozen=True)
class SceneFile:
    """A scene on disk.

    Attributes:
        scene_id: what episodes call it.
        path: mesh of the stage.
        frame: of the stage.
        navmesh: the ``.navmesh`` that belongs to it; None where there is none.
        objects: what stands in it besides.
    """

    scene_id: str
    path: Path
    frame: AssetFrame = Y_UP
    navmesh: Path | None = None
    objects: tuple[PlacedObject, ...] = ()

    def describe(self) -> JSONObject:
        """What counts for the arrays besides the files' bytes, which are numbered as they appear; JSON-able."""
        files = {path: number for number, path in enumerate(dict.fromkeys(placed.path for placed in self.objects))}
        kept = [dataclasses.asdict(placed) | {"path": files[placed.path]} for placed in self.objects]
        return {"frame": dataclasses.asdict(self.frame), "objects": kept}


def check_placement(placed: PlacedObject) -> None:
    """Refuse numbers that place nothing.

    Raises:
        SceneError: a rotation that is zero, or a number that is not finite or beyond reason.
    """
    if not abs(math.hypot(*placed.rotation) - 1.0) < 1e-2:
        raise SceneError(f"rotation {placed.rotation} of {placed.path.name} is not a unit quaternion")
    if not all(abs(value) < 1e6 for value in placed.translation):
        raise SceneError(f"translation {placed.translation} of {placed.path.name} is not finite or over 1000 km")
    if not all(1e-9 < abs(value) < 1e9 for value in placed.scale):
        raise SceneError(f"scale {placed.scale} of {placed.path.name} must be three finite numbers, none of them 0")
