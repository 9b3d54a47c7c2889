"""Selects the gait parameters of a robot."""

from pathlib import Path

from nao_lipm_gait.parameters import GaitParameters, load_preset
from robot_core.robot import RobotDescription

DEFAULT = "default"


def preset_for(robot: RobotDescription, name_or_path: str | Path) -> GaitParameters:
    """Load a shipped preset or a YAML file; `default` selects the preset of the robot."""
    return load_preset(robot.preset if str(name_or_path) == DEFAULT else name_or_path)
