"""What the robot knows about its own body, made from one sensor frame per tick.

SensorFrame -> soles and CoM in the torso -> torso orientation -> measured CoM in Q (11)
-> odometry; beside it: does it fall, does it tip, on which side does it lie?
"""

import math

from nao_lipm_gait.estimation.com_measurement import (
    level_frame,
    measured_acceleration_in_q,
    measured_com_in_q,
)
from nao_lipm_gait.estimation.fall_detection import FallDetector
from nao_lipm_gait.estimation.lying_side import LyingSideDetector
from nao_lipm_gait.estimation.odometry import Odometry
from nao_lipm_gait.estimation.tipping import Tipping
from nao_lipm_gait.estimation.torso_orientation import TorsoOrientation
from nao_lipm_gait.estimation.yaw_slip import LeanTurn, StanceTurn
from nao_lipm_gait.geometry import as_point
from nao_lipm_gait.head.head_control import TorsoPlace
from nao_lipm_gait.motion.keyframes import Posture
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.types import (
    DOWN,
    GRAVITY,
    IN_MOTION,
    GaitState,
    Point3,
    Pose2,
    SensorFrame,
)
from nao_lipm_gait.walks.pendulum import natural_frequency
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose

LYING_TILT = 1.0
"""[rad] of a torso at rest beyond which the robot lies."""
STOOD_UP_TILT = 0.4
"""[rad] below which a get-up that has come to its end counts as done."""
REST_FORCE, REST_RATE = 0.3, 0.05
"""[m/s^2] from gravity and [rad/s]: what is less is a robot at rest."""
GAP_MAX = 0.05
"""[s] of lost frames that the gyro is integrated over: of half a sway its two ends tell nothing."""


