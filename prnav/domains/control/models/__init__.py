"""The bodies of the six tasks, built with MuJoCo's model editing interface.

Dimensions, masses, joints, materials and lights are those of the DeepMind Control Suite (Tassa et al. 2018 and 2020);
tests hold every field of the compiled models to recordings of it.
"""

from prnav.domains.control.models.finger import finger_spin, finger_turn_easy
from prnav.domains.control.models.reacher import reacher_hard
from prnav.domains.control.models.walker import walker

__all__ = ["finger_spin", "finger_turn_easy", "reacher_hard", "walker"]
