"""Rendering speed against the number of triangles, agents and processes."""

from __future__ import annotations

import math
import multiprocessing
import resource
import time
from collections.abc import Callable
from multiprocessing.synchronize import Barrier
from pathlib import Path

import numpy as np

from prnav.bench.table import Row, device_name, rate, row
from prnav.bench.views import Poses, two_sensors, walking_poses
from prnav.render import Renderer
from prnav.scene import SceneMesh, TextureAtlas, load_scene, scene_ids

TRIANGLES = (10_000, 30_000, 100_000, 300_000, 1_000_000)
AGENTS = (1, 4, 16, 64, 256, 1024)
HOME = "prhouses/test/00"
SCENES = 61
SCENE_TRIANGLES = 300_000


def measure_scaling(seconds: float = 1.0) -> list[Row]:
    """Rays per second against triangles, and readings per second of 1 to 1,024 agents.

    Triangles are those of a home, split in four again and again, and those of a room whose wavy walls are ever finer:
    the worst case, in which no two rays of a view meet the same part of the tree. Then memory and time of many
    prepared scenes. The last rows count wall-clock time: one process, two at once, and what the second one adds.
    """
    rows = _split_home(seconds)
    room: list[Row] = []
    for triangles in TRIANGLES:
        mesh = cluttered_room(triangles)
        generator = np.random.Generator(np.random.PCG64(0))
        feet = generator.uniform(-4.0, 4.0, (64, 3)) * [1.0, 0.0, 1.0]
        designs = np.broadcast_to(two_sensors(), (64, 2, 7))
        poses = (np.zeros(64, np.int64), feet, generator.uniform(-np.pi, np.pi, 64), designs)
        room.append(_rays_row("room", mesh, poses, seconds))
    rows += room
    slowest = max(r["value"] for r in room) / room[-1]["value"]
    rows.append(row("scaling", "room_of_1_million_triangles_slower_by", slowest, "times"))
    home = load_scene(HOME)
    renderer = Renderer([home], rays_per_receptor=4)
    for agents in AGENTS:
        work = _reader(renderer, walking_poses(home, agents, two_sensors()))
        rows.append(row("scaling", f"{agents}_agents", rate(work, seconds), "agent readings/s"))
    rows += _residents()
    one, two = _processes(1, seconds), _processes(2, seconds)
    rows.append(row("scaling", "one_process", one, "agent readings/s (wall clock)"))
    rows.append(row("scaling", "two_processes", two, "agent readings/s (wall clock)", device_name(2)))
    rows.append(row("scaling", "two_processes_over_one", two / one, "times", device_name(2)))
    return rows


def _split_home(seconds: float) -> list[Row]:
    """Rays per second in a home of 13 thousand triangles and in the same home made of more, up to over 1 million."""
    rows: list[Row] = []
    mesh = load_scene(HOME)
    poses = walking_poses(mesh, 64, two_sensors())
    while True:
        rows.append(_rays_row("home", mesh, poses, seconds))
        if len(mesh.faces) >= TRIANGLES[-1]:
            break
        mesh = split_triangles(mesh)
    rows.append(row("scaling", "home_of_most_triangles_slower_by", rows[0]["value"] / rows[-1]["value"], "times"))
    return rows


def _rays_row(kind: str, mesh: SceneMesh, poses: Poses, seconds: float) -> Row:
    """Rays per second of two sensors of 4 x 4 receptors with 16 rays each."""
    rays = rate(_reader(Renderer([mesh]), poses), seconds) * 2 * 16 * 16
    return row("scaling", f"{kind}_of_{len(mesh.faces)}_triangles", rays / 1e6, "Mray/s")


def split_triangles(mesh: SceneMesh) -> SceneMesh:
    """The same surfaces of four times the triangles: each one split at the middles of its sides."""
    a, b, c = mesh.faces.T
    first = len(mesh.vertices) + np.arange(len(mesh.faces))
    ab, bc, ca = first, first + len(mesh.faces), first + 2 * len(mesh.faces)
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]

    def with_middles(values: np.ndarray) -> np.ndarray:
        middles = [(0.5 * values[i] + 0.5 * values[j]).astype(values.dtype) for i, j in ((a, b), (b, c), (c, a))]
        return np.concatenate([values, *middles])

    return SceneMesh(
        mesh.name,
        with_middles(mesh.vertices),
        with_middles(mesh.uvs),
        with_middles(mesh.colors),
        np.concatenate([np.stack(three, axis=-1) for three in corners]).astype(np.int32),
        np.tile(mesh.face_texture, 4),
        mesh.atlas,
    )


