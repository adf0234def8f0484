"""Files with bytes changed, cut, doubled and moved: nothing but a scene or a SceneError comes out, in bounded time.

The long run (``-m slow``) does the same for a minute per kind of file; PRNAV_FUZZ_SECONDS changes that.
"""

import gzip
import json
import os
import resource
import time
import warnings

import numpy as np
import pytest
import trimesh
from data_trees import hssd, write_room

from prnav.episodes.files import load_episodes
from prnav.errors import EpisodeError, NavMeshError, PrnavError, SceneError
from prnav.navmesh import NavMesh
from prnav.scene import open_scene_set
from prnav.scene.habitat_configs import DatasetConfig
from prnav.scene.library import parse_scene
from prnav.scene.load import load_mesh
from prnav.scene.source import read_source

NUMBERS = [b"0", b"-1", b"1e999", b"NaN", b"4294967295", b"9" * 30, b"null", b'""', b"[]", b"{}", b"true"]


def mutate(data, generator):
    """A changed copy of some bytes."""
    data = bytearray(data)
    for _ in range(int(generator.integers(1, 4))):
        size = max(len(data), 1)
        place = int(generator.integers(size))
        kind = int(generator.integers(7))
        if kind == 0:
            data[place : place + 1] = bytes([int(generator.integers(256))])
        elif kind == 1:
            data[place : place + 4] = int(generator.integers(2**32)).to_bytes(4, "little")
        elif kind == 2:
            data[place : place + 4] = generator.choice([0, 1, 2**31 - 1, 2**31, 2**32 - 1]).item().to_bytes(4, "little")
        elif kind == 3:
            del data[place : place + int(generator.integers(1, 64))]
        elif kind == 4:
            data[place:place] = data[place : place + int(generator.integers(1, 64))]
        elif kind == 5:
            del data[place:]
        else:  # a number of the text becomes another
            digits = [k for k in range(place, min(place + 400, len(data))) if 48 <= data[k] < 58]
            if digits:
                end = digits[0]
                while end < len(data) and (48 <= data[end] < 58 or data[end] in b".-e"):
                    end += 1
                data[digits[0] : end] = NUMBERS[int(generator.integers(len(NUMBERS)))]
    return bytes(data)


