"""How navigation tasks are evaluated: which episodes, by whom, and what records hold of them."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from prnav.aliases import JSONObject, Untyped
from prnav.cache import cache_key, hash_arrays
from prnav.config import to_mapping
from prnav.contracts import Agent, EpisodeRequest, EpisodeSlots, Evaluation, Header, Outcome, Trace
from prnav.domains.navigation.benchmark import BENCHMARK, FAMILY, benchmark_of
from prnav.domains.navigation.env import EpisodeSource, NavigationConfig, NavigationSlots
from prnav.domains.navigation.maps import FloorMap, make_maps, save_maps
from prnav.domains.navigation.measures import soft_spl, spl
from prnav.domains.navigation.references import REFERENCE_AGENTS, reference_agent
from prnav.domains.navigation.sights import record_sights
from prnav.episodes.files import episode_splits
from prnav.errors import ConfigError, RecordError, SceneNote
from prnav.scene import scene_ids
from prnav.schema import Number, Table, fit
from prnav.sensors import Body
from prnav.sim import STOP

ENV_KEYS = ("sensors", "grid", "camera_size", "rays_per_receptor", "engine", "vision", "readout", "sim", "navmesh")
"""Settings of the environment that a record's head holds."""


RULES = Table(dict.fromkeys(("success_distance", "slack", "success_reward"), Number(-1e6, 1e6)))
"""What of the rules a result is computed from."""


@dataclass(frozen=True)
class NavigationEvaluation:
    """An :class:`prnav.contracts.EvaluationSpec` over episodes in scenes."""

    config_type: type[NavigationConfig]
    agents: Sequence[str] = REFERENCE_AGENTS

    def config(self, trained: NavigationConfig | None, request: EpisodeRequest) -> NavigationConfig:
        """The run's environment, or the default one on the test split, with the episodes that were asked for.

        Raises:
            ConfigError: the request contradicts itself or does not fit the task.
            SceneError: no such split.
        """
        config = self.config_type(scenes="test", vision=False) if trained is None else trained
        changes: JSONObject = {}
        if request.episodes_file is not None or request.data is not None:
            split = request.split if request.episodes_file is not None else request.split or "val"
            changes |= {"episodes": request.episodes_file, "episode_split": split, "scene_files": ()}
            changes |= {"data": request.data, "data_root": None, "up": "y"}
            changes["navmesh_files"] = request.navmesh_from != "build"
        elif request.split is not None and config.data is not None:
            changes["episode_split"] = request.split
        elif config.episodes is not None and (split := held_out_split(config, request.split)) is not None:
            changes["episode_split"] = split
        elif request.split is not None:
            scene_ids(request.split)  # refuses a split that is none
            changes |= {"scenes": request.split, "episodes": None, "max_scenes": None, "data": None}
        if request.data_root is not None:
            changes["data_root"] = request.data_root
        if request.scenes:
            changes["scene_files"] = request.scenes
        data, episodes = changes.get("data", config.data), changes.get("episodes") or config.episodes
        if request.scenes and data is not None:
            raise ConfigError("--scene and --data both say where scenes are: give one of them")
        if (request.data_root or request.scenes) and data is None and episodes is None:
            raise ConfigError(
                "--scene and --data-root say where the scenes of episode files are: give --episodes-file too"
            )
        if request.up is not None:
            changes |= {"up": request.up, "up_from_episodes": False}
        if request.target is not None:
            names = [field.name for field in dataclasses.fields(config.rules)]  # type: ignore[arg-type]
            if "visible" not in names:
                raise ConfigError(f"--target {request.target}: {config.kind.name} has no target that can be seen")
            rules: Untyped = config.rules
            changes["rules"] = dataclasses.replace(rules, visible=request.target == "visible")
        return dataclasses.replace(config, **changes)

    def name(self, config: NavigationConfig) -> str:
        """Split or file that the episodes come from."""
        name = config.scenes if config.episodes is None else Path(config.episodes).name
        if config.data is not None:
            name = f"{config.data}-{name if config.episodes is not None else config.episode_split or config.scenes}"
        return name.removesuffix(".gz").removesuffix(".json")

    def hint(self, config: NavigationConfig) -> str:
        """The test split of the built-in homes, or the val split of a data set; nothing for one's own episodes."""
        if config.episodes:
            return ""
        return "--split test" if config.data is None else "--split val"

    def suffix(self, config: NavigationConfig) -> str:
        """What tells an invisible target from one that is seen."""
        return "" if _target(config) in (None, "visible") else "-invisible"

    def agent(self, name: str, config: NavigationConfig, slots: EpisodeSlots) -> Agent:
        """Reference agent of that name.

        Raises:
            ConfigError: there is none, or the task does not tell what it needs.
        """
        assert isinstance(slots, NavigationSlots)
        return reference_agent(name, slots, config)

    def header(self, config: NavigationConfig, world: EpisodeSource, slots: EpisodeSlots) -> Header:
        """Episodes, scenes, navmeshes, body, design, rules and settings; no path of this machine is in it."""
        assert isinstance(slots, NavigationSlots)
        design, settings = slots.design, to_mapping(config)
        seat = dataclasses.asdict(design.body) if isinstance(design.body, Body) else {"shape": design.body.shape}
        sensors = {"name": design.name, "grid": config.grid, "body": seat, "sensors": design.sensors.tolist()}
        places = hash_arrays({"starts": world.starts, "yaws": world.yaws, "goals": world.goals})
        scenes = zip(world.world.scene_ids, world.world.scenes, strict=True)
        return {
            "benchmark": benchmark_of(config),
            "task": config.kind.name,
            "target": _target(config),
            "split": self.name(config),
            "episodes_hash": cache_key(world.ids, places)[:16],
            "scenes": {name: scene.hash[:16] for name, scene in scenes},
            "sliding": config.sim.sliding,
            "body": {"radius": config.navmesh.agent_radius, "height": config.navmesh.agent_height},
            "design": sensors if config.vision else None,
            "navmeshes": world.navmesh_origins,
            "rules": to_mapping(config.rules),
            "env": {key: settings[key] for key in ENV_KEYS if key in settings},
        }

    def places(self, world: EpisodeSource, episode: int) -> Outcome:
        """Start and goal [m]."""
        return {"start": world.starts[episode].tolist(), "goal": world.goals[episode].tolist()}

    def current_benchmark(self, benchmark: str) -> str:
        """The built-in homes of this version for those of any version."""
        return BENCHMARK if benchmark.startswith(FAMILY) else benchmark

    def keep(self, evaluation: Evaluation, traces: Sequence[Trace], world: EpisodeSource, slots: EpisodeSlots) -> None:
        """Floor plans, and what receptors saw along the episodes that are shown."""
        assert isinstance(slots, NavigationSlots)
        save_maps(evaluation.directory, floor_plans(world))
        record_sights(evaluation, traces, slots)

    def recompute(self, row: Outcome, trace: Trace, header: Header) -> Mapping[str, float]:
        """The measures, from the trajectory, the distances to the goal and the rules.

        Raises:
            RecordError: the header lacks rules.
        """
        rules = fit(header.get("rules"), RULES, RecordError, "evaluation: its rules", "evaluate again with prnav-eval")
        stops = len(trace) > 0 and int(trace["actions"][-1]) == STOP
        taken = float(np.linalg.norm(np.diff(trace["positions"], axis=0), axis=1).sum())
        left, shortest = float(row["distance_to_goal"]), float(row["geodesic_distance"])
        near = left <= rules["success_distance"]
        success = near and (stops or not self.config_type.kind.has_stop)
        reward = shortest - left - rules["slack"] * (len(trace) - stops) + rules["success_reward"] * success
        return {
            "success": float(success),
            "spl": float(spl(success, shortest, taken)),
            "soft_spl": float(soft_spl(left, shortest, taken)),
            "soft_spl_closest": float(soft_spl(row["closest_distance"], shortest, taken)),
            "path_length": taken,
            "steps": float(len(trace)),
            "collisions": float(trace["collisions"].sum()),
            "reward": reward,
        }


