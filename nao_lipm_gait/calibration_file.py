"""Calibration files: written by `nao_gait calibrate`, read by the gait (`calibration`)."""

import os
from pathlib import Path
from typing import Any

import attrs
import yaml

from nao_lipm_gait.calibration import NOT_CALIBRATED, Calibration
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.schema import Settings, group, number, read_yaml, text

DIGITS = 6
"""Decimals of the numbers in a file; they are known to three."""
_HEADER = "# Constant errors of the sensors of one robot [rad, rad/s], by `nao_gait calibrate`.\n"


@attrs.frozen
class Deviation(Settings):
    """Standard deviations of what was measured while the robot stepped."""

    sole_pitch: float = number(0.0, 0.0, 1.0, "rad", "Standard deviation of the sole pitch.")
    sole_roll: float = number(0.0, 0.0, 1.0, "rad", "Standard deviation of the sole roll.")


@attrs.frozen
class CalibrationFile(Settings):
    """The contents of a calibration file."""

    robot: str = text(meaning="Name of the robot model, as in config/robots.")
    calibration: Calibration = group(Calibration, meaning="What was measured.")
    deviation: Deviation = group(Deviation, Deviation(), "How well.")
    date: str = text("", "When it was measured.")

    def as_yaml(self) -> str:
        """The text of the file."""
        document = {
            "robot": self.robot,
            "date": self.date,
            "calibration": _rounded(self.calibration),
            "deviation": _rounded(self.deviation),
        }
        return _HEADER + yaml.safe_dump(document, sort_keys=False)


def _rounded(values: Settings) -> dict[str, Any]:
    return {
        name: round(value, DIGITS) if isinstance(value, float)
        else {joint: round(zero, DIGITS) for joint, zero in value}
        for name, value in values.as_dict().items()
    }  # fmt: skip


def load_calibration(path: str | Path, robot: RobotDescription) -> Calibration:
    """Read a calibration file.

    Returns:
        The constant errors of its sensors.

    Raises:
        NaoGaitError: The file cannot be read, a value is not allowed, or it belongs to another
            robot.
    """
    where = f"calibration {path}"
    file = CalibrationFile.from_mapping(read_yaml(Path(path), "calibration"), f"{where}: ")
    if file.robot != robot.name:
        raise NaoGaitError(f"{where}: robot", file.robot, f"{robot.name}, the robot of this gait")
    for joint, zero in file.calibration.joint_zero:
        if joint not in robot.joint_names:
            allowed = f"a joint of {robot.name}"
            raise NaoGaitError(f"{where}: calibration.joint_zero.{joint}", zero, allowed)
    return file.calibration


def calibration_of(robot: RobotDescription, path: str = "") -> Calibration:
    """The calibration in a file; that of a robot that was not calibrated if `path` is empty."""
    return load_calibration(Path(os.path.expanduser(path)), robot) if path else NOT_CALIBRATED
