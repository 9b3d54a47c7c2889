"""A gyro whose bias jumps while the robot walks.

The estimated vertical follows the gyro and, slowly, the stance sole and the accelerometer. On the
average of a step both differ from it by an angle that stays the same (joint zeros, IMU mounting).
After a jump of the bias by b the vertical drifts away with b, and both differences grow alike. What
they grow beyond a deadband is taken as the bias, so that an intact gyro is not touched. Another
walk leans and sways otherwise, so the deadband is wider while the velocity changes. It is wider too
while samples of the gyro are lost: what is interpolated lets the vertical drift without any bias.
"""

from math import copysign
from typing import final

from robot_core.types import Pose2

FAST_TIME, SLOW_TIME = 0.4, 4.0
"""[s] Averaging times of a difference, and of what it usually is."""
DEADBAND = 0.03
"""[rad] Growth of the difference that does not count in a steady walk."""
CHANGE_SHARE = 0.1
"""[rad s/m] Growth that does not count either, per change of the velocity within `SLOW_TIME`."""
LOSS_SHARE = 0.2
"""[rad] Growth that does not count either, per share of the ticks after lost samples."""
LEVER = 0.15
"""[m] What a change of the yaw rate counts as a change of the velocity."""
GAIN, RETURN_GAIN = 6.0, 3.0
"""[1/s^2, 1/s] From the angle beyond the deadband to the bias's rate of change, and to the rate at
which the vertical returns."""
LARGEST = 0.2
"""[rad/s] No bias is taken for larger."""


@final
class _Tick:
    """What all differences have in common in a tick.

    Attributes:
        deadband: Growth [rad] that does not count.
        fast: Share by which the average over `FAST_TIME` follows a difference.
        slow: The same over `SLOW_TIME`.
        dt: Time [s] since the last tick.
    """

    __slots__ = ("deadband", "dt", "fast", "settles", "slow")

    def __init__(self, deadband: float, age: float, dt: float):
        self.deadband = deadband
        self.fast = dt / min(FAST_TIME, age)
        self.slow = dt / min(SLOW_TIME, age)
        self.settles = age < SLOW_TIME / 4.0
        self.dt = dt


class _Drift:
    """Growth of the difference between a reference and the estimated vertical along one axis."""

    def __init__(self) -> None:
        self._fast = self._slow = 0.0

    def update(self, difference: float, tick: _Tick) -> float:
        """Growth [rad] beyond the usual difference."""
        self._fast += tick.fast * (difference - self._fast)
        growth = self._fast - self._slow
        if abs(growth) < tick.deadband or tick.settles:
            self._slow += tick.slow * growth
        return growth


class _Axis:
    """The vertical's drift along one axis."""

    def __init__(self) -> None:
        self._sole, self._force = _Drift(), _Drift()
        self._bias = 0.0

    def rate(self, sole: float, force: float, tick: _Tick) -> float:
        """Rate [rad/s] with which the vertical would drift without a correction.

        Args:
            sole: Difference of the sole's normal from it [rad].
            force: Difference of the specific force [rad].
            tick: This tick.
        """
        sole = self._sole.update(sole, tick)
        force = self._force.update(force, tick)
        beyond = abs(sole) - tick.deadband
        if beyond <= 0.0 or sole * force <= 0.0:
            return self._bias
        angle = copysign(min(beyond, abs(force)), sole)
        self._bias = min(max(self._bias + tick.dt * GAIN * angle, -LARGEST), LARGEST)
        return self._bias + RETURN_GAIN * angle


class GyroBiasJump:
    """Finds the bias of the gyro that has appeared since the robot began to walk.

    Attributes:
        rate: To be subtracted from roll and pitch rate [rad/s]; exactly 0 for an intact gyro.
        widening: What the deadband is wider [rad] because the walk changes or samples are lost.
    """

    def __init__(self) -> None:
        self.rate = (0.0, 0.0)
        self.widening = 0.0
        self._along_x, self._along_y = _Axis(), _Axis()
        self._age = 0.0
        self._usual_velocity: Pose2 = (0.0, 0.0, 0.0)
        self._lost = 0.0

    def update(
        self,
        sole: tuple[float, float],
        force: tuple[float, float],
        velocity: Pose2,
        dt: float,
        *,
        after_loss: bool,
    ) -> None:
        """One tick.

        Args:
            sole: Normal of the flat stance sole minus the estimated vertical, x and y in the torso
                frame.
            force: The same of the specific force over gravity.
            velocity: Of the robot, averaged over a step [m/s, m/s, rad/s].
            dt: Time [s] since the last tick.
            after_loss: Samples of the gyro since the last tick were lost.
        """
        self._age += dt
        self._lost += dt / SLOW_TIME * (after_loss - self._lost)
        change = self._change(velocity, dt)
        self.widening = CHANGE_SHARE * change + LOSS_SHARE * self._lost
        tick = _Tick(DEADBAND + self.widening, self._age, dt)
        # From du/dt = u x w: a roll bias moves the vertical along y, a pitch bias along -x.
        along_x = self._along_x.rate(sole[0], force[0], tick)
        along_y = self._along_y.rate(sole[1], force[1], tick)
        self.rate = -along_y, along_x

    def _change(self, velocity: Pose2, dt: float) -> float:
        """By how much [m/s] the velocity differs from what it usually is."""
        x, y, yaw = self._usual_velocity
        dx, dy, dyaw = velocity[0] - x, velocity[1] - y, velocity[2] - yaw
        share = dt / SLOW_TIME
        self._usual_velocity = x + share * dx, y + share * dy, yaw + share * dyaw
        return abs(dx) + abs(dy) + LEVER * abs(dyaw)
