"""Gyro stabilisation of the leg that stands alone: eq. (7) of Friedmann et al. without k_d.

Signs are those of a robot whose joints turn as the NAO's do: a torso that pitches forward is met by
pressing the toes down.
"""

from nao_lipm_gait.motion.keyframes import Balance
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import FloatArray, Point3


def balanced(
    position: FloatArray,
    support: int,
    angular_velocity: Point3,
    balance: Balance,
    robot: RobotDescription,
) -> None:
    """Add the corrections to joint targets (n,) [rad] in place.

    support: +1 left, -1 right; angular_velocity [rad/s] of the torso in the torso frame.
    """
    roll_rate, pitch_rate, _ = angular_velocity
    leg = robot.left_leg if support > 0 else robot.right_leg
    pitch, roll = balance.pitch * pitch_rate, balance.roll * roll_rate
    position[robot.index(leg.ankle_pitch)] += pitch
    position[robot.index(leg.ankle_roll)] += roll
    position[robot.index(leg.hip_pitch)] += balance.hip_share * pitch
    position[robot.index(leg.hip_roll)] += balance.hip_share * roll
