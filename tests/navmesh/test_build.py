"""The builder on small worlds whose walkable area is known by hand, and the laws that polygons obey."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from prnav.errors import NavMeshError
from prnav.navmesh.build import build_polygons
from prnav.navmesh.polymesh import PolyMesh
from prnav.navmesh.settings import NavMeshSettings

CELL = 0.05
MARGIN = 3 * CELL  # at the mesh's border: one cell beside the drop, two of the radius


def box(low, high):
    """Closed box, faces outwards."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return np.array(low) + corners * (np.array(high) - low), faces


def sheet(a, b, c, d):
    """Quadrilateral facing up: corners counter-clockwise seen from above."""
    return np.array([a, b, c, d], float), np.array([(0, 1, 2), (0, 2, 3)])


def floor(x0, z0, x1, z1, y=0.0):
    return sheet((x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0))


def world(*parts):
    vertices, faces, offset = [], [], 0
    for points, triangles in parts:
        vertices.append(points)
        faces.append(triangles + offset)
        offset += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def build(*parts, **settings) -> PolyMesh:
    return build_polygons(*world(*parts), NavMeshSettings(**settings))


def islands(mesh: PolyMesh) -> np.ndarray:
    """Polygons' island numbers."""
    linked = mesh.neighbours >= 0
    pair = (mesh.polygon_of_corner()[linked], mesh.neighbours[linked])
    graph = coo_array((np.ones(linked.sum()), pair), shape=(mesh.num_polygons,) * 2)
    return connected_components(graph, directed=False)[1]


def contains(mesh: PolyMesh, places: np.ndarray) -> np.ndarray:
    """Whether each place x, z lies strictly inside each polygon, (N, P)."""
    inside = np.ones((len(places), mesh.num_polygons), bool)
    for p in range(mesh.num_polygons):
        x, _, z = mesh.polygon(p).T
        x2, z2 = np.roll(x, -1), np.roll(z, -1)
        side = (z2 - z) * (places[:, :1] - x) - (x2 - x) * (places[:, 1:] - z)
        inside[:, p] = (side > 0).all(axis=1)
    return inside


def cluttered_room():
    """Room with pillars, a low table, a kerb and a slanted wall: contours with several holes."""
    rng = np.random.default_rng(3)
    parts = [floor(0, 0, 9, 7), box((5.1, 0, 1.0), (6.3, 0.75, 2.1)), box((2.0, 0, 4.6), (4.4, 0.15, 5.2))]
    for x, z in [(1.6, 1.7), (3.3, 2.9), (6.2, 4.8), (7.6, 2.6), (1.2, 5.9)]:
        size = rng.uniform(0.15, 0.5, 2)
        parts.append(box((x, 0, z), (x + size[0], 2.5, z + size[1])))
    parts.append(sheet((3.0, 0, 0.2), (3.0, 2, 0.2), (4.9, 2, 1.9), (4.9, 0, 1.9)))
    return parts


@pytest.fixture(scope="module")
def room() -> PolyMesh:
    return build(*cluttered_room())


def test_flat_floor_keeps_a_body_radius_and_a_cell_from_its_border():
    mesh = build(floor(0, 0, 4, 3))
    assert mesh.polygon_areas().sum() == pytest.approx((4 - 2 * MARGIN) * (3 - 2 * MARGIN), abs=1e-6)
    np.testing.assert_allclose(mesh.vertices[:, 1], 0.2)  # the top of the floor's cell
    np.testing.assert_allclose(mesh.bounds, [[0, 0, 0], [4, 1.6, 3]], atol=1e-6)


def test_box_takes_its_ground_and_the_radius_around_it():
    mesh = build(floor(0, 0, 4, 4), box((1.525, 0, 1.525), (2.475, 1, 2.475)))
    assert mesh.polygon_areas().sum() == pytest.approx((4 - 2 * MARGIN) ** 2 - (1.0 + 4 * CELL) ** 2, abs=0.1)
    assert len(set(islands(mesh))) == 1, "the box's top is too small to be an island"
    assert not contains(mesh, np.array([[2.0, 2.0], [1.45, 2.0], [2.55, 2.0]])).any()
    assert contains(mesh, np.array([[1.3, 2.0], [2.7, 2.0], [2.0, 1.3]])).sum() == 3


