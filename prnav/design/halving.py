"""Successive halving as a search: many specialists begin, and only the better ones are trained further."""

from __future__ import annotations

from prnav.design import search as searching
from prnav.design.methods import Search, SearchFacts, SearchMethod
from prnav.design.specialist import mean_of
from prnav.sensors import Design, moved_design, with_free_values


def halving(search: Search, initial: Design, number: int) -> tuple[Design, SearchFacts]:
    """The design whose specialist survives; as many designs begin as the budget allows."""
    config, settings = search.config, search.config.search
    budget = config.budget or settings.trials * config.specialist.steps
    count = searching.halving_candidates(budget, settings.first_steps, settings.halving)
    values = searching.random_values(initial, count, settings.bound, config.seed + number)
    designs = [
        moved_design(initial, with_free_values(row, initial), f"{initial.name}-halving-{i}")
        for i, row in enumerate(values)
    ]
    first: dict[int, float] = {}

    def score(index: int, steps: int) -> float:
        folder = search.place(number) / "trials" / str(index)
        measures = search.judge.specialist(designs[index], folder, steps, warm_for=settings.first_steps)
        value = mean_of(measures, config.measure)
        return first.setdefault(index, value) if steps == settings.first_steps else value

    def report(steps: int, index: int, value: float) -> None:
        search.say("search", index + 1, count, f"start {number}: design {index} {value:.4f} after {steps:,} steps")

    best, way = searching.successive_halving(range(count), score, settings.first_steps, settings.halving, report)
    return designs[best], {
        "initial": first[0],
        "found": way[-1][1],
        "trials": count,
        "steps": searching.halving_cost(count, settings.first_steps, settings.halving),
        "scores": list(first.values()),
    }


HALVING = SearchMethod(halving, scored_by="specialist")
