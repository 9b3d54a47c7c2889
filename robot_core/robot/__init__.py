"""The facts of one robot that everything else works with: its URDF and one parameter file."""

from robot_core.robot.description import Camera, JointLimit, LegJoints, Motor, RobotDescription
from robot_core.robot.load import NAO, load_robot

__all__ = [
    "NAO",
    "Camera",
    "JointLimit",
    "LegJoints",
    "Motor",
    "RobotDescription",
    "load_robot",
]
