"""The leg kinematics of a robot, by the geometry of its legs."""

from nao_lipm_gait.whole_body.leg_kinematics import LegKinematics, read_leg_geometry
from nao_lipm_gait.whole_body.numeric_legs import NumericLegs
from nao_lipm_gait.whole_body.shared_hip_legs import SharedHipLegs
from nao_lipm_gait.whole_body.yaw_hip_legs import YawHipLegs
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription


def make_legs(robot: RobotDescription) -> LegKinematics:
    """The leg kinematics of a robot: a closed form where one holds, else a numeric one.

    Args:
        robot: The robot.

    Returns:
        The kinematics.

    Raises:
        NaoGaitError: Its hips share a motor, but not as the NAO's.
    """
    hips = (robot.left_leg.hip_yaw, robot.right_leg.hip_yaw)
    geometry = read_leg_geometry(robot)
    if hips in robot.coupled_joints or hips[::-1] in robot.coupled_joints:
        if geometry is None:
            raise NaoGaitError(
                f"coupled_joints of {robot.name}", ", ".join(hips),
                "hips whose axes meet, tilted by 45 degrees, above knee, ankle and sole; or none",
            )  # fmt: skip
        return SharedHipLegs(geometry)
    return NumericLegs(robot) if geometry is None else YawHipLegs(geometry)
