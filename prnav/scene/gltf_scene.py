"""The node tree of a glTF file as parts: instances, materials, textures, vertex colours.

Factors are taken as they stand and textures as stored, without the sRGB transfer curve: readings are means of stored
values. What is left out is listed in :data:`prnav.scene.gltf_unread.NOT_READ`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prnav.scene import decoders
from prnav.scene.gltf import GltfFile
from prnav.scene.gltf_unread import unread_notes
from prnav.scene.images import EncodedImage
from prnav.scene.parts import Part, Textures, check_triangles
from prnav.scene.source import MeshSource
from prnav.scene.texture_wrap import REPEAT, Wrap, wrap_part

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_DRACO = "KHR_draco_mesh_compression"
_WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}


@dataclass(frozen=True)
class _Material:
    color: NDArray[np.float64]
    texture: int = 0
    uv_set: int = 0
    uv_matrix: NDArray[np.float64] | None = None  # (2, 3)
    wrap: Wrap = REPEAT


_PLAIN = _Material(np.ones(3))


def gltf_parts(source: MeshSource, textures: Textures, notes: list[str]) -> list[Part]:
    """Parts of a GLB or glTF file in its own frame; images go into ``textures``, what was left out into ``notes``."""
    file = GltfFile(source)
    parts = _Reader(file, textures, notes).parts()
    notes += unread_notes(file)
    return parts


class _Reader:
    def __init__(self, file: GltfFile, textures: Textures, notes: list[str]) -> None:
        self.file = file
        self.textures = textures
        self.notes = notes
        self._images: dict[int, int] = {}
        self._materials: dict[int, _Material] = {}

    def parts(self) -> list[Part]:
        meshes: dict[int, list[Part]] = {}
        result: list[Part] = []
        triangles = 0
        for index, matrix in self._instances():
            if index not in meshes:
                meshes[index] = self._mesh(index)
            more = sum(len(part.faces) for part in meshes[index])
            triangles += more
            check_triangles(self.file.path, triangles)
            self.file.allowance.spend("triangles", more)
            result += [part.moved(matrix) for part in meshes[index]]
        return result

    def _instances(self) -> list[tuple[int, NDArray[np.float64]]]:
        """Meshes to draw and their matrices (4, 4), in the order of the node tree."""
        file = self.file
        nodes = file.items("nodes")
        file.allowance.spend("nodes", len(nodes))
        seen = np.zeros(len(nodes), bool)
        stack = [(root, np.eye(4)) for root in reversed(self._roots())]
        result = []
        while stack:
            index, above = stack.pop()
            node = file.item("nodes", index, "the node tree")
            name = f"nodes[{index}]"
            if seen[index]:
                file.fail(f"{name} is reached twice; the nodes must be a tree")
            seen[index] = True
            if file.extension(node, "KHR_node_visibility", name).get("visible", True) is False:
                continue  # with all that is under it
            if file.extension(node, "EXT_mesh_gpu_instancing", name):
                file.refuse_extension("EXT_mesh_gpu_instancing")
            with np.errstate(all="ignore"):  # what is not finite is refused with the vertices
                matrix = above @ self._matrix(node, name)
            if "mesh" in node:
                file.item("meshes", node["mesh"], name)
                result.append((node["mesh"], matrix))
            stack += [(child, matrix) for child in reversed(self._indices(node, "children", name))]
        return result

    def _roots(self) -> list[Any]:
        file = self.file
        if file.items("scenes"):
            return self._indices(file.item("scenes", file.document.get("scene", 0), "the file"), "nodes", "the scene")
        nodes = file.items("nodes")
        children = {child for k, node in enumerate(nodes) for child in self._indices(node, "children", f"nodes[{k}]")}
        return [k for k in range(len(nodes)) if k not in children]

    def _indices(self, owner: dict[str, Any], key: str, user: str) -> list[int]:
        value = owner.get(key, [])
        if not isinstance(value, list) or not all(isinstance(index, int) for index in value):
            self.file.fail(f"{key!r} of {user} is {value!r:.40}, not a list of numbers")
        return value

    def _matrix(self, node: dict[str, Any], name: str) -> NDArray[np.float64]:
        if not {"matrix", "rotation", "scale", "translation"} & node.keys():
            return np.eye(4)
        if "matrix" in node:
            return self.file.numbers(node, "matrix", name, [0.0] * 16).reshape(4, 4).T
        matrix = np.eye(4)
        x, y, z, w = self.file.numbers(node, "rotation", name, [0.0, 0.0, 0.0, 1.0])
        scale = self.file.numbers(node, "scale", name, [1.0, 1.0, 1.0])
        square = x * x + y * y + z * z + w * w
        if square == 0.0:
            self.file.fail(f"'rotation' of {name} is zero, not a unit quaternion")
        rotation = np.array(
            [
                [y * y + z * z, z * w - x * y, -x * z - y * w],
                [-x * y - z * w, x * x + z * z, x * w - y * z],
                [y * w - x * z, -x * w - y * z, x * x + y * y],
            ]
        )
        matrix[:3, :3] = (np.eye(3) - 2.0 / square * rotation) * scale
        matrix[:3, 3] = self.file.numbers(node, "translation", name, [0.0, 0.0, 0.0])
        return matrix

    def _mesh(self, index: int) -> list[Part]:
        mesh = self.file.item("meshes", index, "a node")
        primitives = mesh.get("primitives", [])
        if not isinstance(primitives, list) or not all(isinstance(item, dict) for item in primitives):
            self.file.fail(f"'primitives' of meshes[{index}] is not a list of objects")
        self.file.allowance.spend("primitives", len(primitives))
        parts = [self._primitive(item, f"meshes[{index}].primitives[{k}]") for k, item in enumerate(primitives)]
        return [part for part in parts if part is not None]

    def _primitive(self, primitive: dict[str, Any], name: str) -> Part | None:
        file = self.file
        mode = primitive.get("mode", _TRIANGLES)
        if mode in (0, 1, 2, 3):
            return None  # points and lines
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            file.fail(f"'mode' of {name} is {mode!r:.20}; valid: 0 to 6")
        attributes = file.table(primitive, "attributes", name)
        if "POSITION" not in attributes:
            return None  # nothing to draw, says the standard
        data = self._geometry(primitive, attributes, name)
        vertices = data("POSITION", (3,))
        file.allowance.spend("vertices", len(vertices))
        faces = data.faces if data.faces is not None else self._faces(primitive, mode, len(vertices), name)
        if not len(faces):
            return None
        # several primitives may share one accessor and use a piece of it each
        used = np.zeros(len(vertices), bool)
        used[faces] = True
        if not used.all():
            faces = (np.cumsum(used) - 1)[faces]
        vertices = vertices[used]
        if not (finite := np.isfinite(vertices).all(axis=1)).all():
            index = np.flatnonzero(used)[~finite]
            value = vertices[~finite][0].tolist()
            first = f"the first is number {index[0]}: {value}"
            file.fail(f"{len(index)} of {len(used)} vertices of {name} are not finite, {first}")
        material = self._material(primitive.get("material"), name)
        colors = material.color
        if "COLOR_0" in attributes:
            colors = self._attribute(data, "COLOR_0", (3, 4), used, name)[:, :3] * colors
        uvs = None
        if material.texture and f"TEXCOORD_{material.uv_set}" in attributes:
            uvs = self._attribute(data, f"TEXCOORD_{material.uv_set}", (2,), used, name)
            if material.uv_matrix is not None:
                with np.errstate(all="ignore"):  # what is not finite is refused with the mesh
                    uvs = uvs @ material.uv_matrix[:, :2].T + material.uv_matrix[:, 2]
        if material.texture and uvs is None:
            self.notes.append(f"{name} has a picture and no texture coordinates, it shows its colour alone")
        part = Part.of(vertices, faces, uvs, colors, material.texture if uvs is not None else 0)
        return wrap_part(part, material.wrap, self.textures)

    def _attribute(
        self, data: _Geometry, key: str, columns: tuple[int, ...], used: NDArray[np.bool_], name: str
    ) -> NDArray[np.float64]:
        values = data(key, columns)
        if len(values) != len(used):
            self.file.fail(f"{key} of {name} has {len(values)} elements for {len(used)} vertices")
        return values[used].astype(np.float64)

    def _geometry(self, primitive: dict[str, Any], attributes: dict[str, Any], name: str) -> _Geometry:
        """Where the numbers of a primitive come from: its accessors, or Draco data where they have no bytes."""
        file = self.file
        compressed = file.extension(primitive, _DRACO, name)
        position = file.item("accessors", attributes["POSITION"], name)
        if not compressed or ("bufferView" in position and not decoders.available(_DRACO)):
            return _Geometry(file, attributes, name)
        faces, arrays = file.draco(compressed, name)  # their own counts rule, whatever the accessors promise
        file.allowance.spend("packed", faces.size)
        ids = file.table(compressed, "attributes", f"{_DRACO} of {name}")
        decoded = arrays.get(_number(ids.get("POSITION")))
        count = 0 if decoded is None else len(decoded)
        if len(faces) and not 0 <= faces.min() <= faces.max() < count:
            file.fail(f"the Draco data of {name} has triangles beyond its {count} vertices")
        return _Geometry(file, attributes, name, faces, {key: arrays.get(_number(ids[key])) for key in ids})

    def _faces(self, primitive: dict[str, Any], mode: int, count: int, name: str) -> NDArray[np.int64]:
        file = self.file
        if "indices" in primitive:
            entry = file.item("accessors", primitive["indices"], f"indices of {name}")
            values = file.accessor(primitive["indices"], f"indices of {name}", (1,))[:, 0]
            file.allowance.spend("packed" if file.is_compressed(entry) else "indices", len(values))
            if values.dtype.kind != "u":
                file.fail(f"indices of {name} are of type {values.dtype}; valid: unsigned 8, 16 or 32 bits")
            order = values.astype(np.int64)
            if len(order) and order.max() >= count:
                file.fail(f"an index of {name} is {order.max()}; its vertices are 0..{count - 1}")
        else:
            file.allowance.spend("indices", count)
            order = np.arange(count, dtype=np.int64)
        if mode == _TRIANGLES:
            if len(order) % 3:
                file.fail(f"{name} has {len(order)} indices, not a multiple of 3")
            return order.reshape(-1, 3)
        if len(order) < 3:
            return np.zeros((0, 3), np.int64)
        if mode == _FAN:
            return np.stack([np.full(len(order) - 2, order[0]), order[1:-1], order[2:]], axis=1)
        faces = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
        faces[1::2] = faces[1::2, [0, 2, 1]]
        return faces

    def _material(self, index: Any, user: str) -> _Material:
        if index is None:
            return _PLAIN
        entry = self.file.item("materials", index, user)
        if index not in self._materials:
            self._materials[index] = self._read_material(entry, f"materials[{index}]")
        return self._materials[index]

    def _read_material(self, entry: dict[str, Any], name: str) -> _Material:
        file = self.file
        table = file.table(entry, "pbrMetallicRoughness", name)
        color_key, texture_key = "baseColorFactor", "baseColorTexture"
        if older := file.extension(entry, "KHR_materials_pbrSpecularGlossiness", name):
            table, color_key, texture_key = older, "diffuseFactor", "diffuseTexture"
        color = file.numbers(table, color_key, name, [1.0, 1.0, 1.0, 1.0])[:3]
        glow = file.numbers(entry, "emissiveFactor", name, [0.0, 0.0, 0.0])
        strength = file.extension(entry, "KHR_materials_emissive_strength", name)
        glow = glow * file.numbers({"s": [strength.get("emissiveStrength", 1.0)]}, "s", name, [1.0])
        says_nothing = color_key not in table and texture_key not in table
        if glow.any() and (says_nothing or not color.any()):  # all its light is its own
            table, color, texture_key = entry, np.clip(glow, 0.0, 1.0), "emissiveTexture"
        if texture_key not in table:
            return _Material(color)
        info = file.table(table, texture_key, name)
        texture, wrap = self._texture(info.get("index"), name)
        if not texture:
            return _Material(color)
        uv_set = file.integer(info, "texCoord", name, 0)
        transform = file.extension(info, "KHR_texture_transform", name)
        if not transform:
            return _Material(color, texture, uv_set, None, wrap)
        uv_set = file.integer(transform, "texCoord", name, uv_set)
        return _Material(color, texture, uv_set, self._uv(transform, name), wrap)

    def _uv(self, transform: dict[str, Any], name: str) -> NDArray[np.float64]:
        """Matrix (2, 3) of a texture transform: scale, then rotate counter-clockwise (v is down), then move."""
        su, sv = self.file.numbers(transform, "scale", name, [1.0, 1.0])
        tu, tv = self.file.numbers(transform, "offset", name, [0.0, 0.0])
        angle = transform.get("rotation", 0.0)
        (turn,) = self.file.numbers({"rotation": [angle]}, "rotation", name, [0.0])
        c, s = np.cos(turn), np.sin(turn)
        return np.array([[c * su, s * sv, tu], [-s * su, c * sv, tv]])

    def _texture(self, index: Any, user: str) -> tuple[int, Wrap]:
        """Number of a texture, 0 where its image is missing, and how it goes on beyond its border."""
        file = self.file
        entry = file.item("textures", index, user)
        name = f"textures[{index}]"
        image = file.extension(entry, "EXT_texture_webp", name).get("source", entry.get("source"))
        for extension in decoders.BASIS_EXTENSIONS:
            source = file.extension(entry, extension, name).get("source")
            if image is None and source is not None and decoders.available(extension):
                image = source
        if image is None:
            for extension in file.table(entry, "extensions", name):
                file.refuse_extension(extension)
            file.fail(f"{name} names no image")
        wrap = REPEAT
        if "sampler" in entry:
            sampler = file.item("samplers", entry["sampler"], name)
            wrap = Wrap(*(self._wrap(sampler, key, name) for key in ("wrapS", "wrapT")))
        file.item("images", image, name)
        if image not in self._images:
            data = file.image_bytes(image, name)
            where = f"scene {file.path}: images[{image}]"
            self._images[image] = 0 if data is None else self.textures.add(EncodedImage(data, where))
        return self._images[image], wrap

    def _wrap(self, sampler: dict[str, Any], key: str, name: str) -> str:
        value = sampler.get(key, 10497)
        if not isinstance(value, int) or value not in _WRAPS:
            self.file.fail(f"{key!r} of {name} is {value!r:.20}; valid: {', '.join(map(str, _WRAPS))}")
        return _WRAPS[value]


class _Geometry:
    """Attributes of a primitive by name; called for one."""

    def __init__(
        self,
        file: GltfFile,
        attributes: dict[str, Any],
        name: str,
        faces: NDArray[np.int64] | None = None,
        decoded: dict[str, NDArray[Any] | None] | None = None,
    ) -> None:
        self.file, self.attributes, self.name = file, attributes, name
        self.faces = faces  #: of Draco data; None where the primitive's own indices count
        self.decoded = decoded or {}

    def __call__(self, key: str, columns: tuple[int, ...]) -> NDArray[Any]:
        """Values (V, columns) as :meth:`GltfFile.accessor` has them."""
        user = f"{key} of {self.name}"
        if key not in self.decoded:
            return self.file.accessor(self.attributes[key], user, columns)
        entry = self.file.item("accessors", self.attributes[key], user)
        values = self.decoded[key]
        if values is None or values.ndim != 2 or values.shape[1] not in columns:
            found = "nothing" if values is None else f"an array {values.shape}"
            self.file.fail(f"{user}: the Draco data holds {found} where {columns} numbers for each vertex are needed")
        if entry.get("normalized") and values.dtype.kind in "iu":
            return np.maximum(values.astype(np.float64) / float(np.iinfo(values.dtype).max), -1.0)
        return values


def _number(value: Any) -> int:
    return value if isinstance(value, int) else -1
