"""Searches that know nothing of gradients: the baselines that the joint method is measured against.

Random search, CMA-ES, TPE and a Gaussian process run through Optuna, one trial per design, in a storage that workers
on several machines can share; successive halving is our own. All of them search the free coordinates of a design
within a box around the initial one, which is always tried first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from prnav.aliases import JSON, Untyped
from prnav.design.claims import TrialClaims
from prnav.errors import ConfigError
from prnav.sensors import AXES, Design, with_free_values

Float64 = NDArray[np.float64]
C = TypeVar("C")

SAMPLERS = ("random", "cmaes", "tpe", "gp")


@dataclass(frozen=True)
class SearchConfig:
    """How far and how long to search."""

    trials: int = 60
    """Designs tried, the initial one included."""
    bound: float = 0.6
    """Half the side of the searched box, in normalised units. CMA-ES starts with a third of it as standard deviation:
    the paper's 0.2."""
    halving: int = 3
    """Successive halving keeps one of so many designs at each rung, and gives it so many times the steps."""
    first_steps: int = 20_000
    """Steps of a design on the first rung of successive halving."""

    def __post_init__(self) -> None:
        if self.trials < 1 or self.first_steps < 1:
            raise ValueError(f"trials is {self.trials}, first_steps {self.first_steps}; both must be at least 1")
        if self.halving < 2:
            raise ValueError(f"halving is {self.halving}; it must be at least 2")
        if not self.bound > 0.0:
            raise ValueError(f"bound is {self.bound}; it must be positive")


@dataclass(frozen=True, eq=False)
class Trial:
    """A design that was tried."""

    number: int
    values: Float64
    """Its free coordinates, (n,)."""
    score: float


def coordinate_names(design: Design) -> list[str]:
    """Names of the free coordinates, (n,): "0.yaw" is sensor 0's."""
    return [f"{sensor}.{AXES[axis]}" for sensor, axis in np.argwhere(design.free)]


def search(
    method: Literal["random", "cmaes", "tpe", "gp"],
    design: Design,
    score: Callable[[Float64], float],
    config: SearchConfig,
    storage: str | Path,
    seed: int = 0,
    name: str = "design",
    report: Callable[[Trial, Trial], None] = lambda trial, best: None,
) -> list[Trial]:
    """Trials of a study, all there are when ``config.trials`` of them are finished.

    A study resumes from what its storage holds, and other processes may work on it at the same time. What a trial tries
    depends on the seed, its number and the trials finished before it, not on who asks. The initial design is always
    among the finished ones, also if the process that was to score it is gone.

    Args:
        method: how designs are proposed.
        design: the initial design.
        score: of theta (K, 7); more is better.
        config: how far and how long.
        storage: a file of the study, or the address of a database ("mysql://...", "sqlite:///...").
        seed: of the proposals; the same for all workers on a study.
        name: of the study in its storage.
        report: called with each trial and the best so far.

    Raises:
        ConfigError: Optuna is not installed, or the storage cannot be used.
    """
    optuna = _optuna()
    names = coordinate_names(design)
    if not names:
        raise ConfigError(f"design {design.name}: all its axes are frozen; there is nothing to search")
    store = _storage(optuna, storage)
    study = optuna.create_study(
        study_name=name,
        storage=store,
        direction="maximize",
        load_if_exists=True,
        sampler=_sampler(optuna, method, seed),
    )
    space = {key: optuna.distributions.FloatDistribution(-config.bound, config.bound) for key in names}
    claims = None if "://" in str(storage) else TrialClaims(Path(f"{storage}.claims"))
    try:
        while True:
            with nullcontext() if claims is None else claims.alone():
                if not study.get_trials(deepcopy=False):
                    study.enqueue_trial(dict.fromkeys(names, 0.0))
                done = _finished(optuna, study, names)
                trial = _abandoned(optuna, study, space, claims)
                if trial is None:
                    if len(done) >= config.trials:
                        if any(not one.values.any() for one in done):
                            return done
                        study.enqueue_trial(dict.fromkeys(names, 0.0))
                    trial = study.ask(space)
                    if claims is not None:
                        claims.take(trial.number)
            values = np.array([trial.params[key] for key in names])
            value = score(with_free_values(values, design))
            if not math.isfinite(value):
                study.tell(trial, state=optuna.trial.TrialState.FAIL)
                raise ConfigError(
                    f"study {name}: design {trial.number} has the score {value}; it must be a finite number"
                )
            study.tell(trial, value)
            if claims is not None:
                claims.let_go(trial.number)
            done = _finished(optuna, study, names)
            report(next(one for one in done if one.number == trial.number), best_of(done))
    finally:
        if claims is not None:
            claims.close()


def _abandoned(optuna: Untyped, study: Untyped, space: Mapping[str, JSON], claims: TrialClaims | None) -> Untyped:
    """The first trial that was begun and is held by no worker, claimed and with its values; None where there is none.

    What a trial tries is asked again by its number, and so the same: a search that was killed resumes as if it had not
    been. Who works on the trials of a database is not known here; there they stay unfinished.
    """
    if claims is None:
        return None
    for frozen in study.get_trials(deepcopy=False, states=(optuna.trial.TrialState.RUNNING,)):
        if claims.take(frozen.number):
            if study.get_trials(deepcopy=False)[frozen.number].state != optuna.trial.TrialState.RUNNING:
                claims.let_go(frozen.number)  # its holder was done in between
                continue
            trial = optuna.trial.Trial(study, frozen._trial_id)
            for key, distribution in space.items():
                trial.suggest_float(key, distribution.low, distribution.high)
            return trial
    return None


