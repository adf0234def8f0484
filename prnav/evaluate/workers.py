"""Several processes that share an evaluation's episodes; which of them plays what changes no result.

Each loads the world from the cache and builds its own slots and agent. The next episode is whatever a shared counter
says, so that nobody waits for a fixed share to end; finished episodes come back through a queue to the one writer.
"""

from __future__ import annotations

import multiprocessing
import queue
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.queues import Queue
from typing import TYPE_CHECKING

from prnav.aliases import Untyped
from prnav.catalog import task_spec
from prnav.contracts import Played, TaskConfig
from prnav.errors import PrnavError
from prnav.play import TraceRecorder, play
from prnav.processes import deaf_children, end_processes, worker_process

if TYPE_CHECKING:
    from prnav.evaluate.evaluation import Player, Questions

PATIENCE = 1.0
"""How long to wait for an episode before looking whether the workers still live [s]."""


def play_in_processes(
    player: Player,
    questions: Questions,
    todo: Sequence[int],
    seed: int,
    workers: int,
    on_played: Callable[[Played], None],
) -> None:
    """Play each of ``todo`` once, as :func:`prnav.play.play` does, in ``workers`` processes.

    Raises:
        PrnavError: what a worker met, or that one died.
    """
    context = multiprocessing.get_context("spawn")
    counter = context.Value("q", 0)
    answers: Queue[Untyped] = context.Queue()
    asked = (questions.task, questions.config, questions.limit)
    slots = -(-player.num_envs // workers)
    arguments = (player, asked, list(todo), seed, slots, counter, answers)
    processes = [worker_process(context, _work, *arguments) for _ in range(workers)]
    try:
        with deaf_children():
            for process in processes:
                process.start()
        left = len(todo)
        while left:
            try:
                answer = answers.get(timeout=PATIENCE)
            except queue.Empty:
                dead = [process.exitcode for process in processes if process.exitcode]
                if dead:
                    raise PrnavError(
                        f"a worker process of the evaluation ended with status {dead[0]}; what is done is kept: give "
                        f"the same command again, with --workers 1 if it happens again"
                    ) from None
                continue
            if isinstance(answer, PrnavError):
                raise answer
            on_played(answer)
            left -= 1
    finally:
        end_processes(processes)
        answers.close()


def _work(
    player: Player,
    asked: tuple[str, TaskConfig, int | None],
    todo: Sequence[int],
    seed: int,
    num_slots: int,
    counter: Untyped,
    answers: Queue[Untyped],
) -> None:
    """Play until no episode is left."""
    try:
        name, config, limit = asked
        slots, agent = player.build(task_spec(name).load(config, limit=limit), num_slots)
        play(agent, slots, _next(todo, counter), seed, [TraceRecorder(answers.put)])
    except PrnavError as error:
        answers.put(error)
    answers.close()
    answers.join_thread()


def _next(todo: Sequence[int], counter: Untyped) -> Iterator[int]:
    """Episodes that no other worker has taken."""
    while True:
        with counter.get_lock():
            place = counter.value
            counter.value += 1
        if place >= len(todo):
            return
        yield todo[place]
