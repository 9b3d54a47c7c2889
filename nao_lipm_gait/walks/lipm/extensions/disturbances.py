"""Extension of the paper: constant sensor offsets and pushes, taken out of the innovation.

Both work beside the CoM observer. The offset is removed before the innovation reaches it. A push
adds a velocity to its correction.
"""

from nao_lipm_gait.walks.lipm.com_observer import ComCorrection
from nao_lipm_gait.walks.lipm.state import WalkState
from robot_core.geometry import rotate_planar

POSITION_TIME = 0.02
"""Averaging time for the growth of the innovation [s]."""
COMPLEMENTARY_TIME = 0.05
"""The same if the accelerometer covers the higher frequencies [s]."""
ACCELERATION_MAX = 10.0
"""Cap on the measured acceleration [m/s^2]; larger values are impacts."""
PUSH_GAIN = 0.6
"""Share of a detected velocity that is used per tick."""
FORWARD_SPEED_SHARE = 0.4
"""Increase of the push threshold per forward speed: long steps shake the CoM more."""


class MeasurementOffset:
    """Learns the constant error of the measured CoM.

    Over many double steps the mean difference between the measured and the expected CoM is not
    motion but calibration: encoder offsets, IMU mounting and bias. The pendulum would answer it by
    drifting to one side. The paper names learning the model error as future work. One offset serves
    both support legs, because a difference between the legs is sway.

    Args:
        time: Time constant of the average [s]; 0 disables it.

    Attributes:
        x: The error [m], forward in Q.
    """

    def __init__(self, time: float):
        self._time = time
        self.x = 0.0
        self._y = 0.0

    def remove(self, dx: float, dy: float, dt: float) -> tuple[float, float]:
        """The innovation without the learned offset.

        Args:
            dx: Measured minus expected CoM, forward in Q [m].
            dy: The same to the left [m].
            dt: Time since the last tick [s].

        Returns:
            The two differences without the offset [m].
        """
        if self._time <= 0.0:
            return dx, dy
        share = min(1.0, dt / self._time)
        self.x += share * (dx - self.x)
        self._y += share * (dy - self._y)
        return dx - self.x, dy - self._y


class PushDetector:
    """Detects the velocity that a push gives to the CoM.

    The observer relies on the pendulum, which does not know of pushes, and would need half a second
    to learn their velocity from positions. The growth of the innovation shows it within a few
    ticks, and the acceleration that the pendulum does not explain shows it at once. A complementary
    filter of both gives the missing velocity; what exceeds the threshold is added to the estimate.

    Args:
        threshold: Smallest missing velocity that counts as a push [m/s]; 0 disables the detector.
    """

    def __init__(self, threshold: float):
        self._threshold = threshold
        self._x = _AxisDetector()
        self._y = _AxisDetector()
        self._step_count: int | None = None

    def update(
        self,
        innovation: tuple[float, float],
        correction: ComCorrection,
        forward_speed: float,
        dt: float,
        step_count: int,
        missed: bool,
        acceleration: tuple[float, float] | None,
    ) -> tuple[float, float]:
        """One tick.

        Args:
            innovation: Measured minus expected CoM, x and y in Q [m].
            correction: What the observer makes of it.
            forward_speed: Speed of the wanted walk over a pendulum origin [m/s].
            dt: Time since the last tick [s].
            step_count: Support changes so far.
            missed: Whether there was no measurement in the last tick.
            acceleration: Acceleration that the pendulum does not explain, x and y in Q [m/s^2];
                None if it is not measured.

        Returns:
            Velocity to add to the estimate, x and y in Q [m/s].
        """
        if self._threshold <= 0.0:
            return 0.0, 0.0
        # An innovation from another foot or after a gap has not grown from the last one.
        comparable = not missed and self._step_count == step_count
        self._step_count = step_count
        threshold = self._threshold + FORWARD_SPEED_SHARE * abs(forward_speed)
        (dx, dy), (ax, ay) = innovation, (None, None) if acceleration is None else acceleration
        return (
            self._x.update(dx, dx - correction.x, threshold, dt, comparable, ax),
            self._y.update(dy, dy - correction.y, threshold, dt, comparable, ay),
        )

    @property
    def lateral_acceleration(self) -> float:
        """Acceleration of the push to the side that acts now [m/s^2]; 0 without one."""
        return self._y.acceleration


class _AxisDetector:
    """The detector along one axis; `acceleration` [m/s^2] is that of the current push, or 0."""

    def __init__(self) -> None:
        self.acceleration = 0.0
        self._residual = 0.0  # [m] of the last innovation after the observer's correction
        self._missing_velocity = 0.0  # [m/s]
        self._last_acceleration = 0.0  # [m/s^2]

    def update(
        self,
        innovation: float,
        residual: float,
        threshold: float,
        dt: float,
        comparable: bool,
        acceleration: float | None,
    ) -> float:
        """The velocity of a push that is added in this tick [m/s]; see `PushDetector.update`."""
        push, time = 0.0, POSITION_TIME if acceleration is None else COMPLEMENTARY_TIME
        if comparable or acceleration is not None:
            if comparable:
                growth = (innovation - self._residual) / dt
                self._missing_velocity += min(1.0, dt / time) * (growth - self._missing_velocity)
            measured = min(max(acceleration or 0.0, -ACCELERATION_MAX), ACCELERATION_MAX)
            self._missing_velocity += dt * measured
            excess = max(abs(self._missing_velocity) - threshold, 0.0)
            push = PUSH_GAIN * (excess if self._missing_velocity > 0.0 else -excess)
            self._missing_velocity -= push
            mean = 0.5 * (self._last_acceleration + measured)
            self._last_acceleration = measured
            self.acceleration = mean if push * mean > 0.0 else 0.0
        self._residual = residual
        return push


def unexplained_acceleration(
    before: WalkState, after: WalkState, measured: tuple[float, float], dt: float
) -> tuple[float, float]:
    """The measured acceleration minus that of the pendulum.

    Args:
        before: Estimated state one tick ago.
        after: The state expected now.
        measured: Acceleration over the tick, x and y in Q [m/s^2].
        dt: Time between the two states [s].

    Returns:
        The difference, x and y in Q [m/s^2].
    """
    vx, vy, turn = before.vx, before.vy, after.q_in_odom[2] - before.q_in_odom[2]
    if turn != 0.0:
        vx, vy = rotate_planar(vx, vy, -turn)
    return measured[0] - (after.vx - vx) / dt, measured[1] - (after.vy - vy) / dt
