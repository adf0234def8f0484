"""Playing episodes: the loop, what acts in it, and the random numbers that belong to a step of an episode."""

from prnav.play.loop import Observer, Outcomes, TraceRecorder, play
from prnav.play.noise import episode_key, noise_rows, uniforms

__all__ = ["Observer", "Outcomes", "TraceRecorder", "episode_key", "noise_rows", "play", "uniforms"]