def _residents() -> list[Row]:
    """Memory and time of many prepared scenes: as estimated, and as this process grows."""
    rows: list[Row] = []
    for label, scenes in (
        (f"{SCENES}_homes", [load_scene(name) for name in scene_ids("train")[:SCENES]]),
        (f"{SCENES}_scenes_of_{SCENE_TRIANGLES}_triangles", [cluttered_room(SCENE_TRIANGLES)] * SCENES),
    ):
        renderer = Renderer(scenes)
        before, start = _memory(), time.process_time()
        renderer.preload().join()
        seconds, grown = time.process_time() - start, _memory() - before
        assert len(renderer.resident_scenes) == len(scenes)
        rows.append(row("scaling", f"{label}_prepared", seconds, "s"))
        rows.append(row("scaling", f"{label}_estimated", renderer.resident_bytes / 1e9, "GB"))
        if not math.isnan(grown):
            rows.append(row("scaling", f"{label}_grown", grown / 1e9, "GB"))
    return rows


def _memory() -> float:
    """Memory that this process has now [bytes]; NaN where Linux's /proc is not there."""
    status = Path("/proc/self/statm")
    if not status.exists():
        return math.nan
    return float(int(status.read_text().split()[1]) * resource.getpagesize())


def cluttered_room(triangles: int, seed: int = 0) -> SceneMesh:
    """A closed room of 10 x 3 x 10 m with wavy textured walls, as finely meshed as it takes.

    The picture stays the same while the triangles get smaller, so that only their number changes.
    """
    side = max(1, round((triangles / 12.0) ** 0.5))
    u, v = np.meshgrid(np.linspace(0.0, 1.0, side + 1), np.linspace(0.0, 1.0, side + 1))
    wave = 0.1 * np.sin(9.0 * u) * np.sin(7.0 * v)
    flat = np.stack([u, v], axis=-1).reshape(-1, 2)
    parts: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    corner = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = (x.ravel() for x in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]))
    pair = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    low, high = np.array([-5.0, 0.0, -5.0]), np.array([5.0, 3.0, 5.0])
    for axis in range(3):
        for end in (0, 1):
            place = np.empty((*u.shape, 3))
            place[..., axis] = end + np.where(end, -1.0, 1.0) * wave
            place[..., (axis + 1) % 3], place[..., (axis + 2) % 3] = u, v
            faces.append(pair + len(parts) * flat.shape[0])
            parts.append(low + place.reshape(-1, 3) * (high - low))
    vertices = np.concatenate(parts).astype(np.float32)
    picture = np.random.Generator(np.random.PCG64(seed)).integers(0, 256, (256, 256, 3), dtype=np.uint8)
    return SceneMesh(
        f"room-{triangles}",
        vertices,
        np.tile(flat, (6, 1)).astype(np.float32),
        np.full((len(vertices), 3), 255, np.uint8),
        np.concatenate(faces).astype(np.int32),
        np.ones(12 * side * side, np.int32),
        TextureAtlas.from_images([picture]),
    )


def _reader(renderer: Renderer, poses: Poses) -> Callable[[], int]:
    return lambda: len(renderer.read(*poses, grid=4))


def _processes(count: int, seconds: float) -> float:
    """Agent readings per second of wall-clock time, all processes together, on a home."""
    context = multiprocessing.get_context("spawn")
    barrier, queue = context.Barrier(count), context.SimpleQueue()
    workers = [context.Process(target=_work, args=(barrier, queue, seconds)) for _ in range(count)]
    for worker in workers:
        worker.start()
    total: float = sum(queue.get() for _ in workers)
    for worker in workers:
        worker.join()
    return total


def _work(barrier: Barrier, queue: multiprocessing.SimpleQueue[float], seconds: float) -> None:
    home = load_scene(HOME)
    work = _reader(Renderer([home], rays_per_receptor=4), walking_poses(home, 64, two_sensors()))
    work()
    barrier.wait()
    done, start = 0, time.perf_counter()
    while (spent := time.perf_counter() - start) < seconds:
        done += work()
    queue.put(done / spent)