@pytest.mark.parametrize(("degrees", "walkable"), [(44, True), (46, False)])
def test_slope_limit(degrees, walkable):
    rise = 3 * np.tan(np.radians(degrees))
    mesh = build(sheet((0, 0, 0), (0, 0, 3), (3, rise, 3), (3, rise, 0)))
    assert (mesh.num_polygons > 0) == walkable


def test_downward_faces_are_no_floor():
    vertices, faces = floor(0, 0, 3, 3)
    assert build_polygons(vertices, faces[:, ::-1]).num_polygons == 0


@pytest.mark.parametrize(
    ("step", "cell_height", "joined"),
    [
        (0.19, 0.2, True),  # in the floor's own cell
        (0.39, 0.2, True),  # one cell up: the grid cannot tell it from a step of 0.2
        (0.41, 0.2, False),
        (0.19, 0.05, True),
        (0.24, 0.05, True),  # rounded up, both floors are 4 cells apart
        (0.26, 0.05, False),
    ],
)
def test_step_height(step, cell_height, joined):
    mesh = build(floor(0, 0, 4, 3), box((2, 0, 0), (4, step, 3)), cell_height=cell_height)
    assert len(set(islands(mesh))) == (1 if joined else 2)


@pytest.mark.parametrize(("height", "free"), [(1.7, False), (1.85, True)])
def test_passing_under_a_table_needs_the_body_height_in_cells(height, free):
    mesh = build(floor(0, 0, 4, 3), box((1.5, height, -0.5), (2.5, height + 0.1, 3.5)))
    beneath = contains(mesh, np.array([[2.02, 1.52]])) & (
        mesh.vertices[mesh.polygon_vertices[mesh.polygon_start[:-1]], 1] < 1
    )
    assert beneath.any() == free


def test_two_floors_are_two_islands_of_equal_area():
    mesh = build(floor(0, 0, 4, 3), floor(0, 0, 4, 3, y=3.0))
    assert len(set(islands(mesh))) == 2
    one = (4 - 2 * MARGIN) * (3 - 2 * MARGIN)
    np.testing.assert_allclose(np.bincount(islands(mesh), weights=mesh.polygon_areas()), [one, one], atol=1e-6)


def test_stairs_join_floors_that_overlap():
    steps = [box((1.0 + 0.3 * k, 0, 0), (1.3 + 0.3 * k, 0.18 * (k + 1), 1.5)) for k in range(10)]
    mesh = build(floor(0, 0, 8, 1.5), *steps, floor(4.0, 0, 8.0, 1.5, y=1.8), agent_height=0.9)
    upstairs = mesh.vertices[:, 1] > 1.7
    on_top = islands(mesh)[mesh.polygon_of_corner()[upstairs[mesh.polygon_vertices]]]
    start = contains(mesh, np.array([[0.52, 0.76]])).any(axis=0)
    assert set(islands(mesh)[start]) == set(on_top)
    assert contains(mesh, np.array([[6.03, 0.77]])).sum() == 2, "one polygon on each floor"


def test_small_islands_are_dropped_by_their_cells():
    patch = [floor(0, 0, 6, 4), floor(7, 0, 7 + 23 * CELL + MARGIN, 24 * CELL)]
    wide = box((-1, -5, -1), (10, -4, 10))
    assert len(set(islands(build(*patch, wide, region_min_size=40.0)))) < len(
        set(islands(build(*patch, wide, region_min_size=5.0)))
    )


def test_polygons_are_convex_counter_clockwise_and_small(room):
    assert (room.polygon_areas() > 0).all()
    assert np.diff(room.polygon_start).min() >= 3
    assert np.diff(room.polygon_start).max() <= 6
    for p in range(room.num_polygons):
        x, _, z = room.polygon(p).T
        dx, dz = np.roll(x, -1) - x, np.roll(z, -1) - z
        turn = dz * np.roll(dx, -1) - dx * np.roll(dz, -1)
        assert (turn >= -1e-9).all(), f"polygon {p} is not convex"


