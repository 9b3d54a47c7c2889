"""Where the joints of one leg stand in a joint array."""

from typing import NamedTuple

from nao_lipm_gait.robot_description import LegJoints, RobotDescription


class LegColumns(NamedTuple):
    """Indices into `RobotDescription.joint_names`, from the hip down."""

    hip_yaw: int
    hip_roll: int
    hip_pitch: int
    knee_pitch: int
    ankle_pitch: int
    ankle_roll: int


def leg_columns(robot: RobotDescription, leg: LegJoints) -> LegColumns:
    """Those of one leg of this robot."""
    return LegColumns(
        robot.index(leg.hip_yaw),
        robot.index(leg.hip_roll),
        robot.index(leg.hip_pitch),
        robot.index(leg.knee_pitch),
        robot.index(leg.ankle_pitch),
        robot.index(leg.ankle_roll),
    )
