"""The CoM observer: two independent two-dimensional Kalman filters, eqs (10)-(14).

Each filter's state is [position, velocity] of the CoM along one axis of Q. The prediction is the
pendulum itself, so that only the covariance is carried here.
"""

from nao_lipm_gait.walks.lipm.walk_state import WalkState

PUSH_TIME = 0.02
"""[s] over which the velocity of the innovation is averaged."""
FELT_PUSH_TIME = 0.05
"""[s] the same where the accelerometer says what happens sooner."""
FELT_MAX = 10.0
"""[m/s^2] of acceleration that are believed: more is an impact."""
PUSH_GAIN = 0.6
"""Share of a push's velocity that is taken over per tick."""
PUSH_SPEED_SHARE = 0.4
"""Share of the wanted forward speed by which a push has to be stronger: long steps shake more."""


class CovarianceFilter:
    """Covariance and gain of one axis, in scalars: P = [[p, c], [c, v]], C = [1, 0]."""

    def __init__(self, position_sigma: float, velocity_sigma: float, measurement_sigma: float):
        """Deviations per tick: process noise [m], [m/s] and measurement [m]."""
        self._q_position = position_sigma**2
        self._q_velocity = velocity_sigma**2
        self._r = measurement_sigma**2
        self._p = self._q_position
        self._c = 0.0
        self._v = self._q_velocity

    def predict(self, dt: float) -> None:
        """P' = A P A^T + Q with A = [[1, dt], [0, 1]]: eq (12)."""
        self._p += dt * (2.0 * self._c + dt * self._v) + self._q_position
        self._c += dt * self._v
        self._v += self._q_velocity

    def update(self) -> tuple[float, float]:
        """The gain K [1, 1/s] of eq (13); P = P' - K C P' of eq (14)."""
        innovation_variance = self._p + self._r
        gain_position = self._p / innovation_variance
        gain_velocity = self._c / innovation_variance
        self._v -= gain_velocity * self._c
        self._c -= gain_velocity * self._p
        self._p -= gain_position * self._p
        return gain_position, gain_velocity


class PushDetector:
    """An ear for pushes along one axis.

    The filter trusts the pendulum, which cannot know of a push, and would take half a second to
    learn its velocity from positions. How fast the innovation grows says it in a few ticks, and
    what the accelerometer feels beyond the pendulum's acceleration says it at once: the two make a
    complementary filter of the velocity that is missing. What exceeds `push_velocity` [m/s] is
    taken over. An extension of the paper.
    """

    def __init__(self, push_velocity: float):
        """push_velocity [m/s]; 0 = hears nothing."""
        self._push_velocity = push_velocity
        self._left = 0.0
        """[m] of the last innovation that the correction has left over."""
        self._rate = 0.0
        """[m/s] that the expected velocity lacks, by positions and accelerometer."""
        self._felt = 0.0
        """[m/s^2] of the last tick."""
        self.acceleration = 0.0
        """[m/s^2] of the push that is being taken over, over two ticks; 0 without one."""

    def velocity(
        self,
        innovation: float,
        left: float,
        forward_speed: float,
        dt: float,
        anew: bool,
        felt: float | None = None,
    ) -> float:
        """The velocity [m/s] that a push has given, as far as it is taken over in this tick.

        innovation [m]; left [m]: what of it the filter's correction leaves; forward_speed: the
        wanted one [m/s]; dt [s]; anew: not comparable with the last one, because it is older than
        a tick or from another foot; felt [m/s^2]: acceleration beyond the pendulum's in this tick,
        None = not measured.
        """
        push, time = 0.0, PUSH_TIME if felt is None else FELT_PUSH_TIME
        if self._push_velocity > 0.0 and not (anew and felt is None):
            if not anew:
                rate = (innovation - self._left) / dt
                self._rate += min(1.0, dt / time) * (rate - self._rate)
            felt = min(max(felt or 0.0, -FELT_MAX), FELT_MAX)
            self._rate += dt * felt
            usual = self._push_velocity + PUSH_SPEED_SHARE * abs(forward_speed)
            beyond = max(abs(self._rate) - usual, 0.0)
            push = PUSH_GAIN * (beyond if self._rate > 0.0 else -beyond)
            self._rate -= push
            mean, self._felt = 0.5 * (self._felt + felt), felt
            self.acceleration = mean if push * mean > 0.0 else 0.0
        self._left = left
        return push


class OffsetFilter:
    """Learns what the measured CoM is constantly off by.

    The joints make the real CoM follow the expected one. What is left of the difference over many
    double steps is not motion but calibration: joint zeros, the mounting of the IMU, its biases.
    Fed to the pendulum it would push the walk to one side for ever. An extension of the paper,
    which names learning the model's error as future work. One offset serves both support legs:
    what differs between them is sway, and the pendulum has to know of that.
    """

    def __init__(self, time: float):
        """Time [s]: constant of the average; 0 switches the filter off."""
        self._time = time
        self._x = 0.0
        self._y = 0.0

    def remove(self, dx: float, dy: float, dt: float) -> tuple[float, float]:
        """A difference measured - expected [m] without its learned part."""
        if self._time <= 0.0:
            return dx, dy
        share = min(1.0, dt / self._time)
        self._x += share * (dx - self._x)
        self._y += share * (dy - self._y)
        return dx - self._x, dy - self._y


class ComObserver:
    """Pulls the expected CoM state towards the measured CoM position."""

    def __init__(
        self,
        position_sigma: float,
        velocity_sigma: float,
        measurement_sigma: float,
        offset_time: float = 0.0,
        push_velocity: float = 0.0,
    ):
        """See CovarianceFilter, OffsetFilter and PushDetector for the arguments."""
        # The paper gives both axes the same deviations, so one covariance serves both filters.
        self._filter = CovarianceFilter(position_sigma, velocity_sigma, measurement_sigma)
        self._push_x = PushDetector(push_velocity)
        self._push_y = PushDetector(push_velocity)
        self._offset = OffsetFilter(offset_time)
        self._step_count: int | None = None

    def correct(
        self,
        expected: WalkState,
        measured_x: float,
        measured_y: float,
        dt: float,
        missed: bool = False,
        forward_speed: float = 0.0,
        felt: tuple[float, float] | None = None,
    ) -> WalkState:
        """The filtered state x_f, v_f from the expected one and a measured position in Q [m].

        missed: there was no measurement in the last tick; forward_speed [m/s] of the wanted walk;
        felt [m/s^2]: x and y in Q of the acceleration beyond the expected one, None = not measured.
        """
        self._filter.predict(dt)
        position_gain, velocity_gain = self._filter.update()
        dx, dy = self._offset.remove(
            measured_x - expected.x,  # (11)
            measured_y - expected.y,
            dt,
        )
        anew = missed or self._step_count != expected.step_count
        self._step_count = expected.step_count
        x, y = position_gain * dx, position_gain * dy
        felt_x, felt_y = (None, None) if felt is None else felt
        push_x = self._push_x.velocity(dx, dx - x, forward_speed, dt, anew, felt_x)
        push_y = self._push_y.velocity(dy, dy - y, forward_speed, dt, anew, felt_y)
        return expected.moved(
            expected.x + x,
            expected.y + y,
            expected.vx + (velocity_gain * dx + push_x),
            expected.vy + (velocity_gain * dy + push_y),
        )

    @property
    def push_acceleration_y(self) -> float:
        """[m/s^2] of a push to the side that has just been felt; 0 without one."""
        return self._push_y.acceleration
