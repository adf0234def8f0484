"""What an agent senses: designs of sensors on its body, photoreceptors, cameras, GPS, compass and the point goal."""

from prnav.sensors.body import Body
from prnav.sensors.camera import Camera, CameraConfig
from prnav.sensors.design import (
    AXES,
    FOV_LIMITS,
    Design,
    DesignSpace,
    check_poses,
    pose_to_theta,
    random_design,
    theta_to_pose,
)
from prnav.sensors.design_file import design_to_toml, library_designs, load_design, save_design
from prnav.sensors.gps_compass import compass, gps, pointgoal
from prnav.sensors.photoreceptor import PhotoreceptorConfig, Photoreceptors
from prnav.sensors.readout import Readout, read_out

__all__ = [
    "AXES",
    "FOV_LIMITS",
    "Body",
    "Camera",
    "CameraConfig",
    "Design",
    "DesignSpace",
    "PhotoreceptorConfig",
    "Photoreceptors",
    "Readout",
    "check_poses",
    "compass",
    "design_to_toml",
    "gps",
    "library_designs",
    "load_design",
    "pointgoal",
    "pose_to_theta",
    "random_design",
    "read_out",
    "save_design",
    "theta_to_pose",
]
