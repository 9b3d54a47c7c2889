"""Yaw slip: the rotation of the support sole on the ground.

On a slippery floor the swing leg's moment turns the support foot. The joint angles tell how the
torso turns over its support sole (`YawOverSole`), but not how the sole turns on the ground. This
takes a gyro: either a yaw gyro (`YawSlipFromYawGyro`), or the roll gyro of a torso that leans
forward (`YawSlipFromLean`). Without both it is unknown (`UnseenYawSlip`).

Each of them has a `yaw_variance` [rad^2], that of the odometry's heading since the start, and a
`rate_variance` [rad^2/s^2], that of its yaw rate.
"""

from math import hypot, remainder, sqrt, tau

from nao_lipm_gait.estimation.com_measurement import LevelFrame
from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.types import Point3, Pose2


class YawOverSole:
    """Change of the torso's yaw over its support sole, by the joint angles."""

    def __init__(self) -> None:
        self._support = 0
        self._yaw = 0.0

    def update(self, support: int, support_sole: LevelFrame, other_sole: SolePose) -> float:
        """One tick.

        Args:
            support: Support leg, `LEFT` or `RIGHT`.
            support_sole: Level frame of the support sole.
            other_sole: The other sole in the torso frame.

        Returns:
            The torso's rotation [rad] since the last tick over the support sole of the last tick; 0
            in the first tick.
        """
        last_support, self._support = self._support, support
        before, yaw = self._yaw, support_sole.torso_yaw
        self._yaw = yaw
        if last_support == 0:
            return 0.0
        if support != last_support:
            yaw -= support_sole.pose_of(other_sole)[2]
        return remainder(yaw - before, tau)

    def interrupt(self) -> None:
        """The feet have moved in an unknown way; begin again with the next tick."""
        self._support = 0


# -- by a yaw gyro ---------------------------------------------------------------------------------

UPRIGHT_MIN = 0.01
"""Smallest squared cosine of the pitch; the yaw of a torso that points at the sky is undefined."""
BIAS_TIME = 10.0
"""Time [s] of rest over which the bias is the mean of the gyro."""
BIAS_SIGMA = 0.005
"""Deviation [rad/s] of the bias before the robot has stood still."""
SAMPLE_NOISE = 1.5e-3
"""Deviation [rad/s^0.5] of the gyro's integral: three times that of 0.005 rad/s in each of 100
samples a second, so that a wait for the bias ends with a drift of 1 deg a minute."""
YAW_GYRO_NOISE = 0.004
"""Deviation [rad/s^0.5] of the heading by a yaw gyro."""
YAW_GYRO_RATE_SIGMA = 0.01
"""Deviation [rad/s] of the yaw rate by a yaw gyro."""


class YawSlipFromYawGyro:
    """Yaw slip as the difference between the gyro's rotation and that over the sole.

    Attributes:
        yaw_variance: Variance [rad^2] of the heading since the start.
    """

    def __init__(self) -> None:
        self.yaw_variance = 0.0
        self._bias = 0.0
        self._rest_time = 0.0

    def keep_bias(self, before: "YawSlipFromYawGyro") -> None:
        """Begin with the bias that was learned before a reset: it belongs to the sensor."""
        self._bias, self._rest_time = before._bias, before._rest_time

    def update(
        self,
        over_sole: float,
        up: Point3,
        angular_velocity: Point3,
        dt: float,
        *,
        at_rest: bool,
        quiet: bool,
    ) -> float:
        """One tick.

        Args:
            over_sole: The torso's rotation [rad] over its support sole since the last tick.
            up: Unit vertical in the torso frame.
            angular_velocity: Gyro [rad/s] in the torso frame.
            dt: Time [s] since the last tick.
            at_rest: The robot stands.
            quiet: It has also stopped rocking, so the gyro measures its bias.

        Returns:
            Rotation [rad] of the support sole since the last tick.
        """
        # The derivative of the yaw angle (REP-103). The rate about the vertical would also contain
        # roll rate times pitch, whose mean over a stride is not 0.
        _, y, z = up
        rate = (angular_velocity[1] * y + angular_velocity[2] * z) / max(y * y + z * z, UPRIGHT_MIN)
        if quiet:
            self._rest_time = min(self._rest_time + dt, BIAS_TIME)
            self._bias += dt / self._rest_time * (rate - self._bias)
        if at_rest:
            return 0.0
        self.yaw_variance += YAW_GYRO_NOISE**2 * dt
        return (rate - self._bias) * dt - over_sole

    @property
    def bias_sigma(self) -> float:
        """Standard deviation [rad/s] of the learned bias."""
        if self._rest_time <= 0.0:
            return BIAS_SIGMA
        return min(BIAS_SIGMA, SAMPLE_NOISE / sqrt(self._rest_time))

    def rate_variance(self, velocity: Pose2) -> float:
        """Variance [rad^2/s^2] of the yaw rate; velocity: by odometry [m/s, m/s, rad/s]."""
        return YAW_GYRO_RATE_SIGMA**2


# -- without a gyro --------------------------------------------------------------------------------

UNSEEN_SLIP_SIGMA = 0.3
"""Deviation [rad/m] of a yaw slip that is not measured; 6 deg/s at 35 cm/s."""
UNSEEN_SLIP_NOISE = 0.2
"""The same over a longer way [rad/m^0.5]."""
UNSEEN_TURN_SIGMA = 0.05
"""Deviation of the slip of a turn as a share of its yaw rate."""
UNSEEN_TURN_NOISE = 0.1
"""The same over a longer turn [rad/rad^0.5]."""


def unseen_yaw_variance(turned: float, walked: float) -> float:
    """Variance [rad^2] of a yaw slip that is not measured; turned [rad], walked [m]."""
    return UNSEEN_TURN_NOISE**2 * abs(turned) + UNSEEN_SLIP_NOISE**2 * walked


def unseen_rate_variance(velocity: Pose2, slip_sigma: float = UNSEEN_SLIP_SIGMA) -> float:
    """Variance [rad^2/s^2] of a yaw rate that is not measured.

    Args:
        velocity: Velocity by odometry [m/s, m/s, rad/s].
        slip_sigma: Deviation [rad/m] of the yaw slip.
    """
    x, y, yaw = velocity
    return slip_sigma**2 * (x * x + y * y) + (UNSEEN_TURN_SIGMA * yaw) ** 2


class UnseenYawSlip:
    """No yaw slip, and how far the heading may be off because of it.

    Attributes:
        yaw_variance: Variance [rad^2] of the heading since the start.
    """

    def __init__(self) -> None:
        self.yaw_variance = 0.0

    def update(self, over_sole: float, velocity: Pose2, dt: float, *, at_rest: bool) -> float:
        """One tick.

        Args:
            over_sole: The torso's rotation [rad] over its support sole since the last tick.
            velocity: Velocity by odometry [m/s, m/s, rad/s].
            dt: Time [s] since the last tick.
            at_rest: The robot stands still.

        Returns:
            0.
        """
        if not at_rest:
            walked = hypot(velocity[0], velocity[1]) * dt
            self.yaw_variance += unseen_yaw_variance(over_sole, walked)
        return 0.0

    def rate_variance(self, velocity: Pose2) -> float:
        """Variance [rad^2/s^2] of the yaw rate; velocity: by odometry [m/s, m/s, rad/s]."""
        return unseen_rate_variance(velocity)
