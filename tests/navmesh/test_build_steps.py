"""Each step of the builder against an obvious way to do the same."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from prnav.navmesh import compact, heightfield
from prnav.navmesh.contours import Contours, region_contours
from prnav.navmesh.polygons import convex_polygons
from prnav.navmesh.regions import watershed_regions

STEPS = [(-1, 0), (0, 1), (1, 0), (0, -1)]


def flat_field(mask: np.ndarray) -> compact.CompactField:
    """Cells on one level where mask (depth, width) is True."""
    depth, width = mask.shape
    top = np.ones(mask.sum(), np.int32)
    start = np.concatenate([[0], np.cumsum(mask.reshape(-1))]).astype(np.int32)
    solid = heightfield.Heightfield(width, depth, start, np.zeros_like(top), top, np.ones(len(top), np.uint8))
    return compact.compact_field(solid, 8, 1)


def blobs(seed: int, shape=(60, 80)) -> np.ndarray:
    """An irregular area with holes and islands."""
    noise = np.random.default_rng(seed).normal(size=shape)
    spectrum = np.exp(-((np.hypot(*np.meshgrid(np.fft.fftfreq(shape[1]), np.fft.fftfreq(shape[0]))) / 0.06) ** 2))
    return np.fft.ifft2(np.fft.fft2(noise) * spectrum).real > -0.01


def grid_of(field: compact.CompactField, values: np.ndarray) -> np.ndarray:
    grid = np.zeros(field.width * field.depth, values.dtype)
    grid[field.column] = values
    return grid.reshape(field.depth, field.width)


def test_every_point_of_a_triangle_is_in_a_span():
    rng = np.random.default_rng(0)
    vertices = rng.uniform(0, 3, (90, 3)).astype(np.float32)
    faces = np.arange(90, dtype=np.int32).reshape(-1, 3)
    bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    field = heightfield.solid_spans(vertices, faces, bounds, 0.05, 0.2, 45.0, 1)
    weights = rng.dirichlet([1, 1, 1], 400)
    points = np.einsum("sk,fkd->fsd", weights, vertices[faces]).reshape(-1, 3) - bounds[0]
    x, z = (points[:, [0, 2]] / 0.05).T.astype(int)
    inside = (x < field.width) & (z < field.depth)
    found = 0
    for height, column in zip(points[inside, 1] / 0.2, (x + z * field.width)[inside], strict=True):
        spans = slice(field.start[column], field.start[column + 1])
        found += bool(((field.bottom[spans] <= height + 1e-4) & (height - 1e-4 <= field.top[spans])).any())
    assert found >= 0.999 * inside.sum()  # a point on a grid line may count for the other cell


def test_spans_of_a_column_are_apart_and_in_order():
    rng = np.random.default_rng(1)
    vertices = rng.uniform(0, 2, (300, 3)).astype(np.float32)
    faces = np.arange(300, dtype=np.int32).reshape(-1, 3)
    bounds = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    field = heightfield.solid_spans(vertices, faces, bounds, 0.05, 0.05, 45.0, 1)
    assert (field.top > field.bottom).all()
    same_column = np.repeat(np.arange(len(field.start) - 1), np.diff(field.start))
    next_to = same_column[1:] == same_column[:-1]
    assert (field.bottom[1:] > field.top[:-1])[next_to].all()


def test_slope_of_triangles():
    angle = np.radians([0, 44.9, 45.1, 90, 135])
    vertices = np.concatenate([[[0, 0, 0], [0, 0, -1], [-np.cos(a), -np.sin(a), 0]] for a in angle])
    faces = np.arange(15).reshape(-1, 3)
    np.testing.assert_array_equal(
        heightfield.walkable_triangles(vertices.astype(np.float32), faces, 45.0), [1, 1, 0, 0, 0]
    )


def test_ledges_low_obstacles_and_low_ceilings():
    bottom = np.array([0, 10, 0, 0, 4], np.int32)
    top = np.array([1, 11, 2, 1, 5], np.int32)
    start = np.array([0, 2, 3, 5], np.int32)
    walkable = np.ones(5, np.uint8)
    heightfield.filter_low_ceilings(start, bottom, top, walkable, 4)
    np.testing.assert_array_equal(walkable, [1, 1, 1, 0, 1])
    walkable = np.array([1, 0, 0, 1, 0], np.uint8)
    heightfield.filter_low_obstacles(start, top, walkable, 4)
    np.testing.assert_array_equal(walkable, [1, 0, 0, 1, 1])
    flat = np.ones(25, np.int32)
    flat[12] = 5  # a block in the middle of a plane
    start = np.arange(26, dtype=np.int32)
    walkable = np.ones(25, np.uint8)
    heightfield.filter_ledges(5, 5, start, np.zeros(25, np.int32), flat, walkable, 8, 1)
    expected = np.zeros((5, 5), np.uint8)
    expected[1:4, 1:4] = 1  # the outermost cells are at the world's edge
    expected[2, 2] = 0
    np.testing.assert_array_equal(walkable.reshape(5, 5), expected)


@pytest.mark.parametrize("seed", range(4))
def test_erosion_is_a_shortest_path_to_the_border(seed):
    mask = blobs(seed)
    field = flat_field(mask)
    index = np.full(mask.shape, -1)
    index[mask] = np.arange(mask.sum())
    padded = np.pad(mask, 1)
    full = mask.copy()
    rows, columns, costs = [], [], []
    for dx, dz in STEPS:
        full &= padded[1 + dz : 1 + dz + mask.shape[0], 1 + dx : 1 + dx + mask.shape[1]]
    for dx in (-1, 0, 1):
        for dz in (-1, 0, 1):
            z, x = np.nonzero(mask)
            inside = (x + dx >= 0) & (x + dx < mask.shape[1]) & (z + dz >= 0) & (z + dz < mask.shape[0])
            z, x = z[inside], x[inside]
            both = index[z + dz, x + dx] >= 0
            if dx or dz:
                rows.append(index[z, x][both])
                columns.append(index[z + dz, x + dx][both])
                costs.append(np.full(both.sum(), 3.0 if dx and dz else 2.0))
    graph = coo_array(
        (np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), shape=(mask.sum(), mask.sum())
    ).tocsr()
    border = index[mask & ~full]
    expected = dijkstra(graph, indices=border, min_only=True)
    for radius in (0, 1, 2, 3, 5):
        area = np.ones(len(field.area), np.uint8)
        compact.erode(field.connected, area, radius)
        np.testing.assert_array_equal(area, expected >= 2 * radius)
    euclid = distance_transform_edt(padded)[1:-1, 1:-1][mask] - 1  # border cells are at 1
    assert (np.abs(expected / 2 - euclid) <= 0.6 + 0.1 * euclid).all()


@pytest.mark.parametrize("seed", range(6))
def test_regions_cover_the_area_and_are_connected(seed):
    mask = blobs(seed)
    field = flat_field(mask)
    distance, largest = compact.border_distance(field.connected, field.area)
    region, count = watershed_regions(field, distance, largest, 30, 100)
    grid = grid_of(field, region)
    islands, num = label(mask)
    sizes = np.bincount(islands.reshape(-1))
    np.testing.assert_array_equal(grid > 0, mask & (sizes[islands] >= 30))
    assert set(np.unique(region)) - {0} == set(range(1, count + 1))
    for r in range(1, count + 1):
        assert label(grid == r)[1] == 1, f"region {r} is in pieces"


@pytest.mark.parametrize("seed", range(6))
def test_contours_without_simplification_have_the_area_of_the_cells(seed):
    mask = blobs(seed)
    field = flat_field(mask)
    distance, largest = compact.border_distance(field.connected, field.area)
    region, count = watershed_regions(field, distance, largest, 0, 100)
    contours = region_contours(field, region, 0.0, 0)
    polygons = convex_polygons(contours, count, 6)
    x, z = polygons.vertices[:, 0][polygons.corners], polygons.vertices[:, 2][polygons.corners]
    used = polygons.corners >= 0
    x, z = np.where(used, x, x[:, :1]), np.where(used, z, z[:, :1])
    area = (z * np.roll(x, -1, axis=1) - x * np.roll(z, -1, axis=1)).sum(axis=1) / 2
    alone = label(mask)[0]
    single = (np.bincount(alone.reshape(-1))[alone] == 1) & mask
    # borders between regions are straightened, so one region may gain what its neighbour loses: compare islands
    assert area.sum() == mask.sum() - single.sum()
    owner_area = np.bincount(polygons.region, weights=area, minlength=count + 1)
    assert (owner_area[1:] >= 0).all()


def ring(points) -> list[tuple[int, int, int]]:
    return [(x, 0, z) for x, z in points]


def test_holes_are_cut_out_of_their_outline():
    outline = ring([(0, 0), (0, 40), (50, 40), (50, 0)])
    holes = [
        ring([(30, 10), (40, 10), (40, 20), (30, 20)]),
        ring([(5, 5), (12, 8), (8, 15)]),
        ring([(14, 20), (22, 24), (20, 33), (12, 30)]),
        ring([(42, 25), (46, 25), (44, 38)]),
    ]
    chains = [holes[0], outline, *holes[1:]]
    start = np.cumsum([0, *map(len, chains)]).astype(np.int32)
    contours = Contours(start, np.array(sum(chains, []), np.int32), np.ones(len(chains), np.int32))
    polygons = convex_polygons(contours, 1, 6)
    x, z = (polygons.vertices[:, axis][polygons.corners] for axis in (0, 2))
    used = polygons.corners >= 0
    x, z = np.where(used, x, x[:, :1]), np.where(used, z, z[:, :1])
    doubled = (z * np.roll(x, -1, axis=1) - x * np.roll(z, -1, axis=1)).sum(axis=1)

    def twice(chain):
        px, _, pz = np.array(chain).T
        return abs((px * np.roll(pz, -1) - pz * np.roll(px, -1)).sum())

    assert (doubled > 0).all()
    assert doubled.sum() == twice(outline) - sum(map(twice, holes))
    linked = polygons.neighbours >= 0
    assert linked.any(axis=1).all()


@pytest.mark.parametrize("seed", range(8))
def test_star_shaped_outlines_are_filled_exactly(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 60))
    radius = rng.integers(40, 400, 60)
    points = np.unique(np.stack([radius * np.sin(angle), radius * np.cos(angle)], axis=1).astype(int), axis=0)
    points = points[np.argsort(np.arctan2(points[:, 0], points[:, 1]))]  # counter-clockwise seen from above
    x, z = points.T
    doubled = (z * np.roll(x, -1) - x * np.roll(z, -1)).sum()
    if doubled < 0:
        points, doubled = points[::-1], -doubled
    corners = np.stack([points[:, 0], np.zeros(len(points), int), points[:, 1]], axis=1).astype(np.int32)
    for most in (3, 4, 6):
        polygons = convex_polygons(
            Contours(np.array([0, len(corners)], np.int32), corners, np.ones(1, np.int32)), 1, most
        )
        px, pz = (polygons.vertices[:, axis][polygons.corners] for axis in (0, 2))
        used = polygons.corners >= 0
        px, pz = np.where(used, px, px[:, :1]), np.where(used, pz, pz[:, :1])
        area = (pz * np.roll(px, -1, axis=1) - px * np.roll(pz, -1, axis=1)).sum(axis=1)
        assert area.sum() == doubled
        assert (area > 0).all()
