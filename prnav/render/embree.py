"""Embree's own functions, as they lie in the library that the package embreex carries.

Embreex's Python calls hold the interpreter and hand arrays back and forth; compiled loops call Embree's C functions
directly instead, one ray or a packet of eight at a time, through the addresses given here. Embree's documentation
describes ``rtcIntersect1``, ``rtcIntersect8`` and the layouts that :mod:`prnav.render.kernels` fills.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import weakref
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from prnav.errors import RenderError
from prnav.render.kernels import FIELDS, PACKET

BYTES_PER_TRIANGLE = 80
"""Memory of an Embree scene per triangle, as measured: vertices, indices, tree and its leaves."""

_TRIANGLES, _INDEX_BUFFER, _VERTEX_BUFFER = 0, 0, 1
_FLOAT3, _UINT3 = 0x9003, 0x5003
_COHERENT = 1 << 16
_ALL_FEATURES = 0xFFFFFFFF
_POINTER, _INT, _SIZE = ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t

_SIGNATURES = {
    "rtcNewDevice": (_POINTER, [ctypes.c_char_p]),
    "rtcGetDeviceError": (_INT, [_POINTER]),
    "rtcNewScene": (_POINTER, [_POINTER]),
    "rtcReleaseScene": (None, [_POINTER]),
    "rtcCommitScene": (None, [_POINTER]),
    "rtcNewGeometry": (_POINTER, [_POINTER, _INT]),
    "rtcSetNewGeometryBuffer": (_POINTER, [_POINTER, _INT, ctypes.c_uint, _INT, _SIZE, _SIZE]),
    "rtcCommitGeometry": (None, [_POINTER]),
    "rtcAttachGeometry": (ctypes.c_uint, [_POINTER, _POINTER]),
    "rtcReleaseGeometry": (None, [_POINTER]),
}


class EmbreeMesh:
    """Triangles in an Embree scene of their own, ready to be traced from any thread."""

    def __init__(self, name: str, vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> None:
        """Build the tree, in this thread alone: the same tree everywhere.

        Args:
            name: of the mesh, for errors.
            vertices: (V, 3) [m].
            faces: (F, 3).

        Raises:
            RenderError: Embree refuses, mostly for want of memory.
        """
        library, device = _library(), _device()
        scene = library.rtcNewScene(device)
        geometry = library.rtcNewGeometry(device, _TRIANGLES)
        for kind, form, array in (
            (_VERTEX_BUFFER, _FLOAT3, np.ascontiguousarray(vertices, dtype=np.float32)),
            (_INDEX_BUFFER, _UINT3, np.ascontiguousarray(faces, dtype=np.uint32)),
        ):
            buffer = library.rtcSetNewGeometryBuffer(geometry, kind, 0, form, 12, len(array))
            if buffer:
                ctypes.memmove(buffer, array.ctypes.data, array.nbytes)
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(scene)
        weakref.finalize(self, library.rtcReleaseScene, scene)
        if error := library.rtcGetDeviceError(device):
            raise RenderError(
                f"scene {name}: Embree could not prepare its {len(faces)} triangles (error {error}); "
                f"is there enough memory?"
            )
        self.address = int(scene)
        """Embree's handle of the scene; valid as long as this object lives."""


@functools.cache
def intersect_address(packet: bool) -> int:
    """Address of the C function that traces a ray, or a packet of them."""
    return int(ctypes.cast(_library()["rtcIntersect8" if packet else "rtcIntersect1"], _POINTER).value or 0)


def ray_buffer(packet: bool) -> NDArray[np.float32]:
    """Memory for eight rays with their hits, and Embree's arguments behind them, aligned as Embree wants it.

    The layout of the rays is described in :mod:`prnav.render.kernels`.
    """
    space = np.zeros(FIELDS * PACKET + 32, dtype=np.float32)
    first = -space.ctypes.data % 64 // 4
    buffer = space[first : first + FIELDS * PACKET + 16]
    arguments = buffer[FIELDS * PACKET :].view(np.uint32)
    arguments[0] = _COHERENT if packet else 0
    arguments[1] = _ALL_FEATURES
    return buffer


@functools.cache
def _library() -> ctypes.CDLL:
    """The library, through embreex's own module that needs it.

    Raises:
        RenderError: it is not there, or is not Embree 4.
    """
    advice = "pip install --force-reinstall 'embreex>=4.4'"
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        raise RenderError(f'engine "embree" needs the package embreex; {advice}')
    folder = Path(spec.origin).parent
    # a shared object gives the functions of what it is linked to as well; on Windows only the library itself does
    places = [
        *folder.glob("rtcore_scene*"),
        *folder.parent.glob("embreex.libs/*embree4*"),
        *folder.glob("*embree4*.dll"),
    ]
    failures: list[str] = []
    for place in places:
        if place.suffix not in (".so", ".pyd", ".dll", ".dylib") and ".so." not in place.name:
            continue
        try:
            library = ctypes.CDLL(str(place))
            for name, (result, arguments) in _SIGNATURES.items():
                function = getattr(library, name)
                function.restype, function.argtypes = result, arguments
            library.rtcIntersect1, library.rtcIntersect8  # noqa: B018 (an AttributeError here, not when first traced)
            return library
        except (OSError, AttributeError) as failure:
            failures.append(f"{place.name}: {failure}")
    raise RenderError(f'engine "embree" found no Embree 4 in the package embreex ({"; ".join(failures)}); {advice}')


@functools.cache
def _device() -> int:
    """The process's Embree device; trees are built in the calling thread, so that they never differ."""
    device = _library().rtcNewDevice(b"threads=1")
    if not device:
        raise RenderError('engine "embree": Embree could not start on this processor; use engine "warp"')
    return int(device)
