"""Yaw slip without a yaw gyro: by the roll gyro of a torso that leans forward."""

from math import atan2, exp, hypot, sqrt

import numpy as np

from nao_lipm_gait.estimation.yaw_slip import (
    BIAS_SIGMA,
    UNSEEN_SLIP_SIGMA,
    unseen_rate_variance,
    unseen_yaw_variance,
)
from robot_core.types import LEFT, FloatArray, Point3, Pose2

HEADING_LEAN = 0.12
"""Additional lean [rad] of the torso for this measurement, while a heading is held."""
REST_SAMPLES = 50
"""Number of samples whose mean measures the bias at rest."""
REST_SPREAD = 0.03
"""Largest deviation [rad/s] of the samples of a robot at rest."""
REST_SHARE = 0.15
"""Error of their mean as a share of their deviation; 1 / sqrt(samples) is that of white noise."""
REST_SIGMA_MIN = 1e-4
"""Smallest error [rad/s] of their mean."""
ROCKING_SIGMA = 0.02
"""Deviation [rad/s] of the mean roll rate of a robot that begins to stand."""
ROCKING_TIME = 0.3
"""Time constant [s] with which that roll rate decays."""
ROLL_SIGMA = 0.002
"""Deviation [rad] of the mean roll by the joint angles, from stride to stride."""
START_SIGMA = 0.004
"""The same [rad] in the first strides of a direction, whose sway is not yet symmetric."""
START_TIME = 1.5
"""Duration [s] of the first strides."""
STAND_SIGMA = 0.006
"""Deviation [rad] of the mean roll of a walk from the roll of a stand."""
DIRECTION_SIGMA = 0.006
"""Deviation [rad] between the mean rolls of two walking directions."""
UNKNOWN_ROLL_SIGMA = 0.1
"""Deviation [rad] of an unknown roll."""
PROCESS_NOISE = (0.0015, 0.05, 2e-5)
"""Roll [rad/s^0.5], slip [rad/m/s^0.5], bias [rad/s/s^0.5]."""
YAW_NOISE = 0.02
"""Yaw [rad/s^0.5] by slip that is not steady; it also shows in the roll."""
LEAN_SIGMA = 0.02
"""Deviation [rad] of the measured lean, by joint zero errors and the mounting of the IMU."""
YAW_RATE_ERROR_MAX = 0.02
"""Largest error [rad/s] by `LEAN_SIGMA` of a yaw rate that is measured."""
SLIP_MAX = 1.0
"""Largest slip [rad/m]: a jump of the gyro's bias must not make the robot walk in circles."""
RELEASE_RATE = 0.15
"""Largest rate [rad/s] at which the heading is corrected by what was learned late."""
GATE = 3.0
"""Deviations beyond which a measurement is an outlier: the robot tips or is moved."""
SPEED_MIN = 0.05
"""Speed [m/s] from which on a walk has a direction."""
SCRUB_SPEED, SWING_SPEED = 0.25, 0.45
"""Speed [m/s] up to which the feet slip only when the support changes, and from which on the swing
leg turns the support foot in the whole step, by simulated robots."""
MAIN_AXIS_RATIO = 1.5
"""The walking direction changes its axis once the other one is faster by this factor."""

_ROLL, _SLIP, _BIAS, _YAW = range(4)
_ROLL_ROW = np.array((1.0, 0.0, 0.0, 0.0))
_BIAS_ROW = np.array((0.0, 0.0, 1.0, 0.0))


