"""Throw broken files at the readers: `python tools/fuzz.py KIND [--minutes 10] [--seed 0] [FILE ...]`.

KIND is navmesh, episodes, obj, mtl, ply or gltf, or meshes for the last four by turns.

Each round takes a sound file (a few small ones are built in, others may be named), damages it in one to four ways and
reads it. A `.navmesh` that is accepted is asked for moves, distances and a map, and written again; episodes that are
accepted are held in columns and written again. Meshes are made by grammars (`fuzz_meshes.py`), and one in five is
damaged besides. Allowed are success and prnav's own errors of one line; anything else, a round that takes longer than
--limit seconds, and more memory than --memory MB end the run with a report, and the file that did it stays in --keep.
"""

from __future__ import annotations

import argparse
import collections
import faulthandler
import gzip
import json
import random
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fuzz_meshes
import numpy as np

from prnav.episodes import EpisodeTable, load_episodes, save_episodes
from prnav.errors import PrnavError
from prnav.navmesh import NavMesh
from prnav.scene import SceneMesh, TextureAtlas

WORDS = (0, 1, 2, 3, 6, 0x7F, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 1 << 20, 2**31 - 1, 2**31, 2**32 - 1)
FLOATS = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-45,
    1e-7,
    0.05,
    1e5,
    1e5 + 1,
    1e20,
    3.4e38,
    float("inf"),
    float("-inf"),
    float("nan"),
)
VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 10**30, 10**400, 0.0, -0.0, 1e-320, 1e308, float("nan"), float("inf"), "", "0", "\0",
    "../../x", "\ud800", "x" * 5000, [], [[]], {}, {"": {}}, [0.0, 0.0, 0.0], [0, 0, 0, 1], [1e6, 1e6, 1e6], [None] * 3,
)  # fmt: skip

DEEP = "stands for brackets in brackets"


