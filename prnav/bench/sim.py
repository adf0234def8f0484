"""Speed of the simulator and its environments on built-in homes, one core."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable

import numpy as np

from prnav.aliases import JSONObject
from prnav.domains.navigation.env import EpisodeSource, load_source
from prnav.domains.navigation.pointgoal import PointGoalEnvConfig, PointGoalNavVectorEnv
from prnav.episodes import generate_table
from prnav.navmesh import load_navmesh
from prnav.navmesh.cover import indoor_floors
from prnav.scene import SceneMesh
from prnav.sim import World
from prnav.version import __version__

AGENTS = 64
EPISODES = 512  #: drawn in a scene of one's own
WALK = (1, 1, 1, 2, 3)  #: actions of the benchmark's agents, drawn with equal chance


def measure_sim(seconds: float = 2.0, scenes: int = 8, scene: SceneMesh | None = None) -> list[JSONObject]:
    """Rows of ``name metric value unit device version``.

    Speeds count CPU time of this process, not wall-clock time, so that other work on the machine matters less.

    Args:
        seconds: how long each row is measured [s].
        scenes: how many homes of the val split the agents are spread over.
        scene: a scene that all agents are in instead; episodes are drawn in it.
    """
    config = PointGoalEnvConfig(scenes="val", max_scenes=scenes)
    source = load_source(config) if scene is None else _source_of(scene)
    rows = [
        _row("env_step_photoreceptors", _steps(config, source, seconds), "steps/s"),
        _row("env_step_blind", _steps(PointGoalEnvConfig(scenes="val", vision=False), source, seconds), "steps/s"),
        _row("expert_actions", _labels(source, seconds), "labels/s"),
        _row("generate_episodes", _episodes(source, seconds), "episodes/s"),
    ]
    return rows


def _source_of(scene: SceneMesh) -> EpisodeSource:
    """Episodes in one scene."""
    navmesh = load_navmesh(scene)
    world = World((scene.name,), (scene,), (navmesh,), ("built",))
    return EpisodeSource(world, generate_table(navmesh, scene.name, EPISODES, 0, floors=indoor_floors(navmesh, scene)))


def _row(metric: str, value: float, unit: str) -> JSONObject:
    device = f"{platform.machine()} {platform.system()}, 1 core"
    return {
        "name": "sim",
        "metric": metric,
        "value": round(value, 1),
        "unit": unit,
        "device": device,
        "version": __version__,
    }


def _rate(work: Callable[[], int], seconds: float) -> float:
    """Things done per second of CPU time; ``work`` does some and says how many. Its first call compiles."""
    work()
    done, start = 0, time.process_time()
    while time.process_time() - start < seconds:
        done += work()
    return done / (time.process_time() - start)


def _steps(config: PointGoalEnvConfig, source: EpisodeSource, seconds: float) -> float:
    env = PointGoalNavVectorEnv(AGENTS, config, source)
    env.reset(seed=0)
    generator = np.random.Generator(np.random.PCG64(0))

    def work() -> int:
        for actions in generator.choice(WALK, size=(10, AGENTS)):
            env.step(actions)
        return 10 * AGENTS

    return _rate(work, seconds)


def _labels(source: EpisodeSource, seconds: float) -> float:
    env = PointGoalNavVectorEnv(AGENTS, PointGoalEnvConfig(scenes="val", vision=False), source)
    env.reset(seed=0)
    spent, labels = 0.0, 0
    env.step(env.expert_actions())
    while spent < seconds:
        start = time.process_time()
        actions = env.expert_actions()
        spent += time.process_time() - start
        labels += AGENTS
        env.step(actions)
    return labels / spent


def _episodes(source: EpisodeSource, seconds: float) -> float:
    world = source.world
    seed = 0

    def work() -> int:
        nonlocal seed
        seed += 1
        for scene_id, navmesh in zip(world.scene_ids, world.navmeshes, strict=True):
            generate_table(navmesh, scene_id, 64, seed)
        return 64 * len(world.scene_ids)

    return _rate(work, seconds)
