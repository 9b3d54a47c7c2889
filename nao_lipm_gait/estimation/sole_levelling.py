"""Relative tilt of the soles, learned while the robot steps.

Encoder offsets tilt the soles of a robot against each other although it commands parallel soles.
Two numbers matter: the pitch and the roll of the left sole relative to the right one, as the joint
angles give it. From the middle of one single support to the middle of the next, the joint angles
give one change of the torso's tilt, because the stance soles stand on the ground; the gyro gives
another. The difference between the two has the sign of the leg, so a constant bias of the gyro
does not matter:

    difference = side (tilt - applied) - (stance tilt - stance tilt before)        side = +1, -1

The stance tilt of a sole is not zero: soft ground yields under the zero moment point (ZMP), and a
sole on four springs tilts in proportion to the distance of the ZMP from their center. `SoleSprings`
has the factor for the expected ground. The ground's softness relative to it is learned from how the
sole turns while the ZMP moves along it.

What both soles have in common shows elsewhere. A torso that leans to the left over two level soles
sets the left foot down early and the right one late. Its ZMP then moves to the same side in both
single supports, while in a walk whose steps are mirror images it moves to opposite sides:

    sway = mean over both single supports of zmp_y sin(2 pi phase)

Neither the mounting nor a bias of the IMU shows in it. In steps to the side and in turns, which are
no mirror images, it is not measured.

Four scalar Kalman filters hold pitch, roll, softness and lean, with one measurement for each single
support. A measurement has a systematic error, which is larger for roll and lean in fast walks; it
does not correct what is known much better.
"""

from collections.abc import Sequence
from math import hypot, remainder, sin, sqrt, tau
from typing import final

from nao_lipm_gait.whole_body.body_model import SolePose
from robot_core.geometry import cross
from robot_core.rate_limiter import limited_step
from robot_core.types import GRAVITY, LEFT, Point2, Point3

CORNER_STIFFNESS = 1e4
"""Stiffness [N/m] of the expected ground under one corner of a sole."""
TILT_SIGMA = 0.02
"""Deviation [rad] of pitch and roll at first: encoder offsets of 0.5 deg in each joint."""
TILT_MAX = 0.06
"""Largest pitch and roll [rad] that is learned."""
TILT_ERROR = 0.003
"""Systematic error of the measured pitch and roll [rad]; learning never ends at it."""
DIFFERENCE_SIGMA = 0.006
"""Deviation [rad] of the measured difference from step to step."""
MODEL_SHARE = 0.5
"""Error of the measured difference as a share of the tilt that is not applied yet."""
CENTER_SHARE = 0.85
"""Center of the springs of a loaded sole relative to that of its corners, as measured: the sole
leans over its outer edge, so the inner corners carry less."""
ZMP_SHARE = 0.87
"""Movement of the ZMP per movement of the measured one, as measured on the spot; below 1 because
the accelerometer measures the torso and not the CoM."""
SOFTNESS_SIGMA = 0.25
"""Deviation of the softness at first."""
SOFTNESS_ERROR = 0.05
"""Systematic error of the measured softness; the robot may also walk onto a carpet."""
SOFTNESS_MIN, SOFTNESS_MAX = 0.2, 2.5
ROLL_ERROR_AHEAD, ROLL_ERROR_BACK, ROLL_ERROR_SIDEWAYS = 0.08, 0.04, 0.1
"""Additional systematic error of the roll per speed squared [rad s^2/m^2], ..."""
ROLL_ERROR_IN_TURNS = 0.002
"""... and per turning rate [rad s/rad]."""
BETTER, BETTER_ON_EDGES = 0.25, 1.0
"""Deviation of a value as a share of a measurement's constant error below which the measurement
does not correct it; the second one where soles stand on their edges, so that the measured tilt
follows the one that is applied: ..."""
FAST_TURN, FAST_SIDEWAYS = 1.0, 0.1
"""... above this turning rate [rad/s], and for the roll also above this speed sideways [m/s]."""
LEAN_SIGMA = 0.009
"""Deviation [rad] of the lean at first: encoder offsets of 0.5 deg in the roll joints."""
LEAN_MAX = 0.035
"""Largest lean [rad] that is learned."""
LEAN_ERROR, LEAN_ERROR_AHEAD = 0.002, 0.08
"""Systematic error of the measured lean [rad], and what is added per speed squared [rad s^2/m^2]:
in fast strides the ZMP answers a change of the lean late, and learning would swing."""
LEAN_SWAY = 0.22
"""Sway of the ZMP per lean [m/rad]; on the spot, ahead and back 0.17 to 0.24."""
SWAY_SIGMA = 0.0015
"""Deviation [m] of the sway from step to step."""
MIRRORED_SIDEWAYS, MIRRORED_TURN = 0.1, 0.5
"""Speed sideways [m/s] and turning rate [rad/s] below which both steps are mirror images."""
LASTING = 0.7
"""Deviation as a share of that error below which no measurement brings it: learning never ends."""
KNOWN_SIGMA = 0.012
"""Deviation [rad] below which pitch and roll are known well enough for long strides, ..."""
KNOWN_STEPS, KNOWN_STEPS_PITCH = 10, 4
"""... once this many single supports were used; the second one where the roll is not learned."""
OUTLIER = 3.0
"""Innovation in its own deviations from which on a measurement counts less: pushes, bumps."""
APPLY_RATE = 0.015
"""Rate [rad/s] at which the learned tilt is applied."""
SUPPORT_TIME_MIN, SUPPORT_TIME_MAX = 0.12, 0.6
"""Durations [s] of a single support that can be used."""
FIRST_STEPS = 3
"""Number of single supports after the start of a walk that are not used."""
MIDDLE_TICKS = 2
"""Ticks before and after the middle of a single support whose mean is the ZMP there."""

