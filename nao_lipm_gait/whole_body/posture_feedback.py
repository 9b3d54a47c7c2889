"""Posture feedback from the gyro: q_new = q + k_p w + k_d dw/dt, eq (7) of Friedmann et al.

The paper applies it to pitch and roll of foot and hip, to the waist pitch, and to pitch and roll of
the shoulders. In the legs it acts on the supporting one, which moves the whole body. The gains are
those of the ankle; the other joints use shares of them. A robot without one of these joints does
without its share. No preset uses k_d or a share, so they are arguments and not parameters.

With positive gains, a torso that pitches forward (w_y > 0) presses the toes down and extends the
hip; a negative gain turns the correction round.
"""

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.whole_body.leg_kinematics import LegColumns
from robot_core.geometry import float_view
from robot_core.motion.joints import joint_signs
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, Point3


class PostureFeedback:
    """Corrects the support leg and the upper body by the angular velocity of the torso.

    Args:
        robot: The robot.
        derivative_time: k_d / k_p [s].
        hip: Share of the corrections that is added to the support hip.
        waist: Share of the pitch correction that is added to the waist.
        shoulder: Share of the corrections that is added to both shoulders.
    """

    def __init__(
        self,
        robot: RobotDescription,
        *,
        derivative_time: float = 0.0,
        hip: float = 0.0,
        waist: float = 0.0,
        shoulder: float = 0.0,
    ) -> None:
        self._derivative_time = derivative_time
        self._hip, self._waist_share, self._shoulder = hip, waist, shoulder
        left, right = LegColumns(robot, robot.left_leg), LegColumns(robot, robot.right_leg)
        self._legs = {+1: left, -1: right}
        self._waist = () if robot.waist_pitch is None else (robot.index(robot.waist_pitch),)
        self._shoulder_pitch = tuple(map(robot.index, robot.shoulder_pitch or ()))
        self._signs = joint_signs(robot)
        self._shoulder_roll = tuple(map(robot.index, robot.shoulder_roll or ()))
        self._last: Point3 | None = None
        self._roll = self._pitch = 0.0

    def apply(
        self,
        position: FloatArray,
        support: int,
        angular_velocity: Point3 | None,
        parameters: GaitParameters,
        dt: float,
    ) -> None:
        """Add the corrections to joint targets in place.

        Args:
            position: Joint targets (n,) [rad].
            support: Supporting leg, LEFT or RIGHT.
            angular_velocity: Angular velocity of the torso, in the torso frame [rad/s]; None =
                no new measurement: the last correction again.
            parameters: Parameters of the gait.
            dt: Time since the last measurement [s].
        """
        if angular_velocity is not None:
            self._correct(angular_velocity, parameters, dt)
        roll, pitch = self._roll, self._pitch
        leg = self._legs[support]
        joints = float_view(position)
        joints[leg.ankle_pitch] += leg.ankle_pitch_sign * pitch
        joints[leg.ankle_roll] += leg.ankle_roll_sign * roll
        joints[leg.hip_pitch] += leg.hip_pitch_sign * self._hip * pitch
        joints[leg.hip_roll] += leg.hip_roll_sign * self._hip * roll
        if self._waist_share != 0.0:
            for waist in self._waist:
                joints[waist] += self._signs[waist] * self._waist_share * pitch
        if self._shoulder != 0.0:
            for shoulder in self._shoulder_pitch:
                joints[shoulder] += self._signs[shoulder] * self._shoulder * pitch
            for shoulder in self._shoulder_roll:
                joints[shoulder] += self._signs[shoulder] * self._shoulder * roll

    def _correct(self, angular_velocity: Point3, parameters: GaitParameters, dt: float) -> None:
        roll_rate, pitch_rate, _ = angular_velocity
        last = self._last or angular_velocity
        self._last = angular_velocity
        p, ahead = parameters, self._derivative_time / dt
        self._roll = p.gyro_roll_gain * (roll_rate + ahead * (roll_rate - last[0]))
        self._pitch = p.gyro_pitch_gain * (pitch_rate + ahead * (pitch_rate - last[1]))