def damage(data: bytes, draw: random.Random) -> bytes:
    """A file with one to four faults: bits, bytes, words, floats, pieces lost, doubled, swapped, or the end cut off."""
    out = bytearray(data)
    for _ in range(draw.randint(1, 4)):
        if not out:
            break
        kind, at = draw.randrange(9), draw.randrange(len(out))
        word = 4 * (at // 4)
        other, size = draw.randrange(len(out)), draw.randint(1, 64)
        if kind == 0:
            out[at] ^= 1 << draw.randrange(8)
        elif kind == 1:
            out[at] = draw.randrange(256)
        elif kind == 2:
            out[word : word + 4] = draw.choice(WORDS).to_bytes(4, "little")
        elif kind == 3:
            out[word : word + 4] = np.float32(draw.choice(FLOATS)).tobytes()
        elif kind == 4:
            out[2 * (at // 2) : 2 * (at // 2) + 2] = (draw.choice(WORDS) & 0xFFFF).to_bytes(2, "little")
        elif kind == 5:
            del out[at : at + size]
        elif kind == 6:
            out[at:at] = out[other : other + size]
        elif kind == 7:
            out[at : at + size], out[other : other + size] = out[other : other + size], out[at : at + size]
        elif draw.random() < 0.3:
            del out[at:]
    return bytes(out)


def distort(value: Any, draw: random.Random, depth: int = 0) -> Any:
    """A JSON value with something in it replaced, lost, renamed or doubled."""
    if isinstance(value, dict) and value and draw.random() < 0.9:
        out = dict(value)
        key = draw.choice(list(out))
        kind = draw.randrange(8)
        if kind == 0:
            del out[key]
        elif kind == 1:
            out[draw.choice(["x", "", "episodes", "goals", "info", key.upper()])] = out.pop(key)
        else:
            out[key] = distort(out[key], draw, depth + 1)
        return out
    if isinstance(value, list) and value and draw.random() < 0.9:
        out_list = list(value)
        at = draw.randrange(len(out_list))
        kind = draw.randrange(8)
        if kind == 0:
            del out_list[at]
        elif kind == 1:
            out_list.insert(at, out_list[at])
        else:
            out_list[at] = distort(out_list[at], draw, depth + 1)
        return out_list
    return DEEP if draw.random() < 0.02 else draw.choice(VALUES)


def navmesh_seeds() -> list[bytes]:
    """Files of two small floors that the builder makes: an L with a step, and two islands above each other."""
    result = []
    for slabs in (((0, 4, 0, 2, 0.0), (0, 2, 2, 5, 0.15)), ((0, 3, 0, 3, 0.0), (1, 4, 1, 4, 2.5))):
        points, faces = [], []
        for x0, x1, z0, z1, y in slabs:
            k = len(points)
            points += [(x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0)]
            faces += [(k, k + 1, k + 2), (k, k + 2, k + 3)]
        scene = SceneMesh(
            name="slabs",
            vertices=np.array(points, np.float32),
            uvs=np.zeros((len(points), 2), np.float32),
            colors=np.full((len(points), 3), 255, np.uint8),
            faces=np.array(faces, np.int32),
            face_texture=np.zeros(len(faces), np.int32),
            atlas=TextureAtlas.from_images([]),
        )
        with tempfile.TemporaryDirectory() as folder:
            NavMesh.build(scene).save(Path(folder) / "seed.navmesh")
            result.append((Path(folder) / "seed.navmesh").read_bytes())
    return result


def episode_seeds() -> list[bytes]:
    """A file as Habitat writes them, and one with keys of other tasks."""
    episode = {
        "episode_id": "0", "scene_id": "gibson/A.glb", "start_position": [1.5, 0.25, -2.0],
        "start_rotation": [0, 0.6, 0, 0.8], "info": {"geodesic_distance": 6.5, "difficulty": "easy"},
        "goals": [{"position": [3.0, 0.25, 1.0], "radius": None}], "shortest_paths": None, "start_room": None,
    }  # fmt: skip
    other = {**episode, "episode_id": 7, "info": None, "goals": [{"position": [3, 0, 1], "object_id": 5}]}
    files = [{"episodes": [episode, other]}, {"episodes": [other] * 3, "category_to_task_category_id": {"chair": 0}}]
    return [json.dumps(file).encode() for file in files]


def read_navmesh(path: Path, data: bytes) -> str:
    """Load and use a navmesh; what came of it."""
    path.write_bytes(data)
    navmesh = NavMesh.load(path)
    a, b = navmesh.random_points(6, 0), navmesh.random_points(6, 1)
    navmesh.snap(np.concatenate([a, b + 1.0]))
    for sliding in (True, False):
        moved, _ = navmesh.step(a, b, sliding)
        assert np.isfinite(moved).all(), "a step led nowhere"
    distances = navmesh.distances(a, b)
    assert (distances >= 0).all(), "a distance below 0"
    navmesh.path(a[0], b[0])
    navmesh.clearance(a)
    low, high = navmesh.bounds
    navmesh.topdown(float(a[0, 1]), max(0.05, float((high - low).max()) / 50))
    navmesh.save(path)
    again = NavMesh.load(path)
    assert again.area == navmesh.area or np.isclose(again.area, navmesh.area), "another area after writing"
    return "accepted"


def read_episodes(path: Path, data: bytes) -> str:
    """Load episodes, hold them as columns and write them again; what came of it."""
    path.write_bytes(data)
    dataset = load_episodes(path)
    save_episodes(dataset, path.with_name("again.json.gz"))
    again = load_episodes(path.with_name("again.json.gz"))
    assert repr(again.episodes) == repr(dataset.episodes), "other episodes after writing"
    EpisodeTable.from_dataset(dataset).start_yaw.sum()
    return "accepted"


def episodes_input(seed: bytes, draw: random.Random) -> bytes:
    """A broken episode file: a distorted value, damaged text, or damaged gzip."""
    kind = draw.random()
    if kind < 0.6:
        value = json.loads(seed)
        for _ in range(draw.randint(1, 3)):
            value = distort(value, draw)
        depth = draw.choice([10, 300, 900, 980, 3000, 100_000])
        text = json.dumps(value).replace(f'"{DEEP}"', "[" * depth + "]" * depth)
        data = text.encode("utf-8", "surrogatepass")
        return gzip.compress(data, 1, mtime=0) if draw.random() < 0.2 else data
    if kind < 0.85:
        return damage(seed, draw)
    return damage(gzip.compress(seed, 1, mtime=0), draw)


def peak_memory() -> float:
    """Most memory that this process has held [MB].

    Linux counts it anew for each program that is started; ``ru_maxrss`` would begin with that of the process before.
    """
    status = Path("/proc/self/status")
    if status.exists():
        return (
            float(next(line for line in status.read_text().splitlines() if line.startswith("VmHWM")).split()[1]) / 1024
        )
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> int:
    """Fuzz one reader for some minutes; 0 if nothing was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("reader", choices=("navmesh", "episodes", *fuzz_meshes.KINDS, "meshes"))
    parser.add_argument("files", nargs="*", type=Path, help="more sound files to damage")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, help="stop after so many files instead")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=20.0, help="seconds a round may take")
    parser.add_argument("--memory", type=int, default=2000, help="MB of peak memory")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-finding"), help="where the file of a finding goes")
    options = parser.parse_intermixed_args()
    if options.reader == "meshes" or options.reader in fuzz_meshes.KINDS:
        return run_rounds(options, *mesh_rounds(options.reader))
    seeds = navmesh_seeds() if options.reader == "navmesh" else episode_seeds()
    for file in options.files:
        data = file.read_bytes()
        seeds.append(gzip.decompress(data) if data.startswith(b"\x1f\x8b") else data)
    damaged: Callable[[bytes, random.Random], bytes] = damage if options.reader == "navmesh" else episodes_input
    read = read_navmesh if options.reader == "navmesh" else read_episodes
    name = "fuzz.navmesh" if options.reader == "navmesh" else "fuzz.json"
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:  # sound files pass, and everything is compiled
            read(Path(folder) / name, seed)
    return run_rounds(
        options, lambda draw: damaged(draw.choice(seeds), draw), lambda folder, data: read(folder / name, data)
    )


Make = Callable[[random.Random], Any]
Read = Callable[[Path, Any], str]


def mesh_rounds(reader: str) -> tuple[Make, Read]:
    """How meshes of a kind are made and read; each comes with its kind."""
    kinds = fuzz_meshes.KINDS if reader == "meshes" else (reader,)

    def make(draw: random.Random) -> tuple[str, bytes]:
        kind = draw.choice(kinds)
        if kind == "gltf":
            data = fuzz_meshes.make_gltf(draw, distort)
        else:
            data = {"obj": fuzz_meshes.make_obj, "mtl": fuzz_meshes.make_mtl, "ply": fuzz_meshes.make_ply}[kind](draw)
        return kind, damage(data, draw) if draw.random() < 0.2 else data

    return make, lambda folder, made: fuzz_meshes.read_mesh(folder / "fuzz.x", made[1], made[0])


def run_rounds(options: argparse.Namespace, make: Make, read: Read) -> int:
    """Make and read files until time or rounds are over; 0 if nothing was found."""
    outcomes: collections.Counter[str] = collections.Counter()
    end, slowest, rounds, peak = time.monotonic() + 60.0 * options.minutes, 0.0, 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        while time.monotonic() < end if options.rounds is None else rounds < options.rounds:
            draw = random.Random(f"{options.seed}/{rounds}")
            made = make(draw)
            options.keep.write_bytes(made if isinstance(made, bytes) else made[1])
            faulthandler.dump_traceback_later(options.limit, exit=True)
            start = time.perf_counter()
            try:
                outcome = read(Path(folder), made)
            except PrnavError as error:
                outcome = type(error).__name__
                assert str(error) and "\n" not in str(error), f"an error of several lines: {error!r}"
            faulthandler.cancel_dump_traceback_later()
            slowest = max(slowest, time.perf_counter() - start) if rounds > 50 else 0.0  # once all is compiled
            outcomes[outcome] += 1
            rounds += 1
            peak = peak_memory()
            if peak > options.memory:
                print(f"round {rounds - 1} took {peak:.0f} MB", file=sys.stderr)
                return 1
    options.keep.unlink()
    counts = ", ".join(f"{count:,} {name}" for name, count in sorted(outcomes.items()))
    print(f"{options.reader}: {rounds:,} files ({counts}); slowest {slowest:.2f} s, peak memory {peak:.0f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