class StateEstimator:
    """The robot's sense of its own body; all frames and units as in the estimators themselves."""

    def __init__(self, body: BodyModel, parameters: GaitParameters, period: float) -> None:
        """Period [s]: the distance of two frames, where none is lost."""
        p = parameters
        self.orientation = TorsoOrientation(
            p.tilt_accelerometer_time, p.tilt_stance_time, p.tilt_stance_limit
        )
        self.odometry = Odometry()
        self.com_in_q: Point3 = (0.0, 0.0, 0.0)
        """Measured CoM [m]."""
        self.angular_velocity: Point3 = (0.0, 0.0, 0.0)
        """The gyro's [rad/s], in the torso frame."""
        self.acceleration_in_q: tuple[float, float] | None = None
        """[m/s^2] in x and y, where pushes are felt by it."""
        self.lying_side: Posture | None = None
        """On which side a robot that is down or in a motion has come to rest."""
        self._body = body
        self._p = p
        self._period = self._passed = period
        self._soles: tuple[SolePose, SolePose] | None = None
        self._fall = FallDetector()
        self._tipping = Tipping()
        self._lying = LyingSideDetector()
        self._stance_turn = StanceTurn()
        self._lean_turn = LeanTurn()

    def set_parameters(self, parameters: GaitParameters) -> None:
        p = self._p = parameters
        self.orientation.set_times(
            p.tilt_accelerometer_time, p.tilt_stance_time, p.tilt_stance_limit
        )

    def begin(self, frame: SensorFrame) -> bool:
        """Take the orientation from the first frame; whether the robot lies."""
        if not _at_rest(frame):
            self.orientation.reset_upright()
            return False
        self.orientation.reset(as_point(frame.linear_acceleration))
        return self.orientation.tilt > LYING_TILT

    def update(
        self,
        frame: SensorFrame,
        support: int,
        sole_in_q: Pose2,
        state: GaitState,
        passed: float,
        *,
        settled: bool,
    ) -> None:
        """One tick.

        Args:
            support, sole_in_q: the leg that is expected to carry the robot, where its sole is.
            passed [s]: since the last frame; more than a period where frames were lost.
            settled: the robot stands in its stand pose and has nothing else in mind.
        """
        self._passed, dt = passed, min(passed, GAP_MAX)
        self._body.set_joints(frame.joint_position)
        com = self._body.com_in_torso()
        sole = self._body.sole_in_torso(support)
        other = self._body.sole_in_torso(-support)
        self._soles = (sole, other) if support > 0 else (other, sole)
        force = as_point(frame.linear_acceleration)
        roll_rate, pitch_rate, yaw_rate = self._rate_since_last(as_point(frame.angular_velocity))
        down, in_motion = state in DOWN, state in IN_MOTION
        if down or in_motion:
            # The feet need not stand still: they say nothing about the torso.
            self.orientation.update((roll_rate, pitch_rate, yaw_rate), force, None, dt)
            self.lying_side = self._lying.update(force, dt)
        else:
            # Not every robot has a yaw gyro; the feet know how fast the torso turns.
            rate = (roll_rate, pitch_rate, self.odometry.velocity[2])
            self.orientation.update(rate, force, sole.normal, dt)
        level = level_frame(sole, self.orientation.up_in_torso)
        self.com_in_q = measured_com_in_q(com, level, sole_in_q)
        self.acceleration_in_q = (
            measured_acceleration_in_q(force, level, sole_in_q)
            if self._p.push_acceleration
            else None
        )
        if in_motion:
            return
        turn = 0.0
        if self._p.yaw_gyro:
            rate = (roll_rate, pitch_rate, yaw_rate)
            turn = self._stance_turn.update(support, level, rate, dt, at_rest=settled)
            if passed > GAP_MAX:
                turn = 0.0  # the joints' turn is that of the whole gap, the gyro's is not
        elif self._p.yaw_from_lean:
            walked = self.odometry.velocity[:2]
            turn = self._lean_turn.update(
                support, level, sole.normal, roll_rate, walked, dt, at_rest=settled
            )
        self.odometry.update(support, level, other, passed, turn)

    def _rate_since_last(self, rate: Point3) -> Point3:
        """The gyro's rate [rad/s]; where frames were lost, the mean of before and after."""
        last, self.angular_velocity = self.angular_velocity, rate
        if self._passed <= self._period:  # as for the first frame, before which none is lost
            return rate
        return 0.5 * (last[0] + rate[0]), 0.5 * (last[1] + rate[1]), 0.5 * (last[2] + rate[2])

    def unwanted_tilt(self, wanted_pitch: float) -> tuple[float, float]:
        """Roll and pitch [rad] beyond the wanted, as they will be when the targets take effect."""
        p = self._p
        roll_rate, pitch_rate, _ = self.angular_velocity
        return (
            self.orientation.roll + p.feedback_delay * roll_rate,
            self.orientation.pitch + p.feedback_delay * pitch_rate - wanted_pitch,
        )

    def falls(self) -> bool:
        """Whether a fall can no longer be met; once per tick."""
        return self._fall.falls(
            self.orientation.up_in_torso,
            self.orientation.tilt,
            self.angular_velocity,
            self._p.fall_tilt,
            self._p.fall_horizon,
        )

    def tipping_com(self) -> tuple[float, float, float, float] | None:
        """x, y [m], vx, vy [m/s] of the CoM of a stand that tips; once per tick of a stand."""
        p = self._p
        limit = p.stand_catch if p.feedback else 0.0
        return self._tipping.update(
            self.com_in_q, natural_frequency(p.pendulum_height), limit, self._passed
        )

    def forget_stand(self) -> None:
        """The robot does not stand."""
        self._tipping.forget()

    def watch_lying(self) -> None:
        """The robot moves from now on: begin anew to watch on which side it comes to rest."""
        self._lying.restart()

    def lies_after_motion(self) -> bool:
        """The accelerometer takes the tilt over, which the gyros lost in the motion."""
        self.orientation.reset(self._lying.force)
        return self.orientation.tilt > STOOD_UP_TILT

    @property
    def place(self) -> TorsoPlace:
        """Where torso and soles are, by the joints as they were measured."""
        if self._soles is None:
            raise RuntimeError("no frame has been seen yet")
        left, right = self._soles
        return TorsoPlace(
            self.orientation.up_in_torso, left, right, self.odometry.base_footprint_in_odom
        )


def _at_rest(frame: SensorFrame) -> bool:
    force, rate = as_point(frame.linear_acceleration), as_point(frame.angular_velocity)
    return (
        abs(math.hypot(*force) - GRAVITY) < REST_FORCE and math.hypot(rate[0], rate[1]) < REST_RATE
    )
