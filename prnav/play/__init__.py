"""Playing episodes: the loop, what acts in it, and the random numbers that belong to a step of an episode."""

from prnav.play.loop import Observer, Outcomes, TraceRecorder, play
from prnav.play.noise import episode_key, uniforms, uniforms_of_width

__all__ = ["Observer", "Outcomes", "TraceRecorder", "episode_key", "uniforms_of_width", "play", "uniforms"]
