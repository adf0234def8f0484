"""Joint optimisation as a search: design and control are trained together, and the design policy's mean is found."""

from __future__ import annotations

import numpy as np

from prnav.design.designed_envs import DesignableEnvs
from prnav.design.joint import JointTrainer
from prnav.design.methods import Search, SearchFacts, SearchMethod
from prnav.design.specialist import ResultRow, mean_of, row_of, specialist_config
from prnav.errors import ConfigError
from prnav.sensors import Design, load_design, save_design
from prnav.train import MetricsRow, RunFolder


def joint(search: Search, initial: Design, number: int) -> tuple[Design, SearchFacts]:
    """The mean of the design policy, and how its generalist does there and at the initial design."""
    config, place = search.config, search.place(number)
    total = config.train.total_steps
    train = specialist_config(config.train, initial, place / "joint", total, config.seed + number)
    save_design(initial, place / "joint" / "design.toml")
    base = load_design(place / "joint" / "design.toml")

    def report(row: MetricsRow) -> None:
        losses = row["losses"]
        text = f"start {number}: {row['phase']}"
        text += "".join(
            f"  {name} {row['measures'][name]:.3f}" for name in ("success", "soft_spl") if name in row["measures"]
        )
        text += f"  design moved {losses['design_moved']:.2f}" if "design_moved" in losses else ""
        search.say("joint", row["step"], total, text)

    envs = train.spec.make_envs(train.env, search.judge.training(), train.num_envs)
    if not isinstance(envs, DesignableEnvs):
        raise ConfigError(f"task {train.task!r} has no sensors whose design can be set; take one that has receptors")
    trainer = JointTrainer(train, config.joint, envs, base, RunFolder(place / "joint"), report, search.warn)
    try:
        trainer.begin()
        if trainer.train() is not None:
            raise KeyboardInterrupt
        found, theta = trainer.best_design(f"{initial.name}-joint"), trainer.theta
    finally:
        trainer.close()
    rows: list[ResultRow] = []
    scores: list[float] = []
    for which, at in (("initial", np.zeros_like(theta)), ("optimised", theta)):
        measures = search.judge.judge(trainer.policy.eval(), base, at, train.env)
        scores.append(mean_of(measures, config.measure))
        design = found if which == "optimised" else base
        rows.append(row_of(design, measures, group=f"generalist, {which} {number}", seed=train.seed, steps=total))
    return found, {"initial": scores[0], "found": scores[1], "trials": 0, "steps": total, "rows": rows}


JOINT = SearchMethod(joint, scored_by="generalist")
