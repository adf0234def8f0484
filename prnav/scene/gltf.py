"""glTF containers: typed access to the JSON, and accessors as arrays.

Nothing is believed before it is checked: every offset, count and index is compared with the bytes that are there
before anything of that size is allocated.
"""

from __future__ import annotations

import urllib.parse
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import Array, JSONObject, Untyped
from prnav.errors import SceneError
from prnav.scene import decoders
from prnav.scene.allowance import Allowance
from prnav.scene.glb import decode_data_uri, is_data_uri, parse_json, split_glb
from prnav.scene.source import MeshSource

_COMPONENTS: dict[int, type[Untyped]] = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}

READ = {
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_xmp_json_ld",
    "KHR_node_visibility",
}
"""Extensions that a file may require, besides all of ``KHR_materials_``, which change shading and no geometry."""

_OR = f"{decoders.INSTALL}, or export it"
_REMEDIES = {
    "EXT_meshopt_compression": f"{_OR} without mesh compression (gltfpack: without -c and -cc)",
    "KHR_meshopt_compression": f"{_OR} without mesh compression",
    "KHR_draco_mesh_compression": f"{_OR} without Draco compression (Blender: switch off Compression)",
    "KHR_texture_basisu": f"{_OR} with PNG or JPEG textures",
    "GOOGLE_texture_basis": f"{_OR} with PNG or JPEG textures",
    "EXT_mesh_gpu_instancing": "export it with one node per instance",
}


