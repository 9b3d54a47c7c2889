"""The facts of one robot that everything else works with: its URDF and one parameter file."""

from nao_lipm_gait.robot_description.description import (
    JointLimit,
    LegJoints,
    Motor,
    Pose2,
    RobotDescription,
)
from nao_lipm_gait.robot_description.load import NAO, load_robot

__all__ = [
    "NAO",
    "JointLimit",
    "LegJoints",
    "Motor",
    "Pose2",
    "RobotDescription",
    "load_robot",
]