class YawSlipFromLean:
    """Yaw slip from the roll gyro of a torso that leans forward.

    With roll phi, pitch theta and yaw psi of the torso (REP-103), the roll gyro measures

        omega_x = phi' - psi' sin(theta) + bias

    so a torso that leans measures a share of its yaw rate. Over a stride the roll comes back to
    where it was, which the joint angles tell: roll and pitch are taken over the support sole, so
    that a slope has no influence. What then remains is a rotation that the joint angles do not
    contain: the yaw slip. A Kalman filter with one measurement per stride estimates

        x = (phi, c, bias, e)    c [rad/m]: yaw slip per walked distance
                                 e [rad]: yaw slip that the odometry does not contain yet
        phi(t) = phi + integral (omega_x + (psi'_joints + c |v|) sin(theta) - bias) dt
        e(t) = e + integral (c |v| - what the odometry was turned by) dt
        z = mean over the stride of the torso's roll over its sole, expected: the mean of phi(t)

    Means are used because the roll at one moment depends on when in the sway the support changes.
    Slip that is not steady is noise of e and, times sin(theta), of phi, so that slip that is found
    late corrects the heading back. The bias is learned at rest; its error b turns the odometry by
    b / sin(theta).

    A stride is not measured if it turns too fast for its lean: an error d of the lean looks like
    the yaw slip d psi' / sin(theta). Its slip counts as 0, and the variance of e grows instead.
    """

    def __init__(self) -> None:
        self._support = 0
        self._rest = _Rest()
        self._rejected_bias: float | None = None
        self._walks = self._has_walked = False
        self._start_time = 0.0
        self._direction: tuple[str, bool] | None = None
        self._stride = _Stride()
        self._whole_stride = False
        self._seen = True
        self._outlier = 0.0
        self._state = np.zeros(4)
        self._covariance = np.diag(
            [UNKNOWN_ROLL_SIGMA**2, UNSEEN_SLIP_SIGMA**2, BIAS_SIGMA**2, 0.0]
        )

    def keep_bias(self, before: "YawSlipFromLean") -> None:
        """Begin with the bias that was learned before a reset: it belongs to the sensor."""
        self._forget(_BIAS, float(before._state[_BIAS]), before.bias_sigma)

    @property
    def bias_sigma(self) -> float:
        """Standard deviation [rad/s] of the learned bias."""
        return sqrt(max(0.0, float(self._covariance[_BIAS, _BIAS])))

    @property
    def yaw_variance(self) -> float:
        """Variance [rad^2] of the heading since the start, as of the last stride."""
        return max(0.0, float(self._covariance[_YAW, _YAW]))

    def rate_variance(self, velocity: Pose2) -> float:
        """Variance [rad^2/s^2] of the yaw rate; velocity: by odometry [m/s, m/s, rad/s]."""
        if not self._seen:
            return unseen_rate_variance(velocity)
        slip = max(0.0, float(self._covariance[_SLIP, _SLIP]))
        return unseen_rate_variance(velocity, sqrt(slip))

    def update(
        self,
        support: int,
        over_sole: float,
        sole_normal: Point3,
        up: Point3,
        roll_rate: float,
        velocity: tuple[float, float],
        dt: float,
        *,
        at_rest: bool,
    ) -> float:
        """One tick.

        Args:
            support: Support leg, `LEFT` or `RIGHT`.
            over_sole: The torso's rotation [rad] over its support sole since the last tick.
            sole_normal: Unit z axis of the support sole in the torso frame.
            up: Unit vertical in the torso frame.
            roll_rate: Gyro [rad/s] about the torso's x axis.
            velocity: Velocity [m/s] by odometry, forward and left.
            dt: Time [s] since the last tick.
            at_rest: The robot stands still, so the gyro measures its bias.

        Returns:
            Rotation [rad] of the odometry: the slip since the last tick, and slip found late.
        """
        changed, self._support = support != self._support, support
        x, y, z = sole_normal
        roll, steady = atan2(y, z), 0.0
        if at_rest:
            if self._walks:
                self._end_walk()
            if self._rest.add(roll_rate, roll, dt):
                self._end_rest_samples()
        else:
            if not self._walks:
                self._begin_walk()
            self._follow_direction(velocity)
            if changed and support == LEFT:
                self._end_stride()
            speed = hypot(*velocity)
            if self._seen:
                steady = float(self._state[_SLIP]) * speed * dt
            self._start_time += dt
            self._stride.add(
                changed, roll_rate, over_sole, -x, -up[0], speed * dt, steady, roll, dt
            )
        limit = RELEASE_RATE * dt
        late = min(max(float(self._state[_YAW]), -limit), limit)
        self._state[_YAW] -= late
        return steady + late

    # -- at rest -----------------------------------------------------------------------------------

    def _end_rest_samples(self) -> None:
        """Learn the bias, and after a walk the roll."""
        rest = self._rest
        rocking = ROCKING_SIGMA * exp(-rest.time / ROCKING_TIME)
        self._covariance[_BIAS, _BIAS] += PROCESS_NOISE[_BIAS] ** 2 * rest.sampled_time
        mean, spread, roll = rest.take()
        if spread > REST_SPREAD:
            return
        if rest.roll is None and self._has_walked:
            self._correct(_ROLL_ROW, roll - self._state[_ROLL], STAND_SIGMA)
        rest.roll = roll
        sigma = hypot(max(REST_SHARE * spread, REST_SIGMA_MIN), rocking)
        if self._is_outlier(_BIAS_ROW, mean - self._state[_BIAS], sigma):
            before, self._rejected_bias = self._rejected_bias, mean
            if before is None or abs(mean - before) > GATE * sqrt(2.0) * sigma:
                return
            # The same outlier twice: the bias has changed, the robot is not being moved.
            self._forget(_BIAS, 0.0, abs(mean))
        self._rejected_bias = None
        self._correct(_BIAS_ROW, mean - self._state[_BIAS], sigma)

    # -- walking -----------------------------------------------------------------------------------

    def _begin_walk(self) -> None:
        """Begin with the roll of the stand."""
        roll = self._rest.roll
        self._forget(_ROLL, roll or 0.0, UNKNOWN_ROLL_SIGMA if roll is None else STAND_SIGMA)
        self._walks, self._has_walked, self._start_time = True, True, 0.0
        self._stride, self._whole_stride = _Stride(), False
        self._seen = True

    def _end_walk(self) -> None:
        self._whole_stride = False
        self._end_stride()
        self._walks = False
        self._rest = _Rest()

    def _follow_direction(self, velocity: tuple[float, float]) -> None:
        """Forget the slip when the walking direction changes."""
        x, y = velocity
        if hypot(x, y) < SPEED_MIN:
            return
        along_x = abs(x) > abs(y) if self._direction is None else self._direction[0] == "x"
        if max(abs(x), abs(y)) > MAIN_AXIS_RATIO * min(abs(x), abs(y)):
            along_x = abs(x) > abs(y)
        direction = ("x", x > 0.0) if along_x else ("y", y > 0.0)
        if direction != self._direction:
            self._direction = direction
            self._forget(_SLIP, 0.0, UNSEEN_SLIP_SIGMA)
            self._covariance[_ROLL, _ROLL] += DIRECTION_SIGMA**2
            self._start_time = 0.0

    def _end_stride(self) -> None:
        """Correct by the mean roll of a whole stride, and predict the state at its end."""
        stride, self._stride = self._stride, _Stride()
        whole, self._whole_stride = self._whole_stride, True
        if stride.time == 0.0:
            return
        turned = abs(stride.turned)
        # While a heading is held, the joints turn against the slip and the torso does not turn.
        turns = min(turned, abs(stride.turned + stride.steady_slip))
        self._seen = LEAN_SIGMA * turns < YAW_RATE_ERROR_MAX * stride.lean * stride.time
        if whole and self._seen:
            self._measure(stride)
        lean = stride.slip_lean
        walked = stride.walked if self._seen else 0.0
        state, covariance = self._state, self._covariance
        change = np.array(
            (
                (1.0, walked * lean, -stride.time, 0.0),
                (0.0, 1.0, 0.0, 0.0),
                (0.0, 0.0, 1.0, 0.0),
                (0.0, walked, 0.0, 1.0),
            )
        )
        state = change @ state
        state[_ROLL] += stride.rolled
        state[_YAW] -= stride.steady_slip
        state[_SLIP] = min(max(state[_SLIP], -SLIP_MAX), SLIP_MAX)
        roll, slip, bias = np.square(PROCESS_NOISE) * stride.time
        yaw = YAW_NOISE**2 * stride.time
        noise = np.diag((roll + lean * lean * yaw, slip, bias, yaw))
        noise[_ROLL, _YAW] = noise[_YAW, _ROLL] = lean * yaw
        if not self._seen:
            noise[_ROLL, _ROLL] += LEAN_SIGMA**2 * turned
            noise[_YAW, _YAW] += unseen_yaw_variance(turned, stride.walked)
        self._state, self._covariance = state, change @ covariance @ change.T + noise

    def _measure(self, stride: "_Stride") -> None:
        """Correct by the mean roll; a single outlier counts less."""
        rolled, walked, time, roll = stride.means()
        row = np.array((1.0, walked * stride.slip_lean, -time, 0.0))
        sigma = ROLL_SIGMA
        if self._start_time < START_TIME:
            sigma = hypot(sigma, START_SIGMA)
        innovation = roll - rolled - float(row @ self._state)
        before, self._outlier = self._outlier, 0.0
        if self._is_outlier(row, innovation, sigma):
            self._outlier = innovation
            if before * innovation > 0.0:
                # Twice in a row: the robot has tipped or was moved, or the slip is wrong.
                innovation += self._state[_ROLL]
                self._forget(_ROLL, 0.0, UNKNOWN_ROLL_SIGMA)
                self._forget(_SLIP, float(self._state[_SLIP]), UNSEEN_SLIP_SIGMA)
            else:
                sigma = abs(innovation) / GATE
        self._correct(row, innovation, sigma)

    # -- Kalman filter -----------------------------------------------------------------------------

    def _is_outlier(self, row: FloatArray, innovation: float, sigma: float) -> bool:
        return abs(innovation) > GATE * sqrt(float(row @ self._covariance @ row) + sigma**2)

    def _correct(self, row: FloatArray, innovation: float, sigma: float) -> None:
        gain = self._covariance @ row / (row @ self._covariance @ row + sigma**2)
        self._state = self._state + gain * innovation
        self._covariance = self._covariance - np.outer(gain, row @ self._covariance)

    def _forget(self, index: int, value: float, sigma: float) -> None:
        """Reset one state to a value with the deviation `sigma`."""
        self._state[index] = value
        self._covariance[index] = self._covariance[:, index] = 0.0
        self._covariance[index, index] = sigma**2


