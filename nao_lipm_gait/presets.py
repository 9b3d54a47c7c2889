"""Selects the gait parameters of a robot."""

from pathlib import Path

from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.similarity import fitted
from robot_core.robot import RobotDescription, load_robot

DEFAULT = "default"


def preset_for(robot: RobotDescription, name_or_path: str | Path) -> GaitParameters:
    """Load a shipped preset or a YAML file.

    `default` selects the preset of the robot. A robot that has none gets the NAO's, fitted to its
    soles and hips.
    """
    if str(name_or_path) != DEFAULT:
        return load_preset(name_or_path)
    if robot.preset is not None:
        return load_preset(robot.preset)
    return fitted(load_preset(DEFAULT), robot, load_robot())
