"""Posture control by the gyro: q_new = q + k_p w + k_d dw/dt, eq (7) of Friedmann et al.

The paper names foot pitch and roll, hip pitch and roll, waist pitch, shoulder pitch and roll. In
the legs it acts on the supporting one, which moves the whole body. One pair of gains per axis is
the ankle's, the other joints get shares of it; what a robot does not have, it does not get.

Signs: every joint turns about the positive axis. A torso that pitches forward (w_y > 0) is met by
toes pressed down, a hip that rises, and by upper body and arms that are thrown in the direction of
the fall, whose reaction holds the hips back.
"""

from nao_lipm_gait.geometry import float_view
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, Point3
from nao_lipm_gait.whole_body.leg_kinematics import leg_columns


class PostureFeedback:
    """Corrections of the support leg and the upper body from the torso's angular velocity."""

    def __init__(self, robot: RobotDescription):
        left, right = leg_columns(robot, robot.left_leg), leg_columns(robot, robot.right_leg)
        self._legs = {+1: left, -1: right}
        self._waist = () if robot.waist_pitch is None else (robot.index(robot.waist_pitch),)
        self._shoulder_pitch = tuple(map(robot.index, robot.shoulder_pitch))
        self._shoulder_roll = tuple(map(robot.index, robot.shoulder_roll or ()))
        self._last: Point3 | None = None

    def apply(
        self,
        position: FloatArray,
        support: int,
        angular_velocity: Point3,
        parameters: GaitParameters,
        dt: float,
    ) -> None:
        """Add the corrections to joint targets (n,) [rad] in place.

        support: +1 left, -1 right; angular_velocity [rad/s] of the torso in the torso frame.
        """
        roll_rate, pitch_rate, _ = angular_velocity
        last = self._last or angular_velocity
        self._last = angular_velocity
        p = parameters
        roll = p.gyro_roll_gain * roll_rate + p.gyro_roll_rate_gain * (roll_rate - last[0]) / dt
        pitch = (
            p.gyro_pitch_gain * pitch_rate + p.gyro_pitch_rate_gain * (pitch_rate - last[1]) / dt
        )
        leg = self._legs[support]
        joints = float_view(position)
        joints[leg.ankle_pitch] += pitch
        joints[leg.ankle_roll] += roll
        joints[leg.hip_pitch] += p.gyro_hip_share * pitch
        joints[leg.hip_roll] += p.gyro_hip_share * roll
        if p.gyro_waist_share != 0.0:
            for waist in self._waist:
                joints[waist] += p.gyro_waist_share * pitch
        if p.gyro_shoulder_share != 0.0:
            for shoulder in self._shoulder_pitch:
                joints[shoulder] += p.gyro_shoulder_share * pitch
            for shoulder in self._shoulder_roll:
                joints[shoulder] += p.gyro_shoulder_share * roll