def test_neighbours_are_mutual_and_share_the_edge(room):
    owner = room.polygon_of_corner()
    following = np.arange(1, len(owner) + 1)
    following[room.polygon_start[1:] - 1] = room.polygon_start[:-1]
    edges = {
        (a, b): k for k, (a, b) in enumerate(zip(room.polygon_vertices, room.polygon_vertices[following], strict=True))
    }
    assert len(edges) == len(owner), "no directed edge is used twice"
    for (a, b), k in edges.items():
        other = edges.get((b, a))
        if room.neighbours[k] < 0:
            assert other is None
        else:
            assert owner[other] == room.neighbours[k]
            assert room.neighbours[other] == owner[k]


def test_polygons_neither_overlap_nor_leave_gaps(room):
    places = np.random.default_rng(0).uniform([0, 0], [9, 7], (20_000, 2))
    hits = contains(room, places).sum(axis=1)
    assert hits.max() == 1
    assert hits.mean() * 63 == pytest.approx(room.polygon_areas().sum(), rel=0.01)


def test_polygons_stay_off_obstacles(room):
    pillars = np.array([[1.7, 1.8], [3.35, 2.95], [6.25, 4.85], [7.65, 2.65], [5.7, 1.5]])
    assert not contains(room, pillars).any()
    assert contains(room, np.array([[3.21, 4.92]])).any(), "the kerb can be stepped on"


def test_detail_covers_each_polygon(room):
    corners = room.all_vertices[room.detail_triangles]
    x, z = corners[:, :, 0], corners[:, :, 2]
    doubled = (z * np.roll(x, -1, axis=1) - x * np.roll(z, -1, axis=1)).sum(axis=1)
    assert (doubled >= -1e-9).all()
    owner = np.repeat(np.arange(room.num_polygons), np.diff(room.detail_start))
    np.testing.assert_allclose(np.bincount(owner, weights=doubled / 2), room.polygon_areas(), atol=1e-9)
    assert room.detail_vertex_start[-1] == len(room.detail_vertices)


def test_detail_follows_a_wavy_floor():
    x, z = np.meshgrid(np.linspace(0, 8, 81), np.linspace(0, 6, 61), indexing="ij")
    y = 0.6 * np.sin(x * 1.1) * np.cos(z * 0.9)
    row = np.arange(x.size).reshape(x.shape)
    quads = np.stack([row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = build_polygons(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces)
    assert len(mesh.detail_vertices) > 10
    centres = mesh.all_vertices[mesh.detail_triangles].mean(axis=1)
    true = 0.6 * np.sin(centres[:, 0] * 1.1) * np.cos(centres[:, 2] * 0.9)
    assert np.abs(centres[:, 1] - true).max() < 3 * 0.2  # cells round up, the detail may err by one more and is lifted
    assert len(set(islands(mesh))) == 1


def test_same_input_same_polygons_wherever_it_stands():
    vertices, faces = world(*cluttered_room())
    here, again = build_polygons(vertices, faces), build_polygons(vertices, faces)
    moved = build_polygons(vertices + [4.0, -2.0, 8.0], faces)
    for name, array in here.to_arrays().items():
        np.testing.assert_array_equal(array, again.to_arrays()[name])
    assert moved.polygon_areas().sum() == pytest.approx(here.polygon_areas().sum(), rel=0.005)


def test_region_merging_leaves_the_area_alone(room):
    fine = build(*cluttered_room(), region_merge_size=0.0)
    assert fine.num_polygons >= room.num_polygons
    assert fine.polygon_areas().sum() == pytest.approx(room.polygon_areas().sum(), rel=0.01)


def test_long_walls_are_split():
    mesh = build(floor(0, 0, 9, 3), edge_max_len=1.0)
    edges = np.concatenate(
        [np.diff(np.vstack([q, q[:1]])[:, [0, 2]], axis=0) for q in map(mesh.polygon, range(mesh.num_polygons))]
    )
    wall = mesh.neighbours < 0
    assert np.linalg.norm(edges[wall], axis=1).max() <= 1.0 + 2 * CELL


def test_most_corners():
    mesh = build(*cluttered_room(), verts_per_poly=3.0)
    assert (np.diff(mesh.polygon_start) == 3).all()


def test_nothing_to_walk_on_is_no_polygons():
    empty = build_polygons(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert empty.num_polygons == 0
    assert empty.polygon_areas().shape == (0,)
    wall = sheet((0, 0, 0), (0, 0, 3), (0, 2, 3), (0, 2, 0))
    assert build(wall).num_polygons == 0
    assert build(floor(0, 0, 0.01, 0.01)).num_polygons == 0


def test_degenerate_triangles_change_nothing():
    vertices, faces = world(*cluttered_room())
    flat = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2], [5, 5, 5]])
    more = np.concatenate([faces, flat, faces[:4]])
    assert build_polygons(vertices, more).polygon_areas().sum() == build_polygons(vertices, faces).polygon_areas().sum()


