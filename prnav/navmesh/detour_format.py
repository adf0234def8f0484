"""Layout of Habitat's ``.navmesh`` files: a set header, then Detour tiles (little-endian, 32-bit references).

Before: nothing. After: :mod:`.detour` and :mod:`.detour_write`.
"""

from __future__ import annotations

import numpy as np

SET_MAGIC = int.from_bytes(b"TESM", "little")  #: the characters 'MSET' as one number
TILE_MAGIC = int.from_bytes(b"VAND", "little")  #: 'DNAV'
TILE_VERSION = 7
VERTS_PER_POLYGON = 6
EXTERNAL = 0x8000  #: neighbour entry of an edge on a tile's border; the low byte is the side
NULL_LINK = 0xFFFFFFFF
ON_OUTLINE = 1  #: Detour's detail edge flag

SET_HEADER = np.dtype(
    [
        ("magic", "<u4"),
        ("version", "<i4"),
        ("tiles", "<i4"),
        ("origin", "<f4", 3),
        ("tile_width", "<f4"),
        ("tile_height", "<f4"),
        ("max_tiles", "<i4"),
        ("max_polys", "<i4"),
    ]
)
SETTINGS = np.dtype(
    [
        ("cell_size", "<f4"),
        ("cell_height", "<f4"),
        ("agent_height", "<f4"),
        ("agent_radius", "<f4"),
        ("agent_max_climb", "<f4"),
        ("agent_max_slope", "<f4"),
        ("region_min_size", "<f4"),
        ("region_merge_size", "<f4"),
        ("edge_max_len", "<f4"),
        ("edge_max_error", "<f4"),
        ("verts_per_poly", "<f4"),
        ("detail_sample_dist", "<f4"),
        ("detail_sample_max_error", "<f4"),
        ("filter_low_hanging_obstacles", "u1"),
        ("filter_ledge_spans", "u1"),
        ("filter_walkable_low_height_spans", "u1"),
        ("include_static_objects", "u1"),
    ]
)
TILE_ENTRY = np.dtype([("reference", "<u4"), ("size", "<i4")])
TILE_HEADER = np.dtype(
    [
        ("magic", "<u4"),
        ("version", "<i4"),
        ("x", "<i4"),
        ("y", "<i4"),
        ("layer", "<i4"),
        ("user", "<u4"),
        ("polys", "<i4"),
        ("verts", "<i4"),
        ("links", "<i4"),
        ("details", "<i4"),
        ("detail_verts", "<i4"),
        ("detail_tris", "<i4"),
        ("nodes", "<i4"),
        ("connections", "<i4"),
        ("connection_base", "<i4"),
        ("walkable_height", "<f4"),
        ("walkable_radius", "<f4"),
        ("walkable_climb", "<f4"),
        ("low", "<f4", 3),
        ("high", "<f4", 3),
        ("quantisation", "<f4"),
    ]
)
POLYGON = np.dtype(
    [
        ("first_link", "<u4"),
        ("verts", "<u2", VERTS_PER_POLYGON),
        ("neighbours", "<u2", VERTS_PER_POLYGON),
        ("flags", "<u2"),
        ("count", "u1"),
        ("area_and_type", "u1"),
    ]
)
LINK = np.dtype([("polygon", "<u4"), ("next", "<u4"), ("edge", "u1"), ("side", "u1"), ("low", "u1"), ("high", "u1")])
DETAIL = np.dtype([("vert_base", "<u4"), ("tri_base", "<u4"), ("verts", "u1"), ("tris", "u1"), ("padding", "u1", 2)])
NODE = np.dtype([("low", "<u2", 3), ("high", "<u2", 3), ("index", "<i4")])
CONNECTION_SIZE = 36
