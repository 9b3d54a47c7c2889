"""Which gait parameters a robot walks with."""

from pathlib import Path

from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.robot import RobotDescription

DEFAULT = "default"


def preset_for(robot: RobotDescription, name_or_path: str | Path) -> GaitParameters:
    """Parameters of a shipped preset or of a YAML file; `default` is the robot's own."""
    return load_preset(robot.preset if str(name_or_path) == DEFAULT else name_or_path)
