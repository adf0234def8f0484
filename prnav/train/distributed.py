"""Several workers on one run: the only file that may import ``torch.distributed``.

``torchrun --nproc-per-node N -m prnav.train ...`` starts N workers of one run (DD-PPO, Wijmans et al. 2020). Each has
its own environments and collects its own rollouts; gradients are averaged, so that all take the same steps. Tensors of
gradients travel by gloo on CPUs and NCCL on GPUs. Everything else is a few bytes of JSON by gloo.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
from collections.abc import Callable, Iterator, Sequence
from datetime import timedelta
from typing import TypeVar

import torch
from torch import Tensor

from prnav.aliases import Untyped
from prnav.errors import ConfigError, WorkerError

PATIENCE = timedelta(minutes=10)
"""How long a worker waits for the others before it gives them up for lost."""

T = TypeVar("T")

_joined: list[Workers] = []
"""The workers that this process has joined, which it can do once."""


class Workers:
    """The workers that share a run; this one is number ``rank`` of ``size``. Alone, nothing is exchanged."""

    def __init__(self, rank: int = 0, size: int = 1, local_rank: int = 0, local_size: int = 1) -> None:
        self.rank, self.size = rank, size
        self.local_rank, self.local_size = local_rank, local_size
        """Number of this worker, and of all workers, on its machine."""
        self._rollouts = 0
        self._store: Untyped = None

    @property
    def first(self) -> bool:
        """Whether this worker writes the run's files."""
        return self.rank == 0

    def average(self, gradients: Sequence[Tensor], weight: float) -> Sequence[Tensor]:
        """Mean of each gradient over all workers, weighted by how many steps each stands for."""
        if self.size == 1:
            return gradients
        import torch.distributed as dist

        flat = torch.cat([gradient.flatten() for gradient in gradients] + [gradients[0].new_ones(1)]) * weight
        with self._together("averaging gradients"):
            dist.all_reduce(flat)
        sizes = [gradient.numel() for gradient in gradients]
        parts = (flat[:-1] / flat[-1]).split(sizes)
        return [part.view_as(gradient) for part, gradient in zip(parts, gradients, strict=True)]

    def sums(self, values: Tensor) -> Tensor:
        """Sum of ``values`` over all workers."""
        if self.size == 1:
            return values
        import torch.distributed as dist

        total = values.clone()
        with self._together("adding up"):
            dist.all_reduce(total)
        return total

    def gather(self, value: T) -> list[T]:
        """What every worker has to say, worker by worker: anything that JSON holds."""
        if self.size == 1:
            return [value]
        import torch.distributed as dist

        data = torch.frombuffer(bytearray(json.dumps(value).encode()), dtype=torch.uint8)
        length = torch.tensor([len(data)])
        with self._together("exchanging results"):
            lengths = [torch.zeros_like(length) for _ in range(self.size)]
            dist.all_gather(lengths, length)
            longest = int(max(lengths))
            padded = torch.zeros(longest, dtype=torch.uint8)
            padded[: len(data)] = data
            texts = [torch.zeros_like(padded) for _ in range(self.size)]
            dist.all_gather(texts, padded)
        return [
            json.loads(bytes(text[: int(count)].tolist()).decode()) for text, count in zip(texts, lengths, strict=True)
        ]

    def on_first(self, work: Callable[[], T]) -> T:
        """Let worker 0 do something and tell all what came of it (anything that JSON holds).

        Raises:
            PrnavError: what ``work`` raised, on worker 0.
            WorkerError: the same on the others.
        """
        if self.size == 1:
            return work()
        result: Untyped = None
        if self.first:
            try:
                result = work()
            except Exception as error:
                self.gather({"error": " ".join(str(error).split())})
                raise
        answer = self.gather({"result": result})[0]
        if "error" in answer:
            raise WorkerError(f"worker {self.rank}: worker 0 gave up: {answer['error']}")
        shared: T = answer["result"]
        return shared

    def check_same(self, parameters: Sequence[Tensor], step: int) -> None:
        """Assert that all workers have the same parameters, to the bit.

        Raises:
            WorkerError: they do not.
        """
        if self.size == 1:
            return
        sums = self.gather(checksum(parameters))
        if len(set(sums)) > 1:
            raise WorkerError(
                f"workers have different parameters at step {step} (checksums {', '.join(map(str, sums))}); "
                f"start them with the same version and config, and resume from the last checkpoint"
            )

    def rollout_begins(self) -> None:
        """Begin to count who has finished collecting."""
        self._rollouts += 1

    def rollout_done(self) -> None:
        """Say that this worker has collected its rollout."""
        if self.size > 1:
            with self._together("counting finished rollouts"):
                self._store.add(f"rollout-{self._rollouts}", 1)

    def share_done(self) -> float:
        """Share of the workers that have collected their rollout."""
        with self._together("counting finished rollouts"):
            done: int = self._store.add(f"rollout-{self._rollouts}", 0)
        return done / self.size

    def leave(self) -> None:
        """Part from the other workers."""
        if self.size > 1:
            import torch.distributed as dist

            dist.destroy_process_group()
            self.size, self._store = 1, None
            _joined.clear()
            # gloo's threads end with the group's last object; one that ends with the interpreter aborts the process
            gc.collect()

    @contextlib.contextmanager
    def _together(self, doing: str) -> Iterator[None]:
        """Turn a broken connection into one line."""
        try:
            yield
        except RuntimeError as error:  # torch.distributed's errors are RuntimeErrors
            raise WorkerError(
                f"worker {self.rank} of {self.size}: another worker was lost while {doing} "
                f"({' '.join(str(error).split())[:160]}); the run stands at its last checkpoint: start the same "
                f"command with --resume"
            ) from error


