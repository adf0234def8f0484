"""Evaluating an agent on PointGoalNav: which episodes, in which world, by whom, into which folder."""

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
from prnav.env.config import EnvConfig
from prnav.env.episode_source import EpisodeSource, load_source
from prnav.env.pointgoal_slots import PointGoalSlots
from prnav.evaluate.agents import Agent, reference_agent
from prnav.evaluate.evaluator import Played, play_episodes
from prnav.evaluate.maps import FloorMap, make_maps, save_maps
from prnav.evaluate.records import Evaluation, RecordWriter
from prnav.evaluate.summary import summarise
from prnav.sim.world import Progress
from prnav.version import __version__

if TYPE_CHECKING:
    from prnav.evaluate.learned import ActionChoice, TrainedRun


@dataclass(frozen=True, eq=False)
class Questions:
    """The episodes that are evaluated, with their world."""

    name: str
    """Split or file they come from."""
    source: EpisodeSource

    @cached_property
    def hash(self) -> str:
        """First 16 hex digits of a SHA-256 over ids, starts and goals in order."""
        source = self.source
        places = hash_arrays({"starts": source.starts, "yaws": source.yaws, "goals": source.goals})
        return cache_key(source.ids, places)[:16]


def load_questions(
    config: EnvConfig, limit: int | None = None, up: str | None = None, progress: Progress | None = None
) -> Questions:
    """Episodes that a config names and the scenes they need; arguments as :func:`prnav.env.load_source`.

    Raises:
        EpisodeError: the episodes cannot be read, there are none, or they belong to other scenes than these.
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor.
    """
    name = config.scenes if config.episodes is None else Path(config.episodes).name
    if config.data is not None:
        name = f"{config.data}-{name if config.episodes is not None else config.episode_split or config.scenes}"
    return Questions(name, load_source(config, progress, limit=limit, up=up))


def describe(questions: Questions, config: EnvConfig, agent: Agent, seed: int, facts: dict[str, Any]) -> dict[str, Any]:
    """What an evaluation's result depends on, as the head of its records; no path of this machine is in it."""
    kept = ("design", "grid", "rays_per_receptor", "engine", "vision", "sim", "task", "navmesh")
    settings = to_mapping(config)
    return {
        "version": __version__,
        "task": "pointgoal",
        "agent": agent.name,
        "actions": agent.actions,
        "seed": seed,
        "split": questions.name,
        "episodes_hash": questions.hash,
        "navmeshes": navmesh_origins(questions.source),
        "checkpoint": facts,
        "env": {key: settings[key] for key in kept if key in settings},
    }


def evaluate_pointgoal(
    questions: Questions,
    config: EnvConfig,
    directory: str | Path,
    *,
    agent: str | TrainedRun,
    actions: ActionChoice = "greedy",
    seed: int = 0,
    num_envs: int = 64,
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
        device: where a trained policy runs.
        restart: forget what an interrupted evaluation left.
        progress: called with episodes done and in all.
    """
    trained = not isinstance(agent, str)
    if not trained:
        config = dataclasses.replace(config, vision=False)
    source = questions.source
    slots = PointGoalSlots(source, min(num_envs, len(source)), config)
    player, facts = _player(agent, actions, slots, config, device)
    header = describe(questions, config, player, seed, facts)
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

        play_episodes(slots, player, todo, seed, keep)
        measures = {
            key: dataclasses.asdict(interval) for key, interval in summarise(writer.all_rows(source.ids)).items()
        }
        save_maps(directory, floor_plans(source))
        return writer.finish(source.ids, {"measures": measures})


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


def _player(
    agent: str | TrainedRun, actions: ActionChoice, slots: PointGoalSlots, config: EnvConfig, device: str
) -> tuple[Agent, dict[str, Any]]:
    if isinstance(agent, str):
        return reference_agent(agent, slots.expert_actions, config.task.success_distance), {}
    from prnav.evaluate.learned import PolicyAgent

    return PolicyAgent(agent.policy, agent.name, actions, slots.num_slots, device), agent.facts
