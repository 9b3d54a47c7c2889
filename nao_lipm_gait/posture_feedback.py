"""Posture control by the gyro: q_new = q + k_p w + k_d dw/dt, eq (7) of Friedmann et al.

The paper names foot pitch and roll, hip pitch and roll, waist pitch, shoulder pitch and roll. In
the legs it acts on the supporting one, which moves the whole body. One pair of gains per axis is
the ankle's, the other joints get shares of it; what a robot does not have, it does not get.

Signs: every joint turns about the positive axis. A torso that pitches forward (w_y > 0) is met by
toes pressed down, a hip that rises, and by upper body and arms that are thrown in the direction of
the fall, whose reaction holds the hips back.
"""

from typing import NamedTuple

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot_description import LegJoints, RobotDescription
from nao_lipm_gait.signals import FloatArray, Point3


class PostureFeedback:
    """Corrections of the support leg and the upper body from the torso's angular velocity."""

    def __init__(self, robot: RobotDescription):
        self._legs = {+1: _leg(robot, robot.left_leg), -1: _leg(robot, robot.right_leg)}
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
        position[leg.ankle_pitch] += pitch
        position[leg.ankle_roll] += roll
        position[leg.hip_pitch] += p.gyro_hip_share * pitch
        position[leg.hip_roll] += p.gyro_hip_share * roll
        if p.gyro_waist_share != 0.0:
            for waist in self._waist:
                position[waist] += p.gyro_waist_share * pitch
        if p.gyro_shoulder_share != 0.0:
            for shoulder in self._shoulder_pitch:
                position[shoulder] += p.gyro_shoulder_share * pitch
            for shoulder in self._shoulder_roll:
                position[shoulder] += p.gyro_shoulder_share * roll


class _Leg(NamedTuple):
    """Where the joints of one leg stand in a joint array."""

    ankle_pitch: int
    ankle_roll: int
    hip_pitch: int
    hip_roll: int


def _leg(robot: RobotDescription, leg: LegJoints) -> _Leg:
    return _Leg(
        robot.index(leg.ankle_pitch),
        robot.index(leg.ankle_roll),
        robot.index(leg.hip_pitch),
        robot.index(leg.hip_roll),
    )
