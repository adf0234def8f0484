"""Evaluating an agent on a task: which episodes, in which world, by whom, into which folder."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from prnav.catalog import task_spec
from prnav.contracts import Agent, EpisodeSlots, Evaluation, Header, Played, Progress, TaskConfig, TaskSpec, World
from prnav.errors import ConfigError
from prnav.evaluate.records import RecordWriter, load_traces
from prnav.evaluate.summary import summarise
from prnav.evaluate.workers import play_in_processes
from prnav.play import TraceRecorder, play
from prnav.version import __version__

if TYPE_CHECKING:
    from prnav.evaluate.learned import TrainedRun

ActionChoice = Literal["greedy", "sampled"]

EPISODES_PER_WORKER = 24
"""Fewer episodes than this are not worth another process."""


@dataclass(frozen=True, eq=False)
class Questions:
    """The episodes that are evaluated, with their world."""

    task: str
    config: TaskConfig
    world: World
    limit: int | None = None
    """With ``task`` and ``config``, what was asked for: workers load the same."""

    @property
    def spec(self) -> TaskSpec:
        """The task."""
        return task_spec(self.task)


@dataclass(frozen=True, eq=False)
class Player:
    """Who plays and how: enough to build slots and agent in any process."""

    task: str
    config: TaskConfig
    agent: str | TrainedRun
    actions: ActionChoice
    num_envs: int
    device: str

    def build(self, world: World, num_slots: int) -> tuple[EpisodeSlots, Agent]:
        """Slots over a world, and the agent for them."""
        spec = task_spec(self.task)
        slots = spec.make_slots(self.config, world, num_slots)
        if isinstance(self.agent, str):
            return slots, spec.evaluation.agent(self.agent, self.config, slots)
        from prnav.play.policy_agent import PolicyAgent

        policy = self.agent.build().eval()
        return slots, PolicyAgent(policy, self.agent.name, self.actions, slots.num_slots, self.device)


def load_questions(
    spec: TaskSpec, config: TaskConfig, limit: int | None = None, progress: Progress | None = None
) -> Questions:
    """Episodes of a task's config and the world they need, at most ``limit`` of them.

    Raises:
        PrnavError: something is missing or broken.
    """
    return Questions(spec.name, config, spec.load(config, progress, limit), limit)


def describe(
    questions: Questions, config: TaskConfig, slots: EpisodeSlots, agent: Agent, seed: int, facts: Header
) -> Header:
    """What an evaluation's result depends on, as the head of its records; no path of this machine is in it."""
    return {
        "version": __version__,
        "agent": agent.name,
        "actions": agent.actions,
        "seed": seed,
        "checkpoint": facts,
        **questions.spec.evaluation.header(config, questions.world, slots),
    }


def evaluate(
    questions: Questions,
    config: TaskConfig,
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
    """Play every episode once and leave records, traces and what pictures need in ``directory``.

    Args:
        questions: the episodes.
        config: the task's settings; reference agents see nothing, whatever it says.
        directory: the evaluation's folder. An interrupted one is resumed; a finished one is made anew.
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
    spec, world = questions.spec, questions.world
    facts = {} if isinstance(agent, str) else agent.facts
    if not isinstance(agent, str) and agent.config.task != questions.task:
        raise ConfigError(f"run {agent.name} is for {agent.config.task} and cannot be evaluated on {questions.task}")
    if isinstance(agent, str):
        config = spec.blind(config)
    player = Player(questions.task, config, agent, actions, num_envs, device)
    slots, one = player.build(world, num_envs)
    ids = list(slots.episode_ids)
    header = describe(questions, config, slots, one, seed, facts)
    with RecordWriter(directory, header, restart) as writer:
        todo = [index for index, episode in enumerate(ids) if episode not in writer.rows]
        done = len(ids) - len(todo)
        progress(done, len(ids))

        def keep(played: Played) -> None:
            nonlocal done
            places = spec.evaluation.places(world, played.index)
            writer.add(dataclasses.replace(played, row={**played.row, **places}))
            done += 1
            progress(done, len(ids))

        workers = max(1, min(workers, len(todo) // EPISODES_PER_WORKER))
        if workers > 1:
            play_in_processes(player, questions, todo, seed, workers, keep)
        else:
            play(one, slots, todo, seed, [TraceRecorder(keep)])
        measures = {key: dataclasses.asdict(interval) for key, interval in summarise(writer.all_rows(ids)).items()}
        finished = writer.finish(ids, {"measures": measures})
        spec.evaluation.keep(finished, load_traces(finished), world, slots)
    return finished