def initial_of(trials: Sequence[Trial]) -> Trial:
    """The trial of the initial design."""
    return next(trial for trial in trials if not trial.values.any())


def best_of(trials: Sequence[Trial]) -> Trial:
    """The trial with the highest score; the earliest of equals."""
    return max(trials, key=lambda trial: (trial.score, -trial.number))


def successive_halving(
    candidates: Sequence[C],
    score: Callable[[C, int], float],
    first_steps: int,
    factor: int = 3,
    report: Callable[[int, C, float], None] = lambda steps, candidate, value: None,
) -> tuple[C, list[tuple[int, float]]]:
    """The candidate that survives: all get ``first_steps``, the best of ``factor`` get ``factor`` times as many.

    Jamieson and Talwalkar 2016. A candidate that continues is trained further, not anew: ``score(candidate, steps)`` is
    given its steps in all.

    Returns:
        The survivor, and (steps, its score) at each rung.
    """
    left, steps, way = list(candidates), first_steps, []
    while True:
        scored = []
        for candidate in left:
            value = score(candidate, steps)
            report(steps, candidate, value)
            scored.append(value)
        order = sorted(range(len(left)), key=lambda i: (-scored[i], i))
        way.append((steps, scored[order[0]]))
        if len(left) == 1:
            return left[0], way
        left = [left[i] for i in order[: max(1, len(left) // factor)]]
        steps *= factor


def halving_candidates(budget: int, first_steps: int, factor: int) -> int:
    """How many designs successive halving can start with, so that all rungs together cost at most ``budget`` steps."""
    count = 1
    while halving_cost(count + 1, first_steps, factor) <= budget:
        count += 1
    return count


def halving_cost(count: int, first_steps: int, factor: int) -> int:
    """Steps of successive halving over ``count`` designs; those of one that continues are counted once."""
    total, steps, before = 0, first_steps, 0
    while True:
        total += count * (steps - before)
        if count == 1:
            return total
        count, before, steps = max(1, count // factor), steps, steps * factor


def random_values(design: Design, count: int, bound: float, seed: int) -> Float64:
    """Free coordinates (count, n) even over the box; the first are the initial design's, all 0."""
    values = np.random.Generator(np.random.PCG64(seed)).uniform(-bound, bound, (count, int(design.free.sum())))
    values[0] = 0.0
    return values


def _optuna() -> Untyped:
    try:
        import optuna
    except ImportError as error:
        raise ConfigError(f"searching needs Optuna ({error}); install it with: pip install 'prnav[search]'") from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def _storage(optuna: Untyped, storage: str | Path) -> Untyped:
    from sqlalchemy.exc import SQLAlchemyError

    text = str(storage)
    try:
        if "://" in text:
            return optuna.storages.RDBStorage(text)
        Path(text).parent.mkdir(parents=True, exist_ok=True)
        return optuna.storages.JournalStorage(optuna.storages.journal.JournalFileBackend(text))
    except (ImportError, OSError, ValueError, SQLAlchemyError) as error:
        raise ConfigError(
            f"storage {text}: cannot be used ({' '.join(str(error).split())}); give a file, or the address of a "
            f"database whose driver is installed"
        ) from error


def _sampler(optuna: Untyped, method: str, seed: int) -> Untyped:
    """A sampler whose random numbers belong to the trial: two machines, or a resumed search, repeat none of them."""
    _sampler_of(optuna, method, seed)  # a wrong method is an error now

    class OfTrial(optuna.samplers.BaseSampler):  # type: ignore[misc]  # imported when needed
        def before_trial(self, study: Untyped, trial: Untyped) -> None:
            self.own = _sampler_of(optuna, method, seed_of(seed, trial.number))
            self.own.before_trial(study, trial)

        def infer_relative_search_space(self, study: Untyped, trial: Untyped) -> Untyped:
            return self.own.infer_relative_search_space(study, trial)

        def sample_relative(self, study: Untyped, trial: Untyped, search_space: Untyped) -> Untyped:
            return self.own.sample_relative(study, trial, search_space)

        def sample_independent(self, study: Untyped, trial: Untyped, name: str, distribution: Untyped) -> Untyped:
            return self.own.sample_independent(study, trial, name, distribution)

    return OfTrial()


def seed_of(seed: int, number: int) -> int:
    """Seed of a trial, below 2^32."""
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0])


def _sampler_of(optuna: Untyped, method: str, seed: int) -> Untyped:
    samplers = optuna.samplers
    if method == "random":
        return samplers.RandomSampler(seed=seed)
    if method == "tpe":
        return samplers.TPESampler(seed=seed)
    if method == "gp":
        return samplers.GPSampler(seed=seed)
    if method == "cmaes":
        _need_cmaes()
        return samplers.CmaEsSampler(seed=seed)  # from the middle of the box, with a sixth of its side
    raise ConfigError(f"method {method!r} is not a search; valid: {', '.join(SAMPLERS)}")


def _need_cmaes() -> None:
    try:
        import cmaes  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            f"method 'cmaes' needs cmaes ({error}); install it with: pip install 'prnav[search]'"
        ) from error


def _finished(optuna: Untyped, study: Untyped, names: list[str]) -> list[Trial]:
    complete = (optuna.trial.TrialState.COMPLETE,)
    return [
        Trial(trial.number, np.array([trial.params[key] for key in names]), float(trial.value))
        for trial in study.get_trials(deepcopy=False, states=complete)
        if math.isfinite(trial.value)
    ]