class _Rest:
    """Samples of the roll gyro and of the roll over the support sole, since a stand began.

    Attributes:
        time: Time [s] until the present samples began.
        sampled_time: Time [s] of the present samples.
        roll: Mean roll [rad] of the last samples; None before the first.
    """

    def __init__(self) -> None:
        self.time = self.sampled_time = 0.0
        self.roll: float | None = None
        self._rates: list[float] = []
        self._rolls = 0.0

    def add(self, rate: float, roll: float, dt: float) -> bool:
        """Add a sample, roll rate [rad/s] and roll [rad]; returns whether they are complete."""
        self._rates.append(rate)
        self._rolls += roll
        self.sampled_time += dt
        return len(self._rates) >= REST_SAMPLES

    def take(self) -> tuple[float, float, float]:
        """Mean and deviation of the rate [rad/s], mean roll [rad]; begins new samples."""
        rates, rolls = self._rates, self._rolls
        self._rates, self._rolls = [], 0.0
        self.time += self.sampled_time
        self.sampled_time = 0.0
        return float(np.mean(rates)), float(np.std(rates)), rolls / len(rates)


class _Stride:
    """Sums over a stride, from one step on the left foot to the next.

    The lean within a stride is that of the torso against gravity, because the sole tilts on the
    ground while the torso turns over it; its mean is the lean over the soles. Slow feet slip when
    the support changes and both carry the robot; the lean at that moment is less than the mean.

    Attributes:
        time: Time [s] since the stride began.
        walked: Walked distance [m].
        turned: Rotation [rad] of the torso over its support soles.
        steady_slip: Yaw slip [rad] that the odometry was turned by.
    """

    __slots__ = (
        "_change_lean", "_changes", "_roll_sum", "_rolled", "_rolled_sum", "_sole_lean", "_ticks",
        "_time_sum", "_turned_sum", "_up_lean", "_walked_sum", "steady_slip", "time", "turned",
        "walked",
    )  # fmt: skip

    def __init__(self) -> None:
        self.time = self.walked = self.steady_slip = 0.0
        self._rolled = self.turned = self._sole_lean = self._up_lean = 0.0
        self._rolled_sum = self._turned_sum = self._walked_sum = 0.0
        self._time_sum = self._roll_sum = self._change_lean = 0.0
        self._ticks = self._changes = 0

    def add(
        self,
        changed: bool,
        roll_rate: float,
        turned: float,
        sole_lean: float,
        up_lean: float,
        walked: float,
        steady_slip: float,
        roll: float,
        dt: float,
    ) -> None:
        """One tick.

        Args:
            changed: The support leg has changed since the last tick.
            roll_rate: Gyro [rad/s] about the torso's x axis.
            turned: The torso's rotation [rad] over its support sole.
            sole_lean: Sine of the torso's pitch over the support sole.
            up_lean: Sine of the torso's pitch against gravity.
            walked: Walked distance [m].
            steady_slip: Yaw slip [rad] that the odometry is turned by.
            roll: Roll [rad] by the joint angles.
            dt: Time [s] since the last tick.
        """
        self.time += dt
        self.walked += walked
        self.steady_slip += steady_slip
        self._rolled += roll_rate * dt + turned * up_lean
        self.turned += turned
        self._sole_lean += sole_lean
        self._up_lean += up_lean
        self._rolled_sum += self._rolled
        self._turned_sum += self.turned
        self._walked_sum += self.walked
        self._time_sum += self.time
        self._roll_sum += roll
        self._ticks += 1
        if changed:
            self._change_lean += up_lean
            self._changes += 1

    @property
    def lean(self) -> float:
        """Mean sine of the lean."""
        return self._sole_lean / self._ticks

    @property
    def slip_lean(self) -> float:
        """Mean sine of the lean while the feet slip."""
        if self._changes == 0:
            return self.lean
        fast = (self.walked / self.time - SCRUB_SPEED) / (SWING_SPEED - SCRUB_SPEED)
        share = min(max(1.0 - fast, 0.0), 1.0)
        at_change = self._change_lean / self._changes + self._lean_offset
        return self.lean + share * (at_change - self.lean)

    @property
    def rolled(self) -> float:
        """Roll [rad] since the stride began by gyro and joint angles, without bias and slip."""
        return self._rolled + self._lean_offset * self.turned

    def means(self) -> tuple[float, float, float, float]:
        """Means over the ticks of rolled, walked, time and the roll by the joint angles."""
        rolled = self._rolled_sum + self._lean_offset * self._turned_sum
        sums = (rolled, self._walked_sum, self._time_sum, self._roll_sum)
        rolled, walked, time, roll = (total / self._ticks for total in sums)
        return rolled, walked, time, roll

    @property
    def _lean_offset(self) -> float:
        return (self._sole_lean - self._up_lean) / self._ticks