def held_out_split(config: NavigationConfig, asked: str | None) -> str | None:
    """Split of one's own episodes that an agent is to play: what was asked for, else one it was not trained on.

    None where there is no other; a :class:`prnav.errors.SceneNote` then says so.
    """
    assert config.episodes is not None
    splits = episode_splits(config.episodes)
    if asked is not None:
        return asked if asked in splits else None
    for name in ("test", "val"):
        if name in splits and config.episode_split not in (None, name):
            return name
    warnings.warn(
        f"{config.episodes}: no split test or val beside the one it was trained on, so the agent plays its training "
        "episodes; draw others (prnav-episodes generate --split val --seed 1) to see how well it generalises",
        SceneNote,
        stacklevel=2,
    )
    return None


def _target(config: NavigationConfig) -> str | None:
    """Whether the target of a task that has one is seen: "visible" or "invisible"."""
    visible = to_mapping(config.rules).get("visible")
    return None if visible is None else "visible" if visible else "invisible"


def floor_plans(world: EpisodeSource, metres_per_pixel: float = 0.05) -> list[FloorMap]:
    """Floor plans of the scenes that have episodes."""
    scenes = []
    for index, (scene_id, navmesh) in enumerate(zip(world.world.scene_ids, world.world.navmeshes, strict=True)):
        here = world.scene_index == index
        if here.any():
            scenes.append((scene_id, navmesh, np.concatenate([world.starts[here, 1], world.goals[here, 1]])))
    return make_maps(scenes, metres_per_pixel)
