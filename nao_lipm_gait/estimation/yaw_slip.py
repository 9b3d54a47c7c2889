"""Yaw slip: the rotation of the support sole on the ground.

On a slippery floor the swing leg's moment turns the support foot. The joint angles tell how the
torso turns over its support sole (`YawOverSole`), but not how the sole turns on the ground. This
takes a gyro: either a yaw gyro (`YawSlipFromYawGyro`), or the roll gyro of a torso that leans
forward (`YawSlipFromLean`).
"""

from math import atan2, hypot, remainder, sqrt, tau

import numpy as np

from nao_lipm_gait.estimation.com_measurement import LevelFrame
from nao_lipm_gait.geometry import dot
from nao_lipm_gait.types import LEFT, FloatArray, Point3


class YawOverSole:
    """Change of the torso's yaw over its support sole, by the joint angles."""

    def __init__(self) -> None:
        self._support = 0
        self._yaw = 0.0

    def update(self, support: int, support_sole: LevelFrame) -> float | None:
        """One tick; support: `LEFT` or `RIGHT`.

        Returns:
            The torso's rotation [rad] since the last tick; None if the support has changed.
        """
        before, self._yaw = self._yaw, support_sole.torso_yaw
        if support != self._support:
            self._support = support
            return None
        return remainder(self._yaw - before, tau)


# -- by a yaw gyro ---------------------------------------------------------------------------------

BIAS_TIME = 1.0
"""Time constant [s] of the mean that learns the gyro's bias while the robot stands."""


class YawSlipFromYawGyro:
    """Yaw slip as the difference between the gyro's rotation and that over the sole."""

    def __init__(self) -> None:
        self._over_sole = YawOverSole()
        self._bias = 0.0

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        angular_velocity: Point3,
        dt: float,
        *,
        at_rest: bool,
    ) -> float:
        """One tick.

        Args:
            support: Support leg, `LEFT` or `RIGHT`.
            support_sole: Level frame of the support sole.
            angular_velocity: Gyro [rad/s] in the torso frame.
            dt: Time [s] since the last tick.
            at_rest: The robot stands still, so the gyro measures its bias.

        Returns:
            Rotation [rad] of the support sole since the last tick; 0 when the support changes.
        """
        rate = dot(angular_velocity, support_sole.up)
        if at_rest:
            self._bias += min(1.0, dt / BIAS_TIME) * (rate - self._bias)
        over_sole = self._over_sole.update(support, support_sole)
        if at_rest or over_sole is None:
            return 0.0
        return (rate - self._bias) * dt - over_sole


# -- by the roll gyro of a leaning torso -----------------------------------------------------------

BIAS_SIGMA = 0.005
"""Deviation [rad/s] of the gyro's bias before the robot has stood still."""
REST_SAMPLES = 50
"""Number of samples whose mean measures the bias at rest."""
REST_SPREAD = 0.03
"""Largest deviation [rad/s] of the samples of a robot at rest."""
REST_SHARE = 0.2
"""Error of their mean as a share of their deviation: a robot that has just stopped still rocks."""
REST_SIGMA_MIN = 1e-4
"""Smallest error [rad/s] of their mean."""
SLIP_SIGMA = 0.3
"""Deviation [rad/m] of the slip in a new walking direction; 6 deg/s at 35 cm/s."""
SLIP_MAX = 1.0
"""Largest slip [rad/m]: a jump of the gyro's bias must not make the robot walk in circles."""
ROLL_SIGMA = 0.004
"""Deviation [rad] of the mean roll by the joint angles, from stride to stride."""
UNKNOWN_ROLL_SIGMA = 0.1
"""Deviation [rad] of an unknown roll."""
PROCESS_NOISE = (0.001, 0.1, 1e-4)
"""Roll [rad/s^0.5], slip [rad/m/s^0.5], bias [rad/s/s^0.5]."""
GATE = 3.0
"""Deviations beyond which a measurement is an outlier: the robot tips or is moved."""
SPEED_MIN = 0.05
"""Speed [m/s] from which on a walk has a direction."""
MAIN_AXIS_RATIO = 1.5
"""The walking direction changes its axis once the other one is faster by this factor."""