LANDING_TIME = 0.04
"""Time [s] after which a new stance sole carries the whole robot."""
ROCKING_TIME = 0.14
"""Time [s] from then on in which the sole's rotation is compared with the ZMP."""
ROCKING_LAG = 0.025
"""Time constant [s] with which a sole on soft ground follows the ZMP."""
ROCKING_SIGMA = 0.002
"""Deviation [rad] of that rotation."""
ROCKING_SPEED_MAX, ROCKING_TURN_MAX = 0.06, 0.3
"""Speeds [m/s, rad/s] above which the swing leg disturbs that measurement."""
ROCKING_STEPS = 8
"""Number of single supports below these speeds before it is used: the first ones of a walk that
speeds up are disturbed too."""


@final
class SoleSprings:
    """A sole on four equal springs, one under each corner.

    Attributes:
        pitch: Pitch of the sole per measured distance of the ZMP ahead of the springs' center
            [rad/m].
        roll: Roll of the sole per measured distance of the ZMP to the right of it [rad/m].
        center_y: Center of the left sole's springs [m]; that of the right sole is mirrored.
    """

    __slots__ = ("center_y", "pitch", "roll")

    def __init__(self, pitch: float, roll: float, center_y: float):
        self.pitch = pitch
        self.roll = roll
        self.center_y = center_y


def sole_springs(corners: Sequence[Point2], mass: float) -> SoleSprings:
    """The springs of the expected ground: tilt = m g distance / (stiffness sum of d_i^2).

    The distance is `ZMP_SHARE` of the measured one.

    Args:
        corners: Corners of the left sole in its frame [m].
        mass: Mass of the robot [kg].
    """
    x = sum(corner[0] for corner in corners) / len(corners)
    y = sum(corner[1] for corner in corners) / len(corners)
    load = ZMP_SHARE * mass * GRAVITY / CORNER_STIFFNESS
    return SoleSprings(
        load / sum((corner[0] - x) ** 2 for corner in corners),
        load / sum((corner[1] - y) ** 2 for corner in corners),
        CENTER_SHARE * y,
    )


