"""Evaluating an agent on PointGoalNav: which episodes, in which world, by whom, into which folder."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import prnav
from prnav.config import to_mapping
from prnav.env.config import EnvConfig
from prnav.env.episode_table import EpisodeTable, configured_episodes, episode_table
from prnav.env.pointgoal_slots import PointGoalSlots
from prnav.episodes import Episode, EpisodeDataset
from prnav.episodes.builtin import check_scenes, up_axis
from prnav.errors import EpisodeError
from prnav.evaluate.agents import Agent, reference_agent
from prnav.evaluate.evaluator import Played, play_episodes
from prnav.evaluate.maps import heights_by_scene, make_maps, save_maps
from prnav.evaluate.records import Evaluation, RecordWriter
from prnav.evaluate.summary import summarise
from prnav.sim.world import Progress, load_world

if TYPE_CHECKING:
    from prnav.evaluate.learned import ActionChoice, TrainedRun


@dataclass(frozen=True, eq=False)
class Questions:
    """The episodes that are evaluated, with their world."""

    name: str
    """Split or file they come from."""
    table: EpisodeTable
    hash: str
    """First 16 hex digits of a SHA-256 over scenes, starts and goals."""


def load_questions(
    config: EnvConfig, limit: int | None, up: str | None = None, progress: Progress | None = None
) -> Questions:
    """Episodes that a config names, ``limit`` of them at most, and the scenes that these need.

    Args:
        config: the environment's.
        limit: at most so many, dealt evenly over the scenes: the first of each scene, then the second of each.
        up: up axis of mesh files; None takes what the episodes' header says, else the config's.
        progress: called while scenes load.

    Raises:
        EpisodeError: the episodes cannot be read, there are none, or they belong to other scenes than these.
        SceneError: a scene is missing or broken.
        NavMeshError: a scene has no floor.
    """
    name = config.scenes if config.episodes is None else Path(config.episodes).name
    dataset = configured_episodes(config, progress)
    episodes = spread(dataset.episodes, limit)
    if not episodes:
        raise EpisodeError(f"{name}: there are no episodes to evaluate; generate some with prnav-episodes generate")
    world = load_world(
        EpisodeDataset(tuple(episodes)).scene_ids,
        data_root=None if config.data_root is None else Path(config.data_root),
        scene_files=[Path(file) for file in config.scene_files],
        up=up or up_axis(dataset.header, config.up, name),
        settings=config.navmesh,
        progress=progress,
    )
    check_scenes(dataset.header, dict(zip(world.scene_ids, world.scenes, strict=True)), name)
    return Questions(name, episode_table(world, episodes), hash_episodes(episodes))


def spread(episodes: Sequence[Episode], limit: int | None) -> list[Episode]:
    """At most ``limit`` episodes, as many from each scene as from any other give or take one, in their old order."""
    if limit is None or limit >= len(episodes):
        return list(episodes)
    seen: dict[str, int] = {}
    places = []
    for index, episode in enumerate(episodes):
        turn = seen.get(episode.scene_id, 0)
        seen[episode.scene_id] = turn + 1
        places.append((turn, index))
    return [episodes[index] for index in sorted(index for _, index in sorted(places)[:limit])]


def hash_episodes(episodes: Sequence[Episode]) -> str:
    """First 16 hex digits of a SHA-256 over ids, starts and goals in order."""
    rows = [
        (e.scene_id, e.episode_id, e.start_position, e.start_rotation, [goal.position for goal in e.goals])
        for e in episodes
    ]
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()[:16]


def describe(questions: Questions, config: EnvConfig, agent: Agent, seed: int, facts: dict[str, Any]) -> dict[str, Any]:
    """What an evaluation's result depends on, as the head of its records; no path of this machine is in it."""
    kept = ("design", "grid", "rays_per_receptor", "engine", "vision", "sim", "task", "navmesh")
    settings = to_mapping(config)
    return {
        "prnav": prnav.__version__,
        "task": "pointgoal",
        "agent": agent.name,
        "actions": agent.actions,
        "seed": seed,
        "split": questions.name,
        "episodes_hash": questions.hash,
        "trained": facts,
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
    table = questions.table
    slots = PointGoalSlots(table, min(num_envs, len(table)), config)
    player, facts = _player(agent, actions, slots, config, device)
    header = describe(questions, config, player, seed, facts)
    with RecordWriter(directory, header, restart) as writer:
        todo = [index for index, episode in enumerate(table.ids) if episode not in writer.rows]
        done = len(table) - len(todo)
        progress(done, len(table))

        def keep(played: Played) -> None:
            nonlocal done
            places = {"start": table.starts[played.index].tolist(), "goal": table.goals[played.index].tolist()}
            writer.add(dataclasses.replace(played, row={**played.row, **places}))
            done += 1
            progress(done, len(table))

        play_episodes(slots, player, todo, seed, keep)
        measures = {
            key: dataclasses.asdict(interval) for key, interval in summarise(writer.all_rows(table.ids)).items()
        }
        save_maps(directory, floor_plans(table))
        return writer.finish(table.ids, {"measures": measures})


def floor_plans(table: EpisodeTable, metres_per_pixel: float = 0.05) -> list[Any]:
    """Floor plans of all scenes of a table."""
    rows = [(scene, start, goal) for (scene, _), start, goal in zip(table.ids, table.starts, table.goals, strict=True)]
    heights = heights_by_scene(rows)
    navmeshes = {scene: table.world.navmeshes[table.world.index[scene]] for scene in heights}
    return make_maps(((scene, navmeshes[scene], np.array(heights[scene])) for scene in heights), metres_per_pixel)


def _player(
    agent: str | TrainedRun, actions: ActionChoice, slots: PointGoalSlots, config: EnvConfig, device: str
) -> tuple[Agent, dict[str, Any]]:
    if isinstance(agent, str):
        return reference_agent(agent, slots.expert_actions, config.task.success_distance), {}
    from prnav.evaluate.learned import PolicyAgent

    return PolicyAgent(agent.policy, agent.name, actions, slots.num_slots, device), agent.facts
