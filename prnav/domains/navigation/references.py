"""Reference agents by name."""

from __future__ import annotations

from prnav.contracts import Agent
from prnav.domains.navigation.agents import (
    ForwardAgent,
    GoalFollowerAgent,
    InTaskNumbers,
    RandomNavigator,
    ShortestPathAgent,
)
from prnav.domains.navigation.env import NavigationConfig, NavigationSlots
from prnav.domains.navigation.touch import BlindAgent, WallFollowerAgent
from prnav.errors import ConfigError

REFERENCE_AGENTS: tuple[str, ...] = ("shortest-path", "random", "forward", "goal-follower", "wall-follower", "blind")

NEEDS_GOAL: tuple[str, ...] = ("goal-follower",)
"""Agents that can do nothing in a task that shows no goal."""


def reference_agent(name: str, slots: NavigationSlots, config: NavigationConfig) -> Agent:
    """Agent of that name from :data:`REFERENCE_AGENTS` for these slots.

    Raises:
        ConfigError: there is none, or the task does not tell what it needs.
    """
    if name not in REFERENCE_AGENTS:
        raise ConfigError(f"agent {name!r} is not known; valid: {', '.join(REFERENCE_AGENTS)}")
    if name in NEEDS_GOAL and not config.kind.shows_goal:
        valid = ", ".join(agent for agent in REFERENCE_AGENTS if agent not in NEEDS_GOAL)
        raise ConfigError(f"agent {name!r} needs a goal, and {config.kind.name} shows none; valid there: {valid}")
    reach, stride, first = config.rules.success_distance, config.sim.forward_step, slots.first_action
    agents: dict[str, Agent] = {
        "shortest-path": ShortestPathAgent(lambda: slots.expert_actions() + first),
        "random": RandomNavigator(reach),
        "forward": ForwardAgent(reach),
        "goal-follower": GoalFollowerAgent(reach),
        "wall-follower": WallFollowerAgent(slots.num_slots, stride, reach),
        "blind": BlindAgent(slots.num_slots, stride, reach),
    }
    return InTaskNumbers(agents[name], first) if first else agents[name]