@final
class _Tick:
    """One tick of a single support.

    Attributes:
        roll: Roll [rad] of the torso by the joint angles minus that by the gyro.
        pitch: The same for the pitch [rad].
        zmp_x: ZMP in the level frame of the sole [m].
        zmp_y: The same to the left [m].
        load: Vertical force as a share of the weight.
    """

    __slots__ = ("load", "pitch", "roll", "zmp_x", "zmp_y")

    def __init__(self, roll: float, pitch: float, zmp_x: float, zmp_y: float, load: float):
        self.roll = roll
        self.pitch = pitch
        self.zmp_x = zmp_x
        self.zmp_y = zmp_y
        self.load = load


@final
class _Learned:
    """A number with its variance: a Kalman filter with one state."""

    __slots__ = ("_high", "_low", "value", "variance")

    def __init__(self, value: float, sigma: float, low: float, high: float):
        self.value = value
        self.variance = sigma * sigma
        self._low, self._high = low, high

    def correct(
        self, innovation: float, h: float, r: float, error: float, better: float = BETTER
    ) -> None:
        """Kalman correction, if the measurement can improve the value.

        Args:
            innovation: Measured minus expected.
            h: Change of the measurement per change of the value.
            r: Variance of the measurement's noise; an outlier counts less.
            error: Deviation of the measurement's constant error, in units of the value. It makes
                the gain smaller, the deviation does not fall below `LASTING` of it by this
                measurement, and a value that is known much better is not corrected.
            better: Deviation below which nothing is corrected, as a share of `error`.
        """
        if self.variance < better * better * error * error:
            return
        r += h * h * error * error
        s = h * h * self.variance + r
        surprise = innovation * innovation / (OUTLIER * OUTLIER * s)
        if surprise > 1.0:
            s += (surprise - 1.0) * r
        gain = self.variance * h / s
        self.value = min(max(self.value + gain * innovation, self._low), self._high)
        lasting = min(self.variance, LASTING * LASTING * error * error)
        self.variance = max((1.0 - gain * h) * self.variance, lasting)


