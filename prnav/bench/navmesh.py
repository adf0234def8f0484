"""Speed of navigation queries, and networkx's and scipy's shortest paths on the same polygons beside them.

The general-purpose graphs get the usual graph of a polygon mesh: a node in the middle of each edge that two polygons
share, linked to the other such nodes of both polygons by straight distances, start and goal linked to the nodes of
theirs. Their paths bend at those nodes, so besides being slower they are longer; both are reported.

Without a scene of its own, the benchmark goes on to larger ones: building the real hospital and a synthetic scan of
1.07 million triangles on two storeys, and the memory of goals in the real office.
"""

from __future__ import annotations

import itertools
import os
import resource
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import networkx
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from prnav.aliases import Untyped
from prnav.bench.table import Row, rate, row
from prnav.episodes import generate_table
from prnav.episodes.files import write_episode_stream
from prnav.frames import forward
from prnav.navmesh import GoalFields, NavMesh, NavMeshSet
from prnav.scene import SceneMesh, TextureAtlas, load_scene

AGENTS = 1024
PAIRS = 256
EPISODES = 8192
GOALS = 64


def measure_navmesh(seconds: float = 2.0, scene: SceneMesh | None = None) -> list[Row]:
    """Rows for one floor: the real house where ``PRNAV_REAL_DATA`` is set, else a built-in home."""
    more = scene is None
    scene = _default_scene() if scene is None else scene
    NavMesh.build(scene)  # compiles
    navmesh, building = _timed_build(scene)
    meshes = NavMeshSet([navmesh])
    points = navmesh.random_points(AGENTS, 0)
    ids = np.zeros(AGENTS, np.int64)
    yaws = np.random.Generator(np.random.PCG64(0)).uniform(-np.pi, np.pi, AGENTS)
    ends = points + 0.25 * forward(yaws)
    fields = GoalFields(meshes, AGENTS)
    goals = navmesh.random_points(AGENTS, 1)
    slots = np.arange(AGENTS)
    fields.prepare(slots, ids, goals)
    a, b = _connected_pairs(navmesh, PAIRS)

    def step() -> int:
        meshes.step(ids, points, ends)
        return AGENTS

    def stop() -> int:
        meshes.step(ids, points, ends, sliding=False)
        return AGENTS

    def snap() -> int:
        meshes.snap(ids, ends)
        return AGENTS

    def clearance() -> int:
        meshes.clearance(ids, points)
        return AGENTS

    def prepare() -> int:
        fields.prepare(slots[:64], ids[:64], goals[:64])
        return 64

    def query() -> int:
        fields.query(slots, points)
        return AGENTS

    def pairs() -> int:
        navmesh.distances(a, b)
        return PAIRS

    def generate() -> int:
        return len(generate_table(navmesh, scene.name, EPISODES, 0))

    def write() -> int:
        with tempfile.TemporaryDirectory() as folder:
            table = generate_table(navmesh, scene.name, EPISODES, 0)
            write_episode_stream(Path(folder) / "episodes.json.gz", {}, table.to_json())
        return EPISODES

    graphs = _PortalGraphs(navmesh)
    ours = rate(pairs, seconds)
    nx = rate(lambda: len(graphs.networkx_distances(a, b)), seconds)
    sp = rate(lambda: len(graphs.scipy_distances(a, b)), seconds)
    exact = navmesh.distances(a, b)
    longer = graphs.scipy_distances(a, b) / exact
    name = "navmesh"
    return [
        row(name, "triangles", len(scene.faces), scene.name),
        row(name, "polygons", navmesh.mesh.num_polygons, "polygons"),
        row(name, "build", building, "s"),
        row(name, "step", rate(step, seconds), "steps/s"),
        row(name, "step_without_sliding", rate(stop, seconds), "steps/s"),
        row(name, "snap", rate(snap, seconds), "queries/s"),
        row(name, "clearance", rate(clearance, seconds), "queries/s"),
        row(name, "goal_field_prepare", rate(prepare, seconds), "goals/s"),
        row(name, "goal_field_query", rate(query, seconds), "queries/s"),
        row(name, "goal_field_memory", fields.nbytes / AGENTS / 1e3, "kB/goal"),
        row(name, "pair_distance", ours, "pairs/s"),
        row(name, "pair_distance_networkx", nx, "pairs/s"),
        row(name, "pair_distance_scipy", sp, "pairs/s"),
        row(name, "faster_than_networkx", ours / nx, "times"),
        row(name, "faster_than_scipy", ours / sp, "times"),
        row(name, "graph_path_mean_length", float(longer.mean()), "times the exact path's"),
        row(name, "graph_path_worst_length", float(longer.max()), "times the exact path's"),
        row(name, "generate", rate(generate, seconds), "episodes/s"),
        row(name, "generate_and_write", rate(write, seconds), "episodes/s"),
        *(_larger_scenes() if more else ()),
        row(name, "peak_memory", _peak_memory(), "MB"),
    ]


