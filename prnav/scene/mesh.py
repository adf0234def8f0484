"""One scene as arrays: what every later room works on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array
from prnav.cache import hash_arrays
from prnav.errors import SceneError
from prnav.scene.atlas import TextureAtlas

_FIELDS = {
    "vertices": (np.float32, 3),
    "uvs": (np.float32, 2),
    "colors": (np.uint8, 3),
    "faces": (np.int32, 3),
}


@dataclass(frozen=True, eq=False)
class SceneMesh:
    """Triangles with textures and colours, in the world frame (metres, y up).

    The colour of a point is its texel times its vertex colour, both as stored 8-bit values / 255, alpha ignored: no
    lighting, no gamma.

    Raises:
        SceneError: an array has the wrong shape or type, a number is not finite, or an index points nowhere.
    """

    name: str
    vertices: NDArray[np.float32]  #: (V, 3) [m]
    uvs: NDArray[np.float32]  #: (V, 2): u to the right, v down from the texture's top row; repeats outside 0..1
    colors: NDArray[np.uint8]  #: vertex colour times material colour, (V, 3); 255 where there is none
    faces: NDArray[np.int32]  #: vertex indices, (F, 3); counter-clockwise seen from the front
    face_texture: NDArray[np.int32]  #: row of the atlas's table, (F,); 0 is plain white
    atlas: TextureAtlas
    notes: tuple[str, ...] = ()  #: what of its files was not found or left out, a sentence each; not in the hash

    def __post_init__(self) -> None:
        for field, (dtype, columns) in _FIELDS.items():
            array = getattr(self, field)
            if array.dtype != dtype or array.ndim != 2 or array.shape[1] != columns:
                want = f"(n, {columns}) {np.dtype(dtype).name}"
                raise SceneError(f"scene {self.name}: {field} is {array.shape} {array.dtype}; it must be {want}")
        count = len(self.vertices)
        if len(self.uvs) != count or len(self.colors) != count:
            raise SceneError(f"scene {self.name}: {count} vertices, {len(self.uvs)} uvs, {len(self.colors)} colours")
        if self.face_texture.dtype != np.int32 or self.face_texture.shape != (len(self.faces),):
            found = f"{self.face_texture.shape} {self.face_texture.dtype}"
            raise SceneError(f"scene {self.name}: face_texture is {found}; it must be ({len(self.faces)},) int32")
        if len(self.faces) == 0:
            raise SceneError(f"scene {self.name}: it has no triangles; give a mesh with faces")
        for field in ("vertices", "uvs"):
            bad = np.flatnonzero(~np.isfinite(getattr(self, field)).all(axis=1))
            if len(bad):
                value = getattr(self, field)[bad[0]].tolist()
                raise SceneError(
                    f"scene {self.name}: {len(bad)} of {count} {field} are not finite, the first is number {bad[0]}: "
                    f"{value}; repair or re-export the mesh"
                )
        if self.faces.min() < 0 or self.faces.max() >= count:
            raise SceneError(f"scene {self.name}: a face refers to a vertex outside 0..{count - 1}")
        if self.face_texture.min() < 0 or self.face_texture.max() >= self.atlas.num_textures:
            raise SceneError(f"scene {self.name}: a face refers to a texture outside 0..{self.atlas.num_textures - 1}")

    @cached_property
    def hash(self) -> str:
        """SHA-256 over all arrays, in hex; the name does not count."""
        return hash_arrays(self.to_arrays())

    @cached_property
    def bounds(self) -> NDArray[np.float32]:
        """Lower and upper corner of the mesh, (2, 3) [m]."""
        used = self.vertices[self.faces.ravel()]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    def to_arrays(self) -> dict[str, Array]:
        """All arrays by name, the atlas's among them."""
        arrays = {field: getattr(self, field) for field in (*_FIELDS, "face_texture")}
        return {**arrays, **self.atlas.to_arrays()}

    @classmethod
    def from_arrays(cls, name: str, arrays: Mapping[str, Array], notes: tuple[str, ...] = ()) -> SceneMesh:
        """Inverse of :meth:`to_arrays`, which holds neither name nor notes."""
        fields = {field: arrays[field] for field in (*_FIELDS, "face_texture")}
        return cls(name=name, **fields, atlas=TextureAtlas(arrays["texels"], arrays["table"]), notes=notes)