class SoleLevelling:
    """Learns the relative tilt of the soles; what is applied follows it slowly.

    Args:
        springs: The soles on the expected ground.
        pitch: Pitch [rad] of the left sole relative to the right one, if it was calibrated.
        roll: The same for the roll [rad].
        lean: Roll [rad] of the torso over level soles, if it was calibrated.
        known: Whether it was calibrated.
        learns_roll: Whether roll and lean are learned.

    Attributes:
        applied_pitch: Pitch [rad] that the joint angles given to `update` no longer contain.
        applied_roll: The same for the roll [rad].
        applied_lean: The same for the lean [rad].
    """

    def __init__(
        self, springs: SoleSprings, pitch: float = 0.0, roll: float = 0.0, lean: float = 0.0, *,
        known: bool = False, learns_roll: bool = True,
    ) -> None:  # fmt: skip
        self._springs = springs
        self._learns_roll = learns_roll
        sigma = TILT_ERROR if known else TILT_SIGMA
        self._pitch = _Learned(pitch, sigma, -TILT_MAX, TILT_MAX)
        self._roll = _Learned(roll, sigma, -TILT_MAX, TILT_MAX)
        self._softness = _Learned(1.0, SOFTNESS_SIGMA, SOFTNESS_MIN, SOFTNESS_MAX)
        self._lean = _Learned(lean, LEAN_ERROR if known else LEAN_SIGMA, -LEAN_MAX, LEAN_MAX)
        self._known_steps = KNOWN_STEPS if learns_roll else KNOWN_STEPS_PITCH
        self._measurements = self._known_steps if known else 0
        self.applied_pitch, self.applied_roll, self.applied_lean = pitch, roll, lean
        self.pause()

    def pause(self) -> None:
        """The robot does not walk. What has been learned is kept."""
        self._up: Point3 | None = None
        self._yaw = 0.0
        self._yaw_rate = 0.0
        self._support = 0
        self._supports = 0
        self._slow_supports = 0
        self._ticks: list[_Tick] = []
        self._last_zmp: tuple[float, float, float] | None = None

    @property
    def pitch(self) -> float:
        """Pitch [rad] of the left sole relative to the right one."""
        return self._pitch.value

    @property
    def roll(self) -> float:
        """Roll [rad] of the left sole relative to the right one."""
        return self._roll.value

    @property
    def lean(self) -> float:
        """Roll [rad] of the torso over level soles when the joint angles say upright."""
        return self._lean.value

    @property
    def softness(self) -> float:
        """Softness of the ground; 1 is the expected ground."""
        return self._softness.value

    @property
    def sigma(self) -> tuple[float, float]:
        """Standard deviations [rad] of pitch and roll; 0 of a roll that is not learned."""
        roll = sqrt(self._roll.variance) if self._learns_roll else 0.0
        return sqrt(self._pitch.variance), roll

    @property
    def known(self) -> bool:
        """Whether pitch and roll are known well enough for long strides."""
        limit = KNOWN_SIGMA * KNOWN_SIGMA
        learned = (self._pitch, self._roll) if self._learns_roll else (self._pitch,)
        certain = all(each.variance <= limit for each in learned)
        return certain and self._measurements >= self._known_steps

    def update(
        self,
        support: int,
        sole: SolePose,
        com_in_sole: Point3,
        force_in_sole: Point3,
        torso_yaw: float,
        angular_velocity: Point3,
        velocity: Point3,
        dt: float,
    ) -> None:
        """One tick of a walk.

        Args:
            support: Support leg, `LEFT` or `RIGHT`.
            sole: Support sole in the torso frame, by the joint angles.
            com_in_sole: CoM in the level frame of that sole [m].
            force_in_sole: Accelerometer [m/s^2] in the level frame.
            torso_yaw: Yaw [rad] of the torso in the level frame.
            angular_velocity: Gyro [rad/s] in the torso frame; its yaw rate is not used.
            velocity: Velocity of the robot by odometry [m/s, m/s, rad/s].
            dt: Time [s] since the last tick.
        """
        roll_rate, pitch_rate, _ = angular_velocity
        yaw_before, self._yaw = self._yaw, torso_yaw
        if support == self._support:
            self._yaw_rate = remainder(self._yaw - yaw_before, tau) / dt
        nx, ny, _ = sole.normal
        ux, uy, uz = self._up or sole.normal
        rx, ry, rz = cross((ux, uy, uz), (roll_rate, pitch_rate, self._yaw_rate))  # du/dt = u x w
        ux, uy, uz = ux + dt * rx, uy + dt * ry, uz + dt * rz
        self._up = ux, uy, uz
        if support != self._support:
            if self._support != 0:
                self._end_support(velocity, dt)
            self._support = support
            self._ticks.clear()
            ux, uy, uz = self._up
        x, y, z = com_in_sole
        ax, ay, az = force_in_sole
        zmp_x, zmp_y = x - z * ax / GRAVITY, y - z * ay / GRAVITY
        self._ticks.append(_Tick(ny - uy, ux - nx, zmp_x, zmp_y, az / GRAVITY))
        step = APPLY_RATE * dt
        self.applied_pitch = limited_step(self.applied_pitch, self._pitch.value, step)
        self.applied_roll = limited_step(self.applied_roll, self._roll.value, step)
        self.applied_lean = limited_step(self.applied_lean, self._lean.value, step)

    # -- one single support ------------------------------------------------------------------------

    def _end_support(self, velocity: Point3, dt: float) -> None:
        """Learn from the single support that has just ended."""
        ticks, last_zmp = self._ticks, self._last_zmp
        self._supports += 1
        middle = len(ticks) // 2
        tick = ticks[middle]
        # The next difference counts from here: the gyro's vertical becomes that of the joints.
        if self._up is not None:
            ux, uy, uz = self._up
            self._up = ux - tick.pitch, uy + tick.roll, uz
        self._last_zmp = None
        if not SUPPORT_TIME_MIN <= dt * len(ticks) <= SUPPORT_TIME_MAX:
            return
        around = ticks[middle - MIDDLE_TICKS : middle + MIDDLE_TICKS + 1]
        zmp_x = sum([each.zmp_x for each in around]) / len(around)
        zmp_y = sum([each.zmp_y for each in around]) / len(around)
        sway = _sway(ticks)
        self._last_zmp = zmp_x, zmp_y, sway
        if last_zmp is None or self._supports <= FIRST_STEPS:
            return
        vx, vy, turn = velocity
        slow = hypot(vx, vy) < ROCKING_SPEED_MAX and abs(turn) < ROCKING_TURN_MAX
        self._slow_supports = self._slow_supports + 1 if slow else 0
        if self._slow_supports > ROCKING_STEPS:
            self._learn_softness(ticks, dt)
        side = 1.0 if self._support == LEFT else -1.0
        springs, softness = self._springs, self._softness
        moved_x = springs.pitch * (zmp_x - last_zmp[0])
        moved_y = springs.roll * (zmp_y - last_zmp[1] - 2.0 * side * springs.center_y)
        self._measurements += 1
        better = BETTER_ON_EDGES if abs(turn) > FAST_TURN else BETTER
        # An error of the softness is the same in every step.
        softer = sqrt(softness.variance)
        left = self._pitch.value - self.applied_pitch
        expected = side * left - softness.value * moved_x
        error = TILT_ERROR + softer * abs(moved_x)
        self._pitch.correct(tick.pitch - expected, side, _variance(left), error, better)
        if not self._learns_roll:
            return
        left = self._roll.value - self.applied_roll
        expected = side * left + softness.value * moved_y
        error = TILT_ERROR + softer * abs(moved_y)
        error += (ROLL_ERROR_AHEAD if vx > 0.0 else ROLL_ERROR_BACK) * vx * vx
        error += ROLL_ERROR_SIDEWAYS * vy * vy
        error += ROLL_ERROR_IN_TURNS * abs(turn)
        if abs(vy) > FAST_SIDEWAYS:
            better = BETTER_ON_EDGES
        self._roll.correct(tick.roll - expected, side, _variance(left), error, better)
        if abs(vy) < MIRRORED_SIDEWAYS and abs(turn) < MIRRORED_TURN:
            expected = LEAN_SWAY * (self._lean.value - self.applied_lean)
            innovation = 0.5 * (last_zmp[2] + sway) - expected
            error = LEAN_ERROR + LEAN_ERROR_AHEAD * vx * vx
            self._lean.correct(innovation, LEAN_SWAY, SWAY_SIGMA * SWAY_SIGMA, error)

    def _learn_softness(self, ticks: Sequence[_Tick], dt: float) -> None:
        """From the slope of the sole's pitch over the ZMP, which it follows with a lag."""
        first = round(LANDING_TIME / dt)
        rocking = ticks[first : first + round(ROCKING_TIME / dt)]
        if len(rocking) < 2:
            return
        share = min(1.0, dt / ROCKING_LAG)
        zmp = rocking[0].zmp_x
        followed: list[float] = []
        for tick in rocking:
            zmp += share * (tick.zmp_x * tick.load - zmp)
            followed.append(zmp)
        mean_zmp = sum(followed) / len(followed)
        mean_pitch = -sum([tick.pitch for tick in rocking]) / len(rocking)
        moment = moved = 0.0
        for zmp, tick in zip(followed, rocking, strict=True):
            moment += (zmp - mean_zmp) * (-tick.pitch - mean_pitch)
            moved += (zmp - mean_zmp) * (zmp - mean_zmp)
        h = self._springs.pitch * sqrt(moved)
        if h > 0.0:
            measured = moment / sqrt(moved)
            innovation = measured - h * self._softness.value
            r = ROCKING_SIGMA * ROCKING_SIGMA
            self._softness.correct(innovation, h, r, SOFTNESS_ERROR)


def _sway(ticks: Sequence[_Tick]) -> float:
    """By how much [m] the ZMP is further to the left in the first half of a single support."""
    per_tick = tau / max(1, len(ticks) - 1)
    return sum([sin(per_tick * i) * tick.zmp_y for i, tick in enumerate(ticks)]) / len(ticks)


def _variance(not_applied: float) -> float:
    """Variance of a difference while a part of the tilt [rad] is not applied yet."""
    model = MODEL_SHARE * not_applied
    return DIFFERENCE_SIGMA * DIFFERENCE_SIGMA + model * model
