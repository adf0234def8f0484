"""What an agent senses: designs of sensors on its body, GPS, compass and the point goal.

What reads light stands beside, with the renderer that it needs: :mod:`prnav.sensors.photoreceptor` and
:mod:`prnav.sensors.camera`.
"""

from prnav.sensors.body import Body, BodySurface
from prnav.sensors.design import (
    AXES,
    FOV_LIMITS,
    MIRROR,
    Design,
    DesignSpace,
    Link,
    Seat,
    check_poses,
)
from prnav.sensors.design_file import (
    design_model,
    design_summaries,
    design_to_toml,
    library_designs,
    load_design,
    save_design,
)
from prnav.sensors.design_map import (
    effective_theta,
    free_values,
    moved_design,
    pose_to_theta,
    random_design,
    theta_to_pose,
    with_free_values,
)
from prnav.sensors.gps_compass import compass, gps, pointgoal
from prnav.sensors.mesh_body import MeshBody
from prnav.sensors.readout import Readout, read_out

__all__ = [
    "AXES",
    "FOV_LIMITS",
    "MIRROR",
    "Body",
    "Design",
    "DesignSpace",
    "Link",
    "MeshBody",
    "Readout",
    "BodySurface",
    "Seat",
    "check_poses",
    "compass",
    "design_model",
    "design_summaries",
    "design_to_toml",
    "effective_theta",
    "free_values",
    "gps",
    "library_designs",
    "load_design",
    "moved_design",
    "pointgoal",
    "pose_to_theta",
    "random_design",
    "read_out",
    "save_design",
    "theta_to_pose",
    "with_free_values",
]