def checksum(parameters: Sequence[Tensor]) -> int:
    """A number that differs when a bit of ``parameters`` does, all but surely."""
    total = 0
    for place, parameter in enumerate(parameters):
        bits = parameter.detach().contiguous().view(torch.int32).flatten().to(torch.int64)
        weights = torch.arange(1, len(bits) + 1, device=bits.device)
        total = (total * 31 + int((bits * (2 * weights + 1)).sum()) + place) % (1 << 61)
    return total


def join_workers() -> Workers:
    """The workers that the launcher started, or a single one.

    Raises:
        ConfigError: the launcher's variables make no sense, or the others cannot be reached.
    """
    numbers = {}
    for name, default in (("RANK", 0), ("WORLD_SIZE", 1), ("LOCAL_RANK", 0), ("LOCAL_WORLD_SIZE", 1)):
        text = os.environ.get(name, str(default))
        if not text.isdecimal():
            raise ConfigError(f"{name} is {text!r}; it must be a number, as torchrun sets it")
        numbers[name] = int(text)
    if numbers["WORLD_SIZE"] == 1:
        return Workers()
    if _joined:
        return _joined[0]
    import torch.distributed as dist

    workers = Workers(numbers["RANK"], numbers["WORLD_SIZE"], numbers["LOCAL_RANK"], numbers["LOCAL_WORLD_SIZE"])
    backend = "cpu:gloo,cuda:nccl" if torch.cuda.is_available() else "gloo"
    try:
        store, rank, size = next(dist.rendezvous("env://"))
        dist.init_process_group(backend, store=store, rank=rank, world_size=size, timeout=PATIENCE)
    except (ValueError, RuntimeError) as error:
        raise ConfigError(
            f"WORLD_SIZE is {workers.size}, but the workers cannot be joined ({' '.join(str(error).split())[:160]}); "
            f"start them with torchrun --nproc-per-node {workers.size} -m prnav.train ..."
        ) from error
    workers._store = dist.PrefixStore("prnav", store)
    _joined.append(workers)
    return workers
