"""Searches that propose one design after the other and share what they found: random, CMA-ES, TPE, Gaussian process."""

from __future__ import annotations

from functools import partial
from typing import Literal

from prnav.config import config_hash
from prnav.design import search as searching
from prnav.design.methods import Search, SearchFacts, SearchMethod
from prnav.sensors import Design, moved_design, with_free_values


def study(
    search: Search, initial: Design, number: int, sampler: Literal["random", "cmaes", "tpe", "gp"]
) -> tuple[Design, SearchFacts]:
    """The best design of a study, whose storage other processes may share."""
    config = search.config
    settings = searching.SearchConfig(config.trials, config.search.bound)

    def report(trial: searching.Trial, best: searching.Trial) -> None:
        text = f"start {number}: design {trial.number} {trial.score:.4f}, best {best.score:.4f} (design {best.number})"
        search.say("search", trial.number + 1, config.trials, text)

    trials = searching.search(
        sampler,
        initial,
        lambda theta: search.score(initial, theta, number),
        settings,
        search.storage or search.place(number) / "study.log",
        config.seed + number,
        f"{config.name}-{config.method}-{config_hash(config)[:8]}-{number}",  # one database may hold many searches
        report,
    )
    best = searching.best_of(trials)
    name = f"{initial.name}-{config.method}"
    text = f"Found from {initial.name} by {config.method} search, {len(trials)} designs scored by the {config.score}."
    found = moved_design(initial, with_free_values(best.values, initial), name, text)
    return found, {
        "initial": searching.initial_of(trials).score,
        "found": best.score,
        "trials": len(trials),
        "steps": config.cost_steps * len(trials),
        "scores": [trial.score for trial in trials],
    }


RANDOM = SearchMethod(partial(study, sampler="random"), shared=True)
CMAES = SearchMethod(partial(study, sampler="cmaes"), shared=True)
TPE = SearchMethod(partial(study, sampler="tpe"), shared=True)
GP = SearchMethod(partial(study, sampler="gp"), shared=True)