def _larger_scenes() -> list[Row]:
    """Building and goals where there is more to do than in one home."""
    rows = []
    for label, scene in _large_scenes():
        navmesh, building = _timed_build(scene)
        rows.append(row("navmesh", f"triangles_{label}", len(scene.faces), "triangles"))
        rows.append(row("navmesh", f"build_{label}", building, "s"))
        fields = GoalFields(NavMeshSet([navmesh]), GOALS)
        fields.prepare(np.arange(GOALS), np.zeros(GOALS), navmesh.random_points(GOALS, 1))
        rows.append(row("navmesh", f"{GOALS}_goal_fields_{label}", fields.nbytes / 1e6, "MB"))
    return rows


def _large_scenes() -> Iterator[tuple[str, SceneMesh]]:
    if folder := os.environ.get("PRNAV_REAL_DATA"):
        for name in ("aws_hospital/hospital_two_floors", "osrf_servicesim/servicesim_office"):
            yield name.split("/")[1], load_scene(Path(folder) / "scenes" / f"{name}.glb")
    yield "synthetic_scan", synthetic_scan()


def synthetic_scan(lines: int = 518, storeys: int = 2, side: float = 20.0) -> SceneMesh:
    """A finely meshed scan of storeys 3 m apart, with furniture that stands on them and a few millimetres of noise."""
    x, z = np.meshgrid(np.linspace(0.0, side, lines), np.linspace(0.0, side, lines), indexing="ij")
    corner = np.arange(lines * lines).reshape(lines, lines)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    sheet = np.concatenate([np.stack(part, axis=-1).reshape(-1, 3) for part in ((a, b, c), (a, c, d))])
    noise = np.random.Generator(np.random.PCG64(0)).normal(0.0, 0.003, (storeys, lines, lines))
    furniture = 0.9 * (np.sin(1.7 * x) * np.sin(1.3 * z) > 0.75)
    points = [np.stack([x, 3.0 * k + furniture + noise[k], z], axis=-1).reshape(-1, 3) for k in range(storeys)]
    faces = np.concatenate([sheet + k * lines * lines for k in range(storeys)])
    count = storeys * lines * lines
    return SceneMesh(
        name=f"synthetic scan, {storeys} storeys",
        vertices=np.concatenate(points).astype(np.float32),
        uvs=np.zeros((count, 2), np.float32),
        colors=np.full((count, 3), 200, np.uint8),
        faces=faces.astype(np.int32),
        face_texture=np.zeros(len(faces), np.int32),
        atlas=TextureAtlas.from_images([]),
    )


def _timed_build(scene: SceneMesh) -> tuple[NavMesh, float]:
    start = time.process_time()
    navmesh = NavMesh.build(scene)
    return navmesh, time.process_time() - start


