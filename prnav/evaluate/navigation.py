"""Evaluating an agent on a navigation task: which episodes, in which world, by whom, into which folder."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from prnav.cache import cache_key, hash_arrays
from prnav.config import to_mapping
from prnav.domains.navigation.benchmark import benchmark_of
from prnav.domains.navigation.env.config import EnvConfig
from prnav.domains.navigation.env.episode_source import EpisodeSource, load_source
from prnav.domains.navigation.env.slots import NavigationSlots
from prnav.domains.navigation.maps import FloorMap, make_maps, save_maps
from prnav.domains.navigation.references import reference_agent
from prnav.domains.navigation.sights import record_sights
from prnav.errors import ConfigError
from prnav.evaluate.agents import Agent
from prnav.evaluate.evaluator import Played, play_episodes
from prnav.evaluate.records import Evaluation, RecordWriter
from prnav.evaluate.summary import summarise
from prnav.evaluate.workers import play_in_processes
from prnav.sensors import Body
from prnav.sim.world import Progress
from prnav.version import __version__

if TYPE_CHECKING:
    from prnav.evaluate.learned import ActionChoice, TrainedRun

EPISODES_PER_WORKER = 24
"""Fewer episodes than this are not worth another process."""


@dataclass(frozen=True, eq=False)
class Questions:
    """The episodes that are evaluated, with their world."""

    name: str
    """Split or file they come from."""
    source: EpisodeSource
    config: EnvConfig
    """With ``limit`` and ``up``, what :func:`.load_source` was asked for: workers load the same."""
    limit: int | None = None
    up: str | None = None

    @cached_property
    def hash(self) -> str:
        """First 16 hex digits of a SHA-256 over ids, starts and goals in order."""
        source = self.source
        places = hash_arrays({"starts": source.starts, "yaws": source.yaws, "goals": source.goals})
        return cache_key(source.ids, places)[:16]


@dataclass(frozen=True, eq=False)
class Player:
    """Who plays and how: enough to build slots and agent in any process."""

    config: EnvConfig
    agent: str | TrainedRun
    actions: ActionChoice
    num_envs: int
    device: str

    def build(self, source: EpisodeSource, num_slots: int) -> tuple[NavigationSlots, Agent]:
        """Slots over a source, and the agent for them."""
        slots = NavigationSlots(source, min(num_slots, len(source)), self.config)
        if isinstance(self.agent, str):
            return slots, reference_agent(
                self.agent,
                slots.expert_actions,
                task=self.config.task_name,
                num_slots=slots.num_slots,
                forward_step=self.config.sim.forward_step,
                stop_distance=self.config.rules.success_distance,
            )
        from prnav.evaluate.learned import PolicyAgent

        run = self.agent
        agent = PolicyAgent(run.build(), run.name, self.actions, slots.num_slots, self.device, slots.first_action)
        return slots, agent


def load_questions(
    config: EnvConfig, limit: int | None = None, up: str | None = None, progress: Progress | None = None
) -> Questions:
    """Episodes that a config names and the scenes they need; arguments as :func:`.load_source`.

    Raises:
        EpisodeError: the episodes cannot be read, there are none, or they belong to other scenes than these.
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor.
    """
    name = config.scenes if config.episodes is None else Path(config.episodes).name
    if config.data is not None:
        name = f"{config.data}-{name if config.episodes is not None else config.episode_split or config.scenes}"
    return Questions(name, load_source(config, progress, limit=limit, up=up), config, limit, up)


def describe(
    questions: Questions, slots: NavigationSlots, agent: Agent, seed: int, facts: dict[str, Any]
) -> dict[str, Any]:
    """What an evaluation's result depends on, as the head of its records; no path of this machine is in it."""
    config, world, design = slots.config, questions.source.world, slots.design
    kept = ["grid", "rays_per_receptor", "engine", "vision", "sim", "navmesh"]
    settings = to_mapping(config)
    body = {"radius": config.navmesh.agent_radius, "height": config.navmesh.agent_height}
    seat = dataclasses.asdict(design.body) if isinstance(design.body, Body) else {"shape": design.body.shape}
    sensors = {"name": design.name, "grid": config.grid, "body": seat, "sensors": design.sensors.tolist()}
    return {
        "version": __version__,
        "benchmark": benchmark_of(questions.config),
        "task": config.task_name,
        "target": None if config.targetnav is None else "visible" if config.targetnav.visible else "invisible",
        "agent": agent.name,
        "actions": agent.actions,
        "seed": seed,
        "split": questions.name,
        "episodes_hash": questions.hash,
        "scenes": {name: scene.hash[:16] for name, scene in zip(world.scene_ids, world.scenes, strict=True)},
        "sliding": config.sim.sliding,
        "body": body,
        "design": sensors if config.vision else None,
        "navmeshes": navmesh_origins(questions.source),
        "checkpoint": facts,
        "rules": to_mapping(config.rules),
        "env": {key: settings[key] for key in kept if key in settings},
    }