class GltfFile:
    """A glTF file with checked access to what it holds."""

    def __init__(self, source: MeshSource) -> None:
        self.path: Path = source.path
        self._side = source.side
        size = len(source.data) + sum(map(len, source.side.values()))
        self.allowance = Allowance(f"scene {source.path}", size)
        self._chunk: memoryview | None = None
        text: bytes | memoryview = source.data
        if source.suffix == ".glb":
            text, self._chunk = split_glb(source.path, source.data)
        self.document: JSONObject = parse_json(source.path, text)
        self._buffers: dict[int, bytes | memoryview] = {}
        self._decoded: dict[int, bytes] = {}
        self._lists: dict[str, list[JSONObject]] = {}
        self._check_version()

    def fail(self, problem: str, remedy: str = "repair or export the file again") -> NoReturn:
        """Raise a :class:`SceneError` that names the file."""
        raise SceneError(f"scene {self.path}: {problem}; {remedy}")

    def refuse_extension(self, name: str) -> NoReturn:
        """Raise for an extension that cannot be decoded."""
        remedy = _REMEDIES.get(name, "export it without this extension")
        self.fail(f"it needs the glTF extension {name}, which cannot be decoded here", remedy)

    def item(self, kind: str, index: Untyped, user: str) -> JSONObject:
        """Object ``index`` of the top-level list ``kind``; ``user`` says who asks."""
        items = self.items(kind)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(items):
            self.fail(f"{user} refers to {kind}[{index!r}] where there are {len(items)}")
        return items[index]

    def items(self, kind: str) -> list[JSONObject]:
        """The top-level list ``kind`` of objects."""
        if kind not in self._lists:
            items = self.document.get(kind, [])
            if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
                self.fail(f"{kind!r} is not a list of objects")
            self._lists[kind] = items
        return self._lists[kind]

    def table(self, owner: JSONObject, key: str, user: str) -> JSONObject:
        """The object under ``key``, {} where there is none."""
        value = owner.get(key, {})
        if not isinstance(value, dict):
            self.fail(f"{key!r} of {user} is {value!r:.40}, not an object")
        return value

    def extension(self, owner: JSONObject, name: str, user: str) -> JSONObject:
        """The object of an extension, {} where there is none."""
        return self.table(self.table(owner, "extensions", user), name, user)

    def integer(self, owner: JSONObject, key: str, user: str, default: int | None = None) -> int:
        """The whole number >= 0 under ``key``."""
        value = owner.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            self.fail(f"{key!r} of {user} is {value!r:.40}, not a whole number >= 0")
        return value

    def numbers(self, owner: JSONObject, key: str, user: str, default: list[float]) -> NDArray[np.float64]:
        """The list of numbers under ``key``, as many as the default has."""
        value = owner.get(key, default)
        good = isinstance(value, list) and len(value) == len(default)
        if not good or not all(isinstance(x, int | float) and abs(x) < 1e30 for x in value):
            self.fail(f"{key!r} of {user} is {value!r:.60}, not a list of {len(default)} finite numbers")
        return np.array(value, np.float64)

    def accessor(self, index: Untyped, user: str, columns: tuple[int, ...]) -> Array:
        """Accessor as an array (count, columns): float64 where normalised, else in the file's own type.

        Args:
            index: its number.
            user: who asks, for errors.
            columns: numbers of columns that are valid here.
        """
        entry = self.item("accessors", index, user)
        name = f"accessors[{index}] ({user})"
        dtype = self._component(entry, name)
        width = _COLUMNS.get(str(entry.get("type")), 0)
        if width not in columns:
            self.fail(f"{name} is of type {entry.get('type')!r:.40} where {columns} columns are needed")
        count = self.integer(entry, "count", name)
        sparse = self.table(entry, "sparse", name)
        if "bufferView" in entry:
            values = self._view(entry, name, dtype, count, width)
        elif not sparse:
            self.fail(f"{name} has no data: it names no bufferView")
        else:
            self.allowance.spend("empty", count)
            values = np.zeros((count, width), dtype)
        if sparse:
            values = self._with_sparse(values, sparse, name)
        if entry.get("normalized") and dtype is not np.float32:
            return np.maximum(values.astype(np.float64) / float(np.iinfo(values.dtype).max), -1.0)
        return values

    def is_compressed(self, entry: JSONObject) -> bool:
        """Whether an accessor's bytes are stored under a mesh compression."""
        index = entry.get("bufferView")
        if index is None:
            return False
        view = self.item("bufferViews", index, "an accessor")
        return any(self.extension(view, name, f"bufferViews[{index}]") for name in decoders.MESHOPT_EXTENSIONS)

    def draco(self, compressed: JSONObject, name: str) -> tuple[NDArray[np.int64], dict[int, Array]]:
        """Triangles and attributes by id of a primitive under KHR_draco_mesh_compression."""
        if not decoders.available("KHR_draco_mesh_compression"):
            self.refuse_extension("KHR_draco_mesh_compression")
        data, _ = self._view_bytes(compressed.get("bufferView"), name)
        try:
            return decoders.decode_draco(data)
        except ValueError as error:
            self.fail(f"the Draco data of {name} cannot be decoded ({error})")

    def image_bytes(self, index: Untyped, user: str) -> bytes | memoryview | None:
        """The encoded image number ``index``; None where it is a file that is not there."""
        entry = self.item("images", index, user)
        name = f"images[{index}]"
        if "bufferView" in entry:
            data, _ = self._view_bytes(entry["bufferView"], name)
            return data
        uri = entry.get("uri")
        if not isinstance(uri, str):
            self.fail(f"{name} has neither a bufferView nor a uri")
        if not is_data_uri(uri) and urllib.parse.unquote(uri) not in self._side:
            return None
        return self._uri(uri, name)

    def _check_version(self) -> None:
        version = str(self.table(self.document, "asset", "the file").get("version", ""))
        if not version.startswith("2."):
            self.fail(f"it is glTF version {version or 'unknown'!r:.20}", "export it as glTF 2.0")
        required = self.document.get("extensionsRequired", [])
        if not isinstance(required, list):
            self.fail("'extensionsRequired' is not a list")
        for name in map(str, required):
            known = name in READ or name.startswith("KHR_materials_")
            if not known and not decoders.available(name):
                self.refuse_extension(name)

    def _component(self, entry: JSONObject, name: str) -> type[Untyped]:
        kind = entry.get("componentType")
        if not isinstance(kind, int) or kind not in _COMPONENTS:
            self.fail(f"{name} has componentType {kind!r:.40}; valid: {', '.join(map(str, _COMPONENTS))}")
        return _COMPONENTS[kind]

    def _view(self, entry: JSONObject, name: str, dtype: type, count: int, width: int) -> Array:
        """Elements (count, width) of a bufferView, at the entry's byteOffset, checked and without a copy."""
        data, stride = self._view_bytes(entry["bufferView"], name)
        offset = self.integer(entry, "byteOffset", name, 0)
        size = np.dtype(dtype).itemsize * width
        stride = stride or size
        if stride < size:
            self.fail(f"{name} has elements of {size} bytes every {stride} bytes")
        needed = offset + (count - 1) * stride + size if count else 0
        if needed > len(data):
            self.fail(f"{name} promises {count} elements, {needed} bytes, where its bufferView has {len(data)}")
        if not count:
            return np.zeros((0, width), dtype)
        little = np.dtype(dtype).newbyteorder("<")
        return np.ndarray((count, width), little, data, offset, (stride, np.dtype(dtype).itemsize))

    def _view_bytes(self, index: Untyped, user: str) -> tuple[bytes | memoryview, int]:
        view = self.item("bufferViews", index, user)
        name = f"bufferViews[{index}]"
        for extension in decoders.MESHOPT_EXTENSIONS:
            compressed = self.extension(view, extension, name)
            if compressed and decoders.available(extension):
                if index not in self._decoded:
                    self._decoded[index] = self._meshopt(compressed, name)
                return self._decoded[index], self.integer(view, "byteStride", name, 0)
        data = self._buffer(view, name)
        offset = self.integer(view, "byteOffset", name, 0)
        length = self.integer(view, "byteLength", name)
        if offset + length > len(data):
            self.fail(f"{name} reaches to byte {offset + length} of a buffer that has {len(data)}")
        return memoryview(data)[offset : offset + length], self.integer(view, "byteStride", name, 0)

    def _meshopt(self, compressed: JSONObject, name: str) -> bytes:
        """Bytes of a bufferView that is stored under EXT_meshopt_compression."""
        data = memoryview(self._buffer(compressed, name))
        offset = self.integer(compressed, "byteOffset", name, 0)
        length = self.integer(compressed, "byteLength", name)
        if offset + length > len(data):
            self.fail(f"compressed {name} reaches to byte {offset + length} of a buffer that has {len(data)}")
        count, stride = self.integer(compressed, "count", name), self.integer(compressed, "byteStride", name)
        mode, kind = str(compressed.get("mode")), str(compressed.get("filter", "NONE"))
        try:
            return decoders.decode_meshopt(data[offset : offset + length], count, stride, mode, kind)
        except ValueError as error:
            self.fail(f"the meshopt data of {name} cannot be decoded ({error})")

    def _buffer(self, view: JSONObject, user: str) -> bytes | memoryview:
        index = view.get("buffer")
        entry = self.item("buffers", index, user)
        assert isinstance(index, int)
        if index not in self._buffers:
            name = f"buffers[{index}]"
            uri = entry.get("uri")
            data: bytes | memoryview
            if isinstance(uri, str):
                data = self._uri(uri, name)
            elif index == 0 and self._chunk is not None:
                data = self._chunk
            else:
                for extension in decoders.MESHOPT_EXTENSIONS:
                    if self.extension(view, extension, user):
                        self.refuse_extension(extension)
                self.fail(f"{name} has no data: no uri and no binary chunk")
            length = self.integer(entry, "byteLength", name)
            if length > len(data):
                self.fail(f"{name} promises {length} bytes and has {len(data)}: it is cut off", "copy it again")
            self._buffers[index] = data
        return self._buffers[index]

    def _uri(self, uri: str, name: str) -> bytes:
        if is_data_uri(uri):
            return decode_data_uri(self.path, uri)
        data = self._side.get(urllib.parse.unquote(uri))
        if data is None:
            self.fail(f"{name} is in the file {uri!r}, which is missing", "put it beside the mesh")
        return data

    def _with_sparse(self, values: Array, sparse: JSONObject, name: str) -> Array:
        count = self.integer(sparse, "count", f"sparse {name}")
        places = self.table(sparse, "indices", name)
        contents = self.table(sparse, "values", name)
        dtype = self._component(places, f"sparse indices of {name}")
        rows = self._view(places, f"sparse indices of {name}", dtype, count, 1)[:, 0].astype(np.int64)
        new = self._view(contents, f"sparse values of {name}", values.dtype.type, count, values.shape[1])
        if count and not 0 <= rows.min() <= rows.max() < len(values):
            self.fail(f"a sparse index of {name} is outside 0..{len(values) - 1}")
        values = values.copy()
        values[rows] = new
        return values
