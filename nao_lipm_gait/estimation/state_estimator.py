"""The state of the robot's own body, from one sensor frame per tick.

SensorFrame -> soles and CoM in the torso frame -> torso orientation -> measured CoM in Q (11)
-> odometry; and whether the robot falls, tips, or on which side it lies.
"""

from math import atan2, hypot, sin

from nao_lipm_gait.estimation.blocked import BlockedDetector
from nao_lipm_gait.estimation.com_measurement import (
    LevelFrame,
    level_frame,
    measured_acceleration_in_q,
    measured_com_in_q,
)
from nao_lipm_gait.estimation.fall_detection import (
    FALL_HORIZON,
    FallDetector,
    TippingDetector,
)
from nao_lipm_gait.estimation.ground_tilt import GroundTilt
from nao_lipm_gait.estimation.gyro_bias_jump import GyroBiasJump
from nao_lipm_gait.estimation.lying_side import LyingSideDetector
from nao_lipm_gait.estimation.odometry import Odometry
from nao_lipm_gait.estimation.odometry_covariance import OdometryCovariance
from nao_lipm_gait.estimation.sole_levelling import SoleLevelling
from nao_lipm_gait.estimation.stand_alignment import StandAlignment
from nao_lipm_gait.estimation.torso_orientation import TorsoOrientation
from nao_lipm_gait.estimation.torso_place import TorsoPlace
from nao_lipm_gait.estimation.yaw_off_feet import YawOffFeet
from nao_lipm_gait.estimation.yaw_slip import UnseenYawSlip, YawOverSole, YawSlipFromYawGyro
from nao_lipm_gait.estimation.yaw_slip_from_lean import (
    HEADING_LEAN,
    LEAN_SIGMA,
    YawSlipFromLean,
)
from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.walk_engines import WALKS
from nao_lipm_gait.walks.base import Expectation
from nao_lipm_gait.walks.pendulum import natural_frequency
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from robot_core.errors import NaoGaitError
from robot_core.geometry import ORIGIN, as_point, compose, relative
from robot_core.motion.keyframes import Posture
from robot_core.types import (
    DOWN,
    GRAVITY,
    IN_MOTION,
    LEFT,
    LIFTED,
    MOTION,
    WALK,
    GaitState,
    Point2,
    Point3,
    PoseCovariance,
    SensorFrame,
)

ACCELEROMETER_TIME = 4.0
"""Time constant [s] of the correction of the torso's tilt by the accelerometer."""
LYING_TILT = 1.0
"""Tilt [rad] of a torso at rest beyond which the robot lies."""
GET_UP_TILT = 0.4
"""Tilt [rad] at the end of a get-up beyond which it has failed."""
UPRIGHT_TILT = 0.2
"""Tilt [rad] of the torso below which a fallen robot counts as put back on its feet."""
REST_FORCE, SWAY_FORCE = 0.3, 1.0
"""Largest difference [m/s^2] of the specific force from gravity at rest, and of a robot that sways
on its feet, as one with soft motors does that has just been put on them."""
REST_RATE, SWAY_RATE = 0.05, 0.5
"""Largest roll and pitch rates [rad/s] of the same."""
GAP_MAX = 0.05
"""Longest gap [s] to integrate the gyro over, and to interpolate its samples; beyond half a sway
both ends say nothing about the rotation in between."""


