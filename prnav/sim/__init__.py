"""Batched agents in scenes: reset, step, and the arrays of their state."""

from prnav.sim.simulator import FORWARD, HOLD, LEFT, RIGHT, STOP, SimConfig, Simulator
from prnav.sim.world import World, load_world

__all__ = ["FORWARD", "HOLD", "LEFT", "RIGHT", "STOP", "SimConfig", "Simulator", "World", "load_world"]
