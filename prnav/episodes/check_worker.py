"""The process that reads one file after another for :mod:`.check_files`: a line of JSON in, a line of JSON out."""

from __future__ import annotations

import json
import os
import resource
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from prnav.aliases import JSONObject
from prnav.episodes.check import duplicate_ids
from prnav.episodes.files import read_episode_file
from prnav.episodes.table import EpisodeTable
from prnav.errors import EpisodeError, NavMeshError, PrnavError, SceneError
from prnav.navmesh import NavMesh
from prnav.navmesh.extent import extent_doubts
from prnav.navmesh.fit import LEAST_SHARE, check_fit, floor_share
from prnav.processes import become_worker
from prnav.scene import SceneFile, SceneMesh, SceneSet, open_scene_set, resolve_scene
from prnav.scene.habitat_configs import read_config
from prnav.scene.library import parse_scene
from prnav.scene.scene_file import AXES


class Found(NamedTuple):
    """What a file that works holds, and what of it is worth a second look."""

    facts: list[str]
    warnings: list[str] = []  # never changed


def check_scene(path: Path, root: Path | None = None) -> Found:
    """Read a mesh file, and hold the navmesh of its name beside it against it.

    Args:
        path: the mesh.
        root: folder that its pictures may be in.

    Raises:
        SceneError: it does not work.
        NavMeshError: the navmesh beside it lies on its floors with neither up axis.
    """
    scene = parse_scene(SceneFile(path.name, path), root)
    facts = [_size(scene)]
    beside = path.with_suffix(".navmesh")
    if beside.is_file():
        facts.append(_fitting_axis(path, scene, NavMesh.load(beside), root))
    return Found(facts, [*scene.notes, *extent_doubts(scene)])


def _fitting_axis(path: Path, scene: SceneMesh, navmesh: NavMesh, root: Path | None) -> str:
    """The up axis with which a navmesh lies on a file's floors, as a sentence."""
    shares = {"y": floor_share(navmesh, scene)}
    if shares["y"] < LEAST_SHARE:
        shares["z"] = floor_share(navmesh, parse_scene(SceneFile(path.name, path, AXES["z"]), root))
    axis = max(shares, key=lambda up: shares[up])
    if shares[axis] < LEAST_SHARE:
        found = " and ".join(f"{100 * share:.0f} % with --up {up}" for up, share in shares.items())
        raise NavMeshError(
            f"navmesh {path.stem}.navmesh beside it has a floor of it under {found} (a right pair: nearly all); they "
            "belong to different scenes"
        )
    return f"navmesh {path.stem}.navmesh fits it with --up {axis}"


def check_data_scene(scenes: SceneSet, scene_id: str) -> Found:
    """Read a data set's scene with its objects and its navmesh.

    Raises:
        SceneError: a file of it does not work.
        NavMeshError: its navmesh does not work, or belongs to another frame.
    """
    place = scenes.scene(scene_id)
    scene = parse_scene(place)
    warnings = [*scene.notes, *extent_doubts(scene)]
    if place.navmesh is None:
        return Found([_size(scene), "no .navmesh beside it: one is built on first use"], warnings)
    navmesh = NavMesh.load(place.navmesh)
    check_fit(navmesh, scene, place.navmesh.name)
    return Found([_size(scene), f"navmesh {place.navmesh.name}: {navmesh.area:.1f} m2"], warnings)


def check_navmesh(path: Path) -> Found:
    """Read a navmesh.

    Raises:
        NavMeshError: it does not work.
    """
    navmesh = NavMesh.load(path)
    return Found([f"{navmesh.area:.1f} m2 on {_count(len(navmesh.islands), 'island')}"])


def check_episodes(path: Path, folder: Path, scenes: SceneSet | None) -> Found:
    """Read one episode file and look for its scenes.

    Raises:
        EpisodeError: the file or an episode in it does not work, or a scene id leaves the folder.
    """
    _, episodes = read_episode_file(path)
    if not episodes:
        return Found(["no episodes of its own (they are in content/ beside it)"])
    if several := [episode for episode in episodes if len(episode.goals) != 1]:
        raise EpisodeError(
            f"{path}: episode {several[0].episode_id} has {len(several[0].goals)} goals; point-goal navigation takes "
            "exactly one"
        )
    table = EpisodeTable.from_episodes(episodes)
    if twice := duplicate_ids(table):
        raise EpisodeError(f"{path}: {twice[0]}")
    absent = []
    for scene_id in table.scene_ids:
        try:
            if scenes is None:
                resolve_scene(scene_id, folder)
            else:
                scenes.scene(scene_id)
        except SceneError as error:
            if "is not found" not in str(error) and "is not in data set" not in str(error):
                raise EpisodeError(f"{path}: {error}") from error
            absent.append(scene_id)
    facts = [f"{_count(len(table), 'episode')} in {_count(len(table.scene_ids), 'scene')}"]
    if not absent:
        return Found(facts)
    more = f" and {len(absent) - 1} more" if len(absent) > 1 else ""
    return Found(facts, [f"its scenes are not here: {absent[0]}{more}"])


def answer(request: JSONObject, folder: Path, data: str | None, memory: int) -> JSONObject:
    """What a request comes to: {"problem": text or None, "notes": [...], "warnings": [...]}."""
    path, kind = Path(request["path"]), request["kind"]
    if path.exists() and not path.is_file():
        return {"problem": "it is no regular file but a folder, a device or a pipe; put the file itself there"}
    try:
        if kind == "scene" and request["scene_id"] is not None and data is not None:
            found = check_data_scene(_scene_set(data, folder), request["scene_id"])
        elif kind == "scene":
            root = request.get("root")
            found = check_scene(path, None if root is None else Path(root))
        elif kind == "navmesh":
            found = check_navmesh(path)
        elif kind == "config":
            read_config(path)
            found = Found([])
        else:
            found = check_episodes(path, folder, None if data is None else _scene_set(data, folder))
    except PrnavError as error:
        return {"problem": str(error)}
    except MemoryError:
        gigabytes = memory / 2**30
        return {"problem": f"needs more than {gigabytes:g} GB of memory; simplify it, or allow more (--memory)"}
    except Exception as error:  # the pass goes on whatever a file does, and the report says that it is our fault
        return {
            "problem": f"unexpected {type(error).__name__}: {str(error)[:200]} (a fault of prnav; please report it)"
        }
    return {"problem": None, "notes": [*found.facts, *found.warnings], "warnings": found.warnings}


@cache
def _scene_set(data: str, folder: Path) -> SceneSet:
    return open_scene_set(data, folder)


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}{'s' * (number != 1)}"


def _size(scene: SceneMesh) -> str:
    low, high = scene.bounds
    size = " x ".join(f"{value:.1f}" for value in high - low)
    return f"{len(scene.faces):,} triangles, {scene.atlas.num_textures - 1} textures, {size} m"


def main(arguments: list[str]) -> None:
    """Answer requests until there are no more."""
    become_worker()
    folder, data, memory = Path(arguments[0]), arguments[1] or None, int(arguments[2])
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints does not get among the replies
    for line in sys.stdin.buffer:
        reply = answer(json.loads(line), folder, data, memory)
        replies.write(json.dumps(reply).encode() + b"\n")
        replies.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