class StateEstimator:
    """Estimates the state of the robot's own body.

    Args:
        body: Kinematics and mass distribution of the robot.
        parameters: Parameters of the gait.
        period: Time [s] between two frames if none is lost.
        levelling: Learns the relative tilt of the soles.
        alignment: Measures the IMU against the soles.
        ground: Finds the tilt of the ground.
        yaw_gyro: The robot has one; the odometry then measures the yaw slip of the stance foot.

    Attributes:
        com_in_q: Measured CoM [m].
        acceleration_in_q: Measured acceleration [m/s^2] of the torso along x and y.
        angular_velocity: Gyro [rad/s] in the torso frame.
        lying_side: Side on which a robot that is down or in a motion has come to rest.
    """

    def __init__(
        self,
        body: BodyModel,
        parameters: GaitParameters,
        period: float,
        levelling: SoleLevelling,
        alignment: StandAlignment,
        ground: GroundTilt,
        *,
        yaw_gyro: bool,
    ) -> None:
        p = parameters
        self.orientation = TorsoOrientation(ACCELEROMETER_TIME, p.stance_time)
        self.odometry = Odometry()
        self.com_in_q: Point3 = (0.0, 0.0, 0.0)
        self.acceleration_in_q = (0.0, 0.0)
        self.angular_velocity: Point3 = (0.0, 0.0, 0.0)
        self.lying_side: Posture | None = None
        self._body = body
        self._p = p
        self._period = self._dt = period
        self._soles: tuple[SolePose, SolePose] | None = None
        self._flat_stance = WALKS[p.walk].flat_stance
        self._bias_jump = GyroBiasJump()
        self._lifted = False
        self._fall = FallDetector()
        self._tipping = TippingDetector()
        self._lying = LyingSideDetector()
        self._yaw_over_sole = YawOverSole()
        self._has_yaw_gyro = yaw_gyro
        self._slip_from_yaw_gyro = YawSlipFromYawGyro()
        self._slip_from_lean = YawSlipFromLean()
        self._unseen_slip = UnseenYawSlip()
        self._off_feet = YawOffFeet()
        self._support = 0
        self._blocked = BlockedDetector()
        self._covariance = OdometryCovariance()
        self._levelling = levelling
        self._alignment = alignment
        self._ground = ground
        ground.restart()

    def keep_gyro_bias(self, before: "StateEstimator") -> None:
        """Begin with the bias of the gyro that was learned before a reset."""
        self._slip_from_yaw_gyro.keep_bias(before._slip_from_yaw_gyro)
        self._slip_from_lean.keep_bias(before._slip_from_lean)

    def set_parameters(self, parameters: GaitParameters) -> None:
        """Change the parameters between two ticks."""
        p = self._p = parameters
        self.orientation.set_stance_time(p.stance_time)

    def begin(self, frame: SensorFrame) -> tuple[bool, bool]:
        """Initialise the orientation with the first frame.

        Returns:
            Whether it shows a robot that lies, and whether one that is upright and does not fall.
        """
        force, rate = as_point(frame.linear_acceleration), as_point(frame.angular_velocity)
        off, turn = abs(hypot(*force) - GRAVITY), hypot(rate[0], rate[1])
        tilt = atan2(hypot(force[0], force[1]), force[2])
        at_rest = off < REST_FORCE and turn < REST_RATE
        if at_rest:
            self.orientation.reset(force)
        else:
            self.orientation.reset_moving(force)
        sways = off < SWAY_FORCE and turn < SWAY_RATE
        return at_rest and tilt > LYING_TILT, sways and tilt < UPRIGHT_TILT

    def update(
        self,
        frame: SensorFrame,
        expected: Expectation,
        state: GaitState,
        dt: float,
        *,
        settled: bool,
    ) -> None:
        """One tick.

        Args:
            frame: Sensors of one instant.
            expected: Support leg at this instant, and where the walk has its sole.
            state: Mode of the gait.
            dt: Time [s] since the last frame; more than a period if frames were lost.
            settled: The robot stands in its stand pose.
        """
        self._dt, gyro_dt = dt, min(dt, GAP_MAX)
        support = expected.support
        com = self._body.set_joints(frame.joint_position)
        sole = self._body.sole_in_torso(support)
        other = self._body.sole_in_torso(-support)
        self._soles = (sole, other) if support == LEFT else (other, sole)
        force = as_point(frame.linear_acceleration)
        rate = self._mean_rate(frame)
        self._lifted = state is LIFTED
        feet_free = state in IN_MOTION or state in DOWN or self._lifted
        after_loss = frame.mean_angular_velocity is not None or dt > self._period

        self._update_orientation(
            rate, force, None if feet_free else sole.normal, state, gyro_dt, after_loss
        )
        level = level_frame(sole, self.orientation.up_in_torso)
        com_in_sole, force_in_sole = level.coordinates(com), level.components(force)
        self.com_in_q = measured_com_in_q(com_in_sole, expected.sole_in_q)
        self.acceleration_in_q = measured_acceleration_in_q(force_in_sole, expected.sole_in_q)
        self._find_ground(support, sole, com_in_sole, force_in_sole, state)
        if settled:
            left, right = self._soles
            self._alignment.update(rate, force, left.normal, right.normal, gyro_dt)
        else:
            self._alignment.restart()
        if state is WALK and self._p.level_soles and self._p.feedback:
            self._levelling.update(
                support, sole, com_in_sole, force_in_sole, level.torso_yaw, rate,
                self.odometry.velocity, gyro_dt,
            )  # fmt: skip
        else:
            self._levelling.pause()
        if state is not WALK or after_loss:
            self._blocked.restart()  # lost messages make steps fall short too
        if not feet_free:
            self._update_odometry(expected, sole, other, level, rate, settled)
            return
        # A kick turns the robot on its foot, which only a yaw gyro sees.
        if state is not MOTION or self._has_yaw_gyro:
            up = self.orientation.up_in_torso
            self.odometry.hold(self._off_feet.update(up, rate, gyro_dt))
        self._yaw_over_sole.interrupt()

    def _update_orientation(
        self, rate: Point3, force: Point3, stance_normal: Point3 | None, state: GaitState,
        dt: float, after_loss: bool,
    ) -> None:  # fmt: skip
        """The vertical by gyro, accelerometer and, if a foot stands flat, its normal."""
        if state is not WALK:
            # A fall or a shove looks like a bias too, and a walk that begins with one falls.
            self._bias_jump = GyroBiasJump()
        if stance_normal is None:
            # The feet need not stand flat, so they say nothing about the torso.
            self.orientation.update(rate, force, None, dt)
            self.lying_side = self._lying.update(force, dt)
            return
        # Not every robot has a yaw gyro; the odometry contains the torso's yaw rate.
        turning = (rate[0], rate[1], self.odometry.velocity[2])
        x, y, z = stance_normal
        stance_normal = x - self._ground.stance, y, z
        self.orientation.update(turning, force, stance_normal, dt)
        if state is WALK and self._p.feedback and self._flat_stance:
            self._find_bias_jump(stance_normal, force, dt, after_loss)

    def _find_ground(
        self, support: int, sole: SolePose, com_in_sole: Point3, force_in_sole: Point3,
        state: GaitState,
    ) -> None:  # fmt: skip
        """The tilt of the ground under a flat stance sole."""
        p = self._p
        follows = self._flat_stance and p.feedback and p.follow_ground
        if not follows or state is not WALK or self._dt > GAP_MAX:
            self._ground.restart()
            return
        pitch = sole.normal[0] - self.orientation.up_in_torso[0]
        zmp = com_in_sole[0] - com_in_sole[2] * force_in_sole[0] / GRAVITY
        self._ground.update(support, pitch, zmp, self._bias_jump.widening, self._dt)

    def _update_odometry(
        self, expected: Expectation, sole: SolePose, other: SolePose, level: LevelFrame,
        rate: Point3, settled: bool,
    ) -> None:  # fmt: skip
        """The pose by the feet; what they do not see of turns, by the gyro."""
        support = expected.support
        self._off_feet.interrupt()
        over_sole = self._yaw_over_sole.update(support, level, other)
        velocity, dt = self.odometry.velocity, self._dt
        gyro_dt = min(dt, GAP_MAX)
        if self._has_yaw_gyro:
            slip = self._slip_from_yaw_gyro.update(
                over_sole, level.up, rate, gyro_dt,
                at_rest=settled, quiet=self._alignment.time > 0.0,
            )  # fmt: skip
            if dt > GAP_MAX:
                slip = 0.0  # the joints turned over the whole gap, the gyro only over a part of it
        elif self._p.yaw_from_lean:
            slip = self._slip_from_lean.update(
                support, over_sole, sole.normal, level.up, rate[0], velocity[:2], gyro_dt,
                at_rest=settled,
            )  # fmt: skip
        else:
            slip = self._unseen_slip.update(over_sole, velocity, dt, at_rest=settled)
        self.odometry.update(support, level, other, dt, slip)
        if support != self._support:
            self._support = support
            sole_in_odom = self.odometry.support_sole_in_odom
            q_in_odom = compose(sole_in_odom, relative(ORIGIN, expected.sole_in_q))
            self._blocked.step(expected.wanted_step, q_in_odom)
            base = self.odometry.base_footprint_in_odom
            variance = self._yaw_slip.yaw_variance
            self._covariance.step(base, variance, blocked=self._blocked.way is not None)

    @property
    def pose_covariance(self) -> PoseCovariance:
        """Covariance of the odometry's pose, as of the last step."""
        return self._covariance.pose

    @property
    def blocked(self) -> Point2 | None:
        """Way, forward and to the left, in which the robot walks against something, or None."""
        return self._blocked.way

    @property
    def yaw_rate_variance(self) -> float:
        """Variance [rad^2/s^2] of the odometry's yaw rate."""
        return self._yaw_slip.rate_variance(self.odometry.velocity)

    @property
    def _yaw_slip(self) -> YawSlipFromYawGyro | YawSlipFromLean | UnseenYawSlip:
        if self._has_yaw_gyro:
            return self._slip_from_yaw_gyro
        return self._slip_from_lean if self._p.yaw_from_lean else self._unseen_slip

    @property
    def gyro_bias_sigma(self) -> float:
        """Standard deviation [rad/s] of the gyro's bias; 0 where the odometry does not use it."""
        slip = self._yaw_slip
        return 0.0 if isinstance(slip, UnseenYawSlip) else slip.bias_sigma

    @property
    def heading_drift_sigma(self) -> float:
        """Standard deviation [rad/s] of the drift by the gyro's bias of a heading that is held."""
        sigma = self.gyro_bias_sigma
        if self._has_yaw_gyro:
            return sigma
        return sigma / max(sin(self._p.torso_pitch + HEADING_LEAN), LEAN_SIGMA)

    def _mean_rate(self, frame: SensorFrame) -> Point3:
        """Gyro [rad/s] since the last frame; if nothing else is known, the mean of both ends."""
        rate = self._without_bias(as_point(frame.angular_velocity))
        last, self.angular_velocity = self.angular_velocity, rate
        if frame.mean_angular_velocity is not None:
            return self._without_bias(as_point(frame.mean_angular_velocity))
        if self._dt <= self._period:
            return rate
        return 0.5 * (last[0] + rate[0]), 0.5 * (last[1] + rate[1]), 0.5 * (last[2] + rate[2])

    def _without_bias(self, rate: Point3) -> Point3:
        roll, pitch = self._bias_jump.rate
        return rate if roll == pitch == 0.0 else (rate[0] - roll, rate[1] - pitch, rate[2])

    def _find_bias_jump(
        self, normal: Point3, force: Point3, dt: float, after_loss: bool
    ) -> None:
        x, y, _ = self.orientation.up_in_torso
        force_x, force_y = force[0] / GRAVITY - x, force[1] / GRAVITY - y
        sole = normal[0] - x, normal[1] - y
        velocity = self.odometry.velocity
        self._bias_jump.update(sole, (force_x, force_y), velocity, dt, after_loss=after_loss)

    @property
    def tilt(self) -> float:
        """Angle [rad] between the torso's z axis and the vertical."""
        return self.orientation.tilt

    def tilt_error(self, wanted_pitch: float) -> tuple[float, float]:
        """Roll and pitch [rad] beyond the wanted ones, predicted by the feedback delay."""
        p = self._p
        roll_rate, pitch_rate, _ = self.angular_velocity
        return (
            self.orientation.roll + p.feedback_delay * roll_rate,
            self.orientation.pitch + p.feedback_delay * pitch_rate - wanted_pitch,
        )

    def detect_fall(self) -> bool:
        """Whether a fall can no longer be prevented; call it at most once per tick."""
        return self._fall.update(
            self.orientation.up_in_torso,
            self.orientation.tilt,
            self.angular_velocity,
            0.0 if self._lifted else FALL_HORIZON,  # hands may turn it fast
        )

    def detect_tipping(self) -> tuple[float, float, float, float] | None:
        """CoM of a stand that tips, or None; call it once per tick of a stand.

        Returns:
            x, y [m] in Q and their velocities [m/s]; see `TippingDetector`.
        """
        p = self._p
        limit = p.stand_catch if p.feedback else 0.0
        return self._tipping.update(
            self.com_in_q, natural_frequency(p.pendulum_height), limit, self._dt
        )

    def reset_tipping(self) -> None:
        """Forget the rest position of the last stand."""
        self._tipping.reset()

    def reset_lying_side(self) -> None:
        """Wait again until the robot has come to rest."""
        self._lying.restart()

    def lies_after_motion(self) -> bool:
        """Whether a get-up has failed.

        Also resets the tilt to the accelerometer's: the gyro drifts in the fast turns of a get-up.
        """
        self.orientation.reset(self._lying.force)
        return self.orientation.tilt > GET_UP_TILT

    @property
    def feet_apart(self) -> float:
        """Distance [m] between the soles to the side, by the measured joint angles."""
        left, right = self.torso_place.left_sole, self.torso_place.right_sole
        return left.position[1] - right.position[1]

    @property
    def torso_place(self) -> TorsoPlace:
        """Torso and soles by the measured joint angles, for the head."""
        if self._soles is None:
            raise NaoGaitError("torso_pose", "no frame so far", "torso_pose after a step")
        left, right = self._soles
        return TorsoPlace(
            self.orientation.up_in_torso, left, right, self.odometry.base_footprint_in_odom
        )
