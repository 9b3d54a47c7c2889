"""The leg kinematics of each kind of hip."""

from collections.abc import Callable

from nao_lipm_gait.whole_body.leg_kinematics import LegKinematics
from nao_lipm_gait.whole_body.shared_hip_legs import SharedHipLegs
from nao_lipm_gait.whole_body.yaw_hip_legs import YawHipLegs
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription

KINEMATICS: dict[str, Callable[[RobotDescription], LegKinematics]] = {
    "shared_yaw_pitch": SharedHipLegs,
    "yaw": YawHipLegs,
}


def make_legs(robot: RobotDescription) -> LegKinematics:
    """The leg kinematics of a robot.

    Args:
        robot: The robot; its robot file names the kind of hip.

    Returns:
        The kinematics.

    Raises:
        NaoGaitError: There are none for this kind of hip.
    """
    if robot.hip not in KINEMATICS:
        raise NaoGaitError("hip", robot.hip, f"one of {', '.join(KINEMATICS)}")
    return KINEMATICS[robot.hip](robot)