_ROLL, _SLIP, _BIAS = range(3)
_BIAS_ROW = np.array((0.0, 0.0, 1.0))


class YawSlipFromLean:
    """Steady yaw slip from the roll gyro of a torso that leans forward.

    With roll phi, pitch theta and yaw psi of the torso (REP-103), the roll gyro measures

        omega_x = phi' - psi' sin(theta) + bias

    so a torso that leans measures a share of its yaw rate. Over a stride the roll comes back to
    where it was, which the joint angles tell: roll and pitch are taken over the support sole, so
    that a slope has no influence. The bias is learned while the robot stands. What then remains
    over a stride is a rotation that the joint angles do not contain: the yaw slip.

    A Kalman filter with one measurement per stride separates the three:

        x = (phi, c, bias), c [rad/m]: yaw slip per walked distance
        phi(t) = phi + integral (omega_x + (psi'_joints + c |v|) sin(theta) - bias) dt
        z = mean over the stride of the torso's roll over its sole, expected: the mean of phi(t)

    Means are used because the roll at one moment depends on when in the sway the support changes.
    It takes some strides to find a steady slip. A single slip, or the slip of an upright torso, is
    not observable.
    """

    def __init__(self) -> None:
        self._over_sole = YawOverSole()
        self._over_sole_rate = 0.0
        self._rest_samples: list[float] = []
        self._rejected_bias: float | None = None
        self._walking = False
        self._direction: tuple[str, bool] | None = None
        self._stride = _Stride()
        self._state = np.zeros(3)
        self._covariance = np.diag([0.0, 0.0, BIAS_SIGMA**2])

    @property
    def bias_sigma(self) -> float:
        """Standard deviation [rad/s] of the learned bias."""
        return sqrt(max(0.0, float(self._covariance[_BIAS, _BIAS])))

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        sole_normal: Point3,
        roll_rate: float,
        velocity: tuple[float, float],
        dt: float,
        *,
        at_rest: bool,
    ) -> float:
        """One tick.

        Args:
            support: Support leg, `LEFT` or `RIGHT`.
            support_sole: Level frame of the support sole.
            sole_normal: Unit z axis of the support sole in the torso frame.
            roll_rate: Gyro [rad/s] about the torso's x axis.
            velocity: Velocity [m/s] by odometry, forward and left.
            dt: Time [s] since the last tick.
            at_rest: The robot stands still, so the gyro measures its bias.

        Returns:
            Steady rotation [rad] of the support sole since the last tick.
        """
        over_sole = self._over_sole.update(support, support_sole)
        if at_rest:
            self._walking = False
            self._learn_bias(roll_rate, dt)
            return 0.0
        self._rest_samples.clear()
        self._begin_walk(velocity)
        if over_sole is not None:
            self._over_sole_rate = over_sole / dt
        elif support == LEFT:
            self._end_stride()
        x, y, z = sole_normal
        lean, speed = -x, hypot(*velocity)
        self._stride.add(roll_rate + self._over_sole_rate * lean, lean * speed, atan2(y, z), dt)
        return float(self._state[_SLIP]) * speed * dt

    def _learn_bias(self, roll_rate: float, dt: float) -> None:
        self._covariance[_BIAS, _BIAS] += PROCESS_NOISE[_BIAS] ** 2 * dt
        self._rest_samples.append(roll_rate)
        if len(self._rest_samples) < REST_SAMPLES:
            return
        mean, spread = float(np.mean(self._rest_samples)), float(np.std(self._rest_samples))
        self._rest_samples.clear()
        if spread > REST_SPREAD:
            return
        sigma = max(REST_SHARE * spread, REST_SIGMA_MIN)
        if self._is_outlier(_BIAS_ROW, mean - self._state[_BIAS], sigma):
            before, self._rejected_bias = self._rejected_bias, mean
            if before is None or abs(mean - before) > GATE * sqrt(2.0) * sigma:
                return
            # The same outlier twice: the bias has changed, the robot is not being moved.
            self._forget(_BIAS, abs(mean))
        self._rejected_bias = None
        self._correct(_BIAS_ROW, mean - self._state[_BIAS], sigma)

    def _begin_walk(self, velocity: tuple[float, float]) -> None:
        """Forget the roll when a walk begins, and the slip when its direction changes."""
        if not self._walking:
            self._walking = True
            self._stride = _Stride()
            self._over_sole_rate = 0.0
            self._forget(_ROLL, UNKNOWN_ROLL_SIGMA)
        x, y = velocity
        if hypot(x, y) < SPEED_MIN:
            return
        along_x = abs(x) > abs(y) if self._direction is None else self._direction[0] == "x"
        if max(abs(x), abs(y)) > MAIN_AXIS_RATIO * min(abs(x), abs(y)):
            along_x = abs(x) > abs(y)
        direction = ("x", x > 0.0) if along_x else ("y", y > 0.0)
        if direction != self._direction:
            self._direction = direction
            self._forget(_SLIP, SLIP_SIGMA)

    def _end_stride(self) -> None:
        """Correct by the mean roll of the stride, and predict the state at its end."""
        stride, self._stride = self._stride, _Stride()
        if stride.time == 0.0:
            return
        rolled, leaned, time, roll = stride.means()
        row = np.array((1.0, leaned, -time))
        innovation = roll - rolled - float(row @ self._state)
        if self._is_outlier(row, innovation, ROLL_SIGMA):
            innovation += self._state[_ROLL]
            self._forget(_ROLL, UNKNOWN_ROLL_SIGMA)
        self._correct(row, innovation, ROLL_SIGMA)
        change = np.array(((1.0, stride.leaned, -stride.time), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
        self._state = change @ self._state
        self._state[_ROLL] += stride.rolled
        self._state[_SLIP] = min(max(self._state[_SLIP], -SLIP_MAX), SLIP_MAX)
        noise = np.diag(np.square(PROCESS_NOISE) * stride.time)
        self._covariance = change @ self._covariance @ change.T + noise

    def _is_outlier(self, row: FloatArray, innovation: float, sigma: float) -> bool:
        return abs(innovation) > GATE * sqrt(float(row @ self._covariance @ row) + sigma**2)

    def _correct(self, row: FloatArray, innovation: float, sigma: float) -> None:
        gain = self._covariance @ row / (row @ self._covariance @ row + sigma**2)
        self._state = self._state + gain * innovation
        self._covariance = self._covariance - np.outer(gain, row @ self._covariance)

    def _forget(self, index: int, sigma: float) -> None:
        """Reset one state to 0 with the deviation `sigma`."""
        self._state[index] = 0.0
        self._covariance[index] = self._covariance[:, index] = 0.0
        self._covariance[index, index] = sigma**2


class _Stride:
    """Sums over a stride, from one step on the left foot to the next.

    Attributes:
        time: Time [s] since the stride began.
        rolled: Roll [rad] by gyro and joint angles, without bias and slip.
        leaned: Walked distance [m] times the sine of the lean.
    """

    def __init__(self) -> None:
        self.time = 0.0
        self.rolled = 0.0
        self.leaned = 0.0
        self._sums = [0.0, 0.0, 0.0, 0.0]
        self._ticks = 0

    def add(self, roll_rate: float, lean_speed: float, roll: float, dt: float) -> None:
        """One tick.

        Args:
            roll_rate: Derivative [rad/s] of `rolled`.
            lean_speed: Derivative [m/s] of `leaned`.
            roll: Roll [rad] by the joint angles.
            dt: Time [s] since the last tick.
        """
        self.time += dt
        self.rolled += roll_rate * dt
        self.leaned += lean_speed * dt
        for i, value in enumerate((self.rolled, self.leaned, self.time, roll)):
            self._sums[i] += value
        self._ticks += 1

    def means(self) -> tuple[float, float, float, float]:
        """Means over the ticks of rolled, leaned, time and the roll by the joint angles."""
        rolled, leaned, time, roll = (total / self._ticks for total in self._sums)
        return rolled, leaned, time, roll