@pytest.mark.parametrize("seed", range(16))
def test_laws_hold_on_triangle_soup_with_odd_settings(seed):
    rng = np.random.default_rng(seed)
    centres = rng.uniform(0, [6, rng.choice([0.3, 3.0]), 6], (120, 1, 3))
    corners = (centres + rng.normal(0, 1, (120, 3, 3)) * [1, rng.choice([0.02, 0.3]), 1]).reshape(-1, 3)
    mesh = build(
        floor(0, 0, 6, 6),
        (corners, np.arange(360).reshape(-1, 3)),
        cell_size=rng.choice([0.05, 0.1]),
        agent_height=rng.choice([0.3, 1.5]),  # lower than two steps: a cell reaches two floors of one column
        agent_max_climb=rng.choice([0.0, 0.2, 0.6]),
        agent_radius=rng.choice([0.0, 0.2]),
        region_min_size=rng.choice([0.0, 5.0]),
        region_merge_size=rng.choice([0.0, 20.0]),
        edge_max_error=rng.choice([0.0, 1.3, 4.0]),
        filter_ledge_spans=bool(rng.random() < 0.5),
    )
    assert (mesh.polygon_areas() > 0).all()
    owner = mesh.polygon_of_corner()
    pairs = set(zip(owner.tolist(), mesh.neighbours.tolist(), strict=True))
    assert all(q < 0 or (q, p) in pairs for p, q in pairs)
    for p in range(mesh.num_polygons):
        x, _, z = mesh.polygon(p).T
        dx, dz = np.roll(x, -1) - x, np.roll(z, -1) - z
        assert (dz * np.roll(dx, -1) - dx * np.roll(dz, -1) >= -1e-9).all()


def test_errors_name_the_value_and_the_remedy():
    vertices, faces = floor(0, 0, 3, 3)
    with pytest.raises(NavMeshError, match=r"faces name vertices 0 to 9; valid are 0 to 3"):
        build_polygons(vertices, np.array([[0, 1, 9]]))
    with pytest.raises(NavMeshError, match=r"vertices have shape \(4, 2\); they must have shape \(V, 3\)"):
        build_polygons(vertices[:, :2], faces)
    with pytest.raises(NavMeshError, match=r"faces have shape \(6,\); they must have shape \(F, 3\)"):
        build_polygons(vertices, faces.reshape(-1))
    broken = vertices.copy()
    broken[2, 1] = np.nan
    with pytest.raises(NavMeshError, match=r"vertex 2 is \[3.0, nan, 3.0\]; all must be finite"):
        build_polygons(broken, faces)
    with pytest.raises(
        NavMeshError, match=r"3000 x 0 x 3000 m .*, 3600000000 cells .* cut the mesh, or give a larger cell_size"
    ):
        build_polygons(vertices * 1000, faces)


def test_settings_refuse_what_cannot_be_built():
    for name, value, text in [
        ("cell_size", 0.0, "cell_size is 0.0; it must be at least 0.0001 metres"),
        ("agent_max_slope", 90.0, "agent_max_slope is 90.0; it must be in"),
        ("verts_per_poly", 7.0, "verts_per_poly is 7.0; it must be 3, 4, 5 or 6"),
        ("agent_radius", -0.1, "agent_radius is -0.1; it must be 0 or more"),
        ("edge_max_len", float("nan"), "edge_max_len is nan; it must be finite"),
    ]:
        with pytest.raises(ValueError, match=text):
            NavMeshSettings(**{name: value})


def test_settings_count_cells_as_float32_does():
    assert NavMeshSettings(agent_max_climb=0.6).walkable_climb == 3
    assert NavMeshSettings().walkable_height == 8
    assert NavMeshSettings().walkable_radius == 2
