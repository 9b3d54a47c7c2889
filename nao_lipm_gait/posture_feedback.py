"""Posture control by the gyro: q_new = q + k_p w + k_d dw/dt, eq (7) of Friedmann et al.

Added to the joints of the supporting leg, where it acts on the whole body. Signs are those of the
NAO's joints: a torso that pitches forward (w_y > 0) is met by pressing the toes down.
"""

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.robot_description import LegJoints, RobotDescription
from nao_lipm_gait.signals import FloatArray, Point3


class PostureFeedback:
    """Corrections of the support leg from the torso's angular velocity."""

    def __init__(self, robot: RobotDescription):
        self._legs = {+1: _joints(robot, robot.left_leg), -1: _joints(robot, robot.right_leg)}
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
        ankle_pitch, ankle_roll, hip_pitch, hip_roll = self._legs[support]
        position[ankle_pitch] += pitch
        position[ankle_roll] += roll
        position[hip_pitch] += p.gyro_hip_share * pitch
        position[hip_roll] += p.gyro_hip_share * roll


def _joints(robot: RobotDescription, leg: LegJoints) -> tuple[int, int, int, int]:
    return (
        robot.index(leg.ankle_pitch),
        robot.index(leg.ankle_roll),
        robot.index(leg.hip_pitch),
        robot.index(leg.hip_roll),
    )
