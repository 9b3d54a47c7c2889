"""Posture feedback from the gyro: q_new = q + k_p w on the ankle of the supporting leg.

This is eq (7) of Friedmann et al. without its k_d dw/dt. The paper applies it to pitch and roll of
foot and hip, to the waist pitch, and to the shoulders too, which no preset used.

With positive gains, a torso that pitches forward (w_y > 0) presses the toes down; a negative gain
turns the correction round.
"""

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.whole_body.leg_kinematics import LegColumns
from robot_core.geometry import float_view
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3


class PostureFeedback:
    """Corrects the support leg by the angular velocity of the torso.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: RobotDescription) -> None:
        left, right = LegColumns(robot, robot.left_leg), LegColumns(robot, robot.right_leg)
        self._legs = {+1: left, -1: right}
        self._roll = self._pitch = 0.0

    def apply(
        self,
        position: FloatArray,
        support: int,
        angular_velocity: Point3 | None,
        parameters: GaitParameters,
    ) -> None:
        """Add the corrections to joint targets in place.

        Args:
            position: Joint targets (n,) [rad].
            support: Supporting leg, LEFT or RIGHT.
            angular_velocity: Angular velocity of the torso, in the torso frame [rad/s]; None =
                no new measurement: the last correction again.
            parameters: Parameters of the gait.
        """
        if angular_velocity is not None:
            roll_rate, pitch_rate, _ = angular_velocity
            self._roll = parameters.gyro_roll_gain * roll_rate
            self._pitch = parameters.gyro_pitch_gain * pitch_rate
        leg, joints = self._legs[support], float_view(position)
        joints[leg.ankle_pitch] += leg.ankle_pitch_sign * self._pitch
        joints[leg.ankle_roll] += leg.ankle_roll_sign * self._roll
