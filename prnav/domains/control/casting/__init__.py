"""Compiled loops of the caster: rays through sensors' pixels, met by shapes, lit, and averaged per receptor.

Each ray is computed by itself, in float64 and in one order, so a reading never depends on the batch, the order or the
number of threads. Whatever concerns a shape happens in its own frame, where spheres, capsules, cylinders and ellipsoids
are centred and upright and planes lie at z = 0.

Letters: o a ray's origin and d its direction, 1 long along the optical axis, so that its parameter t is the depth; a
and b where it passes an image, -1 to 1, right and up; s the number of a shape, x, y, z a place in its frame.
"""

from prnav.domains.control.casting.room import SAMPLES, Scene, Strip, Work, new_strip, new_work
from prnav.domains.control.casting.states import read_states

__all__ = ["SAMPLES", "Scene", "Strip", "Work", "new_strip", "new_work", "read_states"]