def _peak_memory() -> float:
    """Most memory this process has had [MB]; Linux counts kilobytes, macOS bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def _default_scene() -> SceneMesh:
    if folder := os.environ.get("PRNAV_REAL_DATA"):
        return load_scene(Path(folder) / "scenes" / "aws_small_house" / "small_house.glb")
    return load_scene("prhouses/test/00")


def _connected_pairs(navmesh: NavMesh, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """``count`` random pairs of points on one island each, (count, 3) both."""
    a, b = navmesh.random_points(8 * count, 2), navmesh.random_points(8 * count, 3)
    joined = np.flatnonzero(navmesh.island_of(a) == navmesh.island_of(b))[:count]
    return a[joined], b[joined]


@dataclass(frozen=True, eq=False)
class _Links:
    """Nodes of a polygon mesh's graph and the links between them."""

    nodes: NDArray[np.float64]
    """Middles of shared edges, (M, 3) [m]."""
    links: list[tuple[int, int, float]]
    of_polygon: list[list[int]]
    """Nodes on each polygon's outline."""


class _PortalGraphs:
    """The same graph for networkx and for scipy."""

    def __init__(self, navmesh: NavMesh) -> None:
        self.navmesh = navmesh
        self.graph = _links(navmesh)
        self.networkx: Untyped = networkx.Graph()
        self.networkx.add_nodes_from(range(len(self.graph.nodes)))
        self.networkx.add_weighted_edges_from(self.graph.links)
        i, j, w = (np.array(column) for column in zip(*self.graph.links, strict=True))
        size = len(self.graph.nodes)
        self.scipy = csr_array((np.r_[w, w], (np.r_[i, j], np.r_[j, i])), shape=(size, size))

    def networkx_distances(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Path lengths [m] of pairs (n, 3) by networkx's bidirectional Dijkstra, (n,)."""
        result = np.empty(len(a))
        polygons = self._polygons(np.concatenate([a, b]))
        for k, (p, q) in enumerate(zip(a, b, strict=True)):
            start, goal = int(polygons[k]), int(polygons[len(a) + k])
            if start == goal:
                result[k] = np.linalg.norm(p - q)
                continue
            ends = [("a", n, self._gap(p, n)) for n in self.graph.of_polygon[start]]
            ends += [("b", n, self._gap(q, n)) for n in self.graph.of_polygon[goal]]
            self.networkx.add_weighted_edges_from(ends)
            result[k] = networkx.bidirectional_dijkstra(self.networkx, "a", "b")[0]
            self.networkx.remove_nodes_from(["a", "b"])
        return result

    def scipy_distances(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same by scipy's Dijkstra from the nodes of the start's polygon."""
        result = np.empty(len(a))
        polygons = self._polygons(np.concatenate([a, b]))
        for k, (p, q) in enumerate(zip(a, b, strict=True)):
            start, goal = int(polygons[k]), int(polygons[len(a) + k])
            if start == goal:
                result[k] = np.linalg.norm(p - q)
                continue
            out, back = self.graph.of_polygon[start], self.graph.of_polygon[goal]
            between = dijkstra(self.scipy, indices=out)[:, back]
            leave = np.array([self._gap(p, n) for n in out])
            arrive = np.array([self._gap(q, n) for n in back])
            result[k] = (leave[:, None] + between + arrive).min()
        return result

    def _polygons(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        return NavMeshSet([self.navmesh]).find(np.zeros(len(points), np.int64), points)[1]

    def _gap(self, point: NDArray[np.float64], node: int) -> float:
        return float(np.linalg.norm(point - self.graph.nodes[node]))


def _links(navmesh: NavMesh) -> _Links:
    mesh = navmesh.mesh
    nodes: list[NDArray[np.float64]] = []
    of_polygon: list[list[int]] = [[] for _ in range(mesh.num_polygons)]
    for polygon in range(mesh.num_polygons):
        first, last = int(mesh.polygon_start[polygon]), int(mesh.polygon_start[polygon + 1])
        corners = mesh.polygon(polygon)
        for k, other in enumerate(mesh.neighbours[first:last]):
            if other > polygon:
                of_polygon[polygon].append(len(nodes))
                of_polygon[int(other)].append(len(nodes))
                nodes.append(0.5 * (corners[k] + corners[(k + 1) % len(corners)]))
    places = np.array(nodes).reshape(-1, 3)
    links = [
        (i, j, float(np.linalg.norm(places[i] - places[j])))
        for around in of_polygon
        for i, j in itertools.combinations(around, 2)
    ]
    return _Links(places, links, of_polygon)
