"""Speed of navigation queries, and networkx's and scipy's shortest paths on the same polygons beside them.

The general-purpose graphs get the usual graph of a polygon mesh: a node in the middle of each edge that two polygons
share, linked to the other such nodes of both polygons by straight distances, start and goal linked to the nodes of
theirs. Their paths bend at those nodes, so besides being slower they are longer; both are reported.
"""

from __future__ import annotations

import itertools
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from prnav.bench.table import Row, rate, row
from prnav.frames import forward
from prnav.navmesh import GoalFields, NavMesh, NavMeshSet
from prnav.scene import SceneMesh, load_scene

AGENTS = 1024
PAIRS = 256
GRAPH_PAIRS = 8


def measure_navmesh(seconds: float = 2.0, scene: SceneMesh | None = None) -> list[Row]:
    """Rows for one floor: the real house where ``PRNAV_REAL_DATA`` is set, else a built-in home."""
    scene = _default_scene() if scene is None else scene
    NavMesh.build(scene)  # compiles
    start = time.process_time()
    navmesh = NavMesh.build(scene)
    building = time.process_time() - start
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

    graphs = _PortalGraphs(navmesh)
    few = a[:GRAPH_PAIRS], b[:GRAPH_PAIRS]
    ours = rate(pairs, seconds)
    nx = rate(lambda: len(graphs.networkx_distances(*few)), seconds)
    sp = rate(lambda: len(graphs.scipy_distances(*few)), seconds)
    exact = navmesh.distances(a, b)
    longer = graphs.scipy_distances(a, b) / exact
    name = "navmesh"
    return [
        row(name, "triangles", len(scene.faces), scene.name),
        row(name, "polygons", navmesh.mesh.num_polygons, "polygons"),
        row(name, "build", building, "s"),
        row(name, "step", rate(step, seconds), "steps/s"),
        row(name, "snap", rate(snap, seconds), "queries/s"),
        row(name, "clearance", rate(clearance, seconds), "queries/s"),
        row(name, "goal_field_prepare", rate(prepare, seconds), "goals/s"),
        row(name, "goal_field_query", rate(query, seconds), "queries/s"),
        row(name, "pair_distance", ours, "pairs/s"),
        row(name, "pair_distance_networkx", nx, "pairs/s"),
        row(name, "pair_distance_scipy", sp, "pairs/s"),
        row(name, "faster_than_networkx", ours / nx, "times"),
        row(name, "faster_than_scipy", ours / sp, "times"),
        row(name, "graph_path_mean_length", float(longer.mean()), "times the exact path's"),
        row(name, "graph_path_worst_length", float(longer.max()), "times the exact path's"),
    ]


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
        self.networkx: Any = networkx.Graph()
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