def glb_with_texture(quad):
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (8, 8, 3), dtype=np.uint8)).save(stream, "PNG")
    quad.add("images", {"bufferView": quad.view(stream.getvalue()), "mimeType": "image/png"})
    quad.add("textures", {"source": 0})
    quad.add("materials", {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
    quad.document["meshes"][0]["primitives"][0]["material"] = 0
    return quad.bytes()


def load_scene_file(path):
    load_mesh(read_source(path))


def load_config(path):
    config = DatasetConfig.read(path, path.parent)
    for template in [*config.stages.values(), *config.objects.values()]:
        template.asset("render_asset", config.root)
    _ = config.scenes


def load_instance(path):
    root = path.parent.parent.parent.parent
    parse_scene(open_scene_set("hssd", root).scene("hssd-hab/scenes/102.scene_instance.json"))


def load_stage(path):
    load_instance(path.parent.parent / "scenes" / "102.scene_instance.json")


OBJ = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvt 0 0\nvt 1 1\nusemtl m\nf 1/1 2/2 3/1\nf 2 4 3\n"
EPISODES = json.dumps(
    {
        "episodes": [
            {
                "episode_id": str(k),
                "scene_id": "gibson/Pablo.glb",
                "start_position": [0.5, 0.0, 1.0],
                "start_rotation": [0, 0.6, 0, 0.8],
                "info": {"geodesic_distance": 2.5, "difficulty": "easy"},
                "goals": [{"position": [1.0, 0.0, 2.0], "radius": None}],
                "shortest_paths": None,
            }
            for k in range(3)
        ]
    }
).encode()
CONFIG = json.dumps(
    {
        "stages": {
            "default_attributes": {"up": [0, 0, 1], "front": [0, 1, 0], "scale": [1, 1, 1]},
            "paths": {".glb": ["*.glb"], ".json": ["stages"]},
            "configs": [{"template_handle": "a", "attributes": {"render_asset": "a.glb", "origin": [0, 0, 0]}}],
        },
        "objects": {"paths": {".json": ["objects/*"]}},
        "scene_instances": {"paths": {".json": ["scenes"]}},
    }
).encode()

KINDS = {
    "glb": (SceneError, load_scene_file, "a.glb"),
    "gltf": (SceneError, load_scene_file, "a.gltf"),
    "obj": (SceneError, load_scene_file, "a.obj"),
    "ply": (SceneError, load_scene_file, "a.ply"),
    "ascii ply": (SceneError, load_scene_file, "a.ply"),
    "draco": (SceneError, load_scene_file, "a.glb"),
    "meshopt": (SceneError, load_scene_file, "a.glb"),
    "navmesh": (NavMeshError, NavMesh.load, "a.navmesh"),
    "episodes": (EpisodeError, load_episodes, "a.json"),
    "packed episodes": (EpisodeError, load_episodes, "a.json.gz"),
    "config": (SceneError, load_config, "a.scene_dataset_config.json"),
    "scene instance": (SceneError, load_instance, "scene_datasets/hssd-hab/scenes/102.scene_instance.json"),
    "stage config": (SceneError, load_stage, "scene_datasets/hssd-hab/stages/102.stage_config.json"),
}


def seed_of(kind, quad, tmp_path):
    if kind == "glb":
        return glb_with_texture(quad)
    if kind == "gltf":
        (tmp_path / "b.bin").write_bytes(quad.buffer)
        quad.document["buffers"][0]["uri"] = "b.bin"
        return json.dumps(quad.document).encode()
    if kind == "obj":
        (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 0 0\n")
        return OBJ
    if kind in ("ply", "ascii ply"):
        return trimesh.creation.box().export(file_type="ply", encoding="binary" if kind == "ply" else "ascii")
    if kind in ("draco", "meshopt"):
        pytest.importorskip("DracoPy" if kind == "draco" else "meshopt", reason='pip install "prnav[data]" to run this')
        from test_scene_decoders import draco, meshopt_square

        return (draco if kind == "draco" else meshopt_square)(quad).bytes()
    if kind == "navmesh":
        from data_trees import room

        NavMesh.build(room()).save(tmp_path / "seed.navmesh")
        return (tmp_path / "seed.navmesh").read_bytes()
    if kind in ("scene instance", "stage config"):
        hssd(tmp_path)
        return (tmp_path / KINDS[kind][2]).read_bytes()
    if kind == "config":
        write_room(tmp_path / "a.glb")
        return CONFIG
    return gzip.compress(EPISODES) if kind == "packed episodes" else EPISODES


def fuzz(kind, quad, tmp_path, seed, rounds=None, seconds=None):
    error, load, name = KINDS[kind]
    original = seed_of(kind, quad, tmp_path)
    generator = np.random.default_rng(seed)
    path = tmp_path / name
    path.write_bytes(original)
    load(path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    done, refused, slowest, end = 0, 0, 0.0, time.monotonic() + (seconds or 1e9)
    while done < (rounds or 10**9) and time.monotonic() < end:
        data = mutate(original, generator)
        path.write_bytes(data)
        start = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                warnings.simplefilter("ignore", UserWarning)
                load(path)
        except error as found:
            assert "\n" not in str(found) and len(str(found)) < 2000
            refused += 1
        except PrnavError as found:
            raise AssertionError(f"{type(found).__name__} instead of {error.__name__}: {found}") from found
        except BaseException:
            (tmp_path.parent / f"culprit-{path.name}").write_bytes(data)
            raise
        slowest = max(slowest, time.process_time() - start)
        done += 1
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    return done, refused, slowest, grown


@pytest.mark.parametrize("kind", KINDS)
def test_changed_files(quad, tmp_path, kind):
    done, refused, _, grown = fuzz(kind, quad, tmp_path, seed=1, rounds=150)
    assert done == 150 and refused > 10
    assert grown < 500


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_changed_files_for_long(quad, tmp_path, kind):
    seconds = float(os.environ.get("PRNAV_FUZZ_SECONDS", "60"))
    done, refused, slowest, grown = fuzz(kind, quad, tmp_path, seed=time.time_ns(), seconds=seconds)
    assert refused > 0.05 * done and grown < 1000 and slowest < 20.0