def evaluate_navigation(
    questions: Questions,
    config: EnvConfig,
    directory: str | Path,
    *,
    agent: str | TrainedRun,
    actions: ActionChoice = "sampled",
    seed: int = 0,
    num_envs: int = 64,
    workers: int = 1,
    device: str = "cpu",
    restart: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Evaluation:
    """Play every episode once and leave records, trajectories and floor plans in ``directory``.

    Args:
        questions: the episodes.
        config: the environment; reference agents see nothing, whatever it says.
        directory: the evaluation's folder. One that was interrupted goes on; a finished one is made anew.
        agent: name of a reference agent, or a trained run.
        actions: how a trained agent chooses.
        seed: of sampled actions.
        num_envs: how many episodes are played at once; the result does not depend on it.
        workers: processes that share the work; the result does not depend on it. More than one needs a main module
            that can be imported, as commands and tests have.
        device: where a trained policy runs.
        restart: forget what an interrupted evaluation left.
        progress: called with episodes done and in all.

    Raises:
        ConfigError: the agent cannot do this task.
    """
    facts = {} if isinstance(agent, str) else agent.facts
    if not isinstance(agent, str) and agent.config.task != config.task_name:
        raise ConfigError(f"run {agent.name} is for {agent.config.task} and cannot be evaluated on {config.task_name}")
    config = dataclasses.replace(config, vision=config.vision and not isinstance(agent, str))
    player = Player(config, agent, actions, num_envs, device)
    source = questions.source
    slots, one = player.build(source, num_envs)
    header = describe(questions, slots, one, seed, facts)
    with RecordWriter(directory, header, restart) as writer:
        todo = [index for index, episode in enumerate(source.ids) if episode not in writer.rows]
        done = len(source) - len(todo)
        progress(done, len(source))

        def keep(played: Played) -> None:
            nonlocal done
            places = {"start": source.starts[played.index].tolist(), "goal": source.goals[played.index].tolist()}
            writer.add(dataclasses.replace(played, row={**played.row, **places}))
            done += 1
            progress(done, len(source))

        workers = max(1, min(workers, len(todo) // EPISODES_PER_WORKER))
        if workers > 1:
            play_in_processes(player, questions, todo, seed, workers, keep)
        else:
            play_episodes(slots, one, todo, seed, keep)
        measures = {
            key: dataclasses.asdict(interval) for key, interval in summarise(writer.all_rows(source.ids)).items()
        }
        save_maps(directory, floor_plans(source))
        finished = writer.finish(source.ids, {"measures": measures})
    record_sights(finished, slots)
    return finished


def navmesh_origins(source: EpisodeSource) -> dict[str, str]:
    """Where the navmesh of each scene is from: "built", or "file NAME"."""
    return dict(zip(source.world.scene_ids, source.world.navmesh_origins, strict=False))


def floor_plans(source: EpisodeSource, metres_per_pixel: float = 0.05) -> list[FloorMap]:
    """Floor plans of the scenes that have episodes."""
    scenes = []
    for index, (scene_id, navmesh) in enumerate(zip(source.world.scene_ids, source.world.navmeshes, strict=True)):
        here = source.scene_index == index
        if here.any():
            scenes.append((scene_id, navmesh, np.concatenate([source.starts[here, 1], source.goals[here, 1]])))
    return make_maps(scenes, metres_per_pixel)
