"""Many specialists side by side: a plan in a folder, and workers that take jobs from it until none is left.

A job is held by a lock on its folder, which the system lets go of when a process dies: any number of processes, on any
machines that share the folder, can work on a plan, and a job that was cut off resumes from its last checkpoint.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from prnav.config import load_config, to_toml
from prnav.contracts import Progress
from prnav.design.config import OptimizeConfig
from prnav.design.specialist import Judge, ResultRow, row_of
from prnav.design.variants import Named
from prnav.errors import ConfigError
from prnav.files import write_text
from prnav.locks import held
from prnav.result_kinds import PLAN_KIND, read_judged
from prnav.schema import read_json
from prnav.sensors import load_design, save_design

PLAN, RESULTS = "plan.json", "results.jsonl"


@dataclass(frozen=True)
class Job:
    """One specialist."""

    name: str
    """Of its folder."""
    group: str
    """What its design stands for in a figure."""
    design: str
    """Design file, relative to the plan."""
    task: str
    """Config file of the task, relative to the plan, without its ending."""
    seed: int


def write_plan(folder: Path, kind: str, designs: Named, configs: dict[str, OptimizeConfig], seeds: int) -> list[Job]:
    """Plan of every design with every task and ``seeds`` seeds, as files in ``folder``; its jobs.

    Raises:
        ConfigError: the folder holds another plan.
    """
    jobs = []
    texts: dict[str, str] = {}
    for index, (group, design) in enumerate(designs):
        file = f"designs/{index:02d}-{design.name}.toml"
        save_design(design, folder / file)
        for task in configs:
            for seed in range(seeds):
                name = f"{index:02d}-{design.name}-{task}-{seed}"
                jobs.append(Job(name, group, file, task, configs[task].specialist.seed + seed))
    for task, config in configs.items():
        texts[task] = to_toml(config)
    plan = {"kind": kind, "jobs": [asdict(job) for job in jobs], "configs": texts}
    text = json.dumps(plan, indent=1) + "\n"
    path = folder / PLAN
    if path.exists() and path.read_text(encoding="utf-8") != text:
        raise ConfigError(
            f"{path}: another plan stands here; give the same designs and settings, or another --out folder"
        )
    for task, spelled in texts.items():
        write_text(folder / f"{task}.toml", spelled)
    write_text(path, text)
    return jobs


def read_plan(folder: Path) -> tuple[str, list[Job]]:
    """Kind and jobs of a plan.

    Raises:
        ConfigError: there is none, or it is broken.
    """
    path = folder / PLAN
    plan = read_json(path, PLAN_KIND, ConfigError, f"make a plan with prnav-design sweep KIND --out {folder}")
    try:
        return str(plan["kind"]), [Job(**job) for job in plan["jobs"]]
    except TypeError as error:
        raise ConfigError(
            f"{path}: is no plan ({error}); make one with prnav-design sweep KIND --out {folder}"
        ) from error


def work(
    folder: Path,
    say: Callable[[int, int, str], None] = lambda done, of, text: None,
    loading: Progress | None = None,
    warn: Callable[[str], None] = lambda text: None,
) -> int:
    """Take jobs until all are done or held by other workers; how many are done then, by whomever."""
    _, jobs = read_plan(folder)
    judges: dict[str, Judge] = {}
    for job in jobs:
        place = folder / "jobs" / job.name
        with held(place) as mine:
            if not mine or (place / "judged.json").exists():
                continue
            if job.task not in judges:
                config = load_config(OptimizeConfig, folder / f"{job.task}.toml")
                judges[job.task] = Judge(config.train, config.specialist, loading, warn=warn)
            say(len(_done(folder, jobs)), len(jobs), job.name)
            judges[job.task].specialist(load_design(folder / job.design), place, seed=job.seed)
            say(len(_done(folder, jobs)), len(jobs), f"{job.name} done")
    return len(_done(folder, jobs))


def collect(folder: Path) -> list[ResultRow]:
    """Results of the jobs that are done, one row each, also left in ``results.jsonl``."""
    kind, jobs = read_plan(folder)
    rows: list[ResultRow] = []
    for job in _done(folder, jobs):
        told = read_judged(folder / "jobs" / job.name / "judged.json")
        row = row_of(
            load_design(folder / job.design),
            told["measures"],
            group=job.group,
            task=job.task,
            seed=job.seed,
            steps=told["asked"]["steps"],
            kind=kind,
        )
        rows.append(row)
    write_text(folder / RESULTS, "".join(json.dumps(row) + "\n" for row in rows))
    return rows


def _done(folder: Path, jobs: list[Job]) -> list[Job]:
    return [job for job in jobs if (folder / "jobs" / job.name / "judged.json").exists()]
