"""The sensors prove themselves in the stand before the first walk.

A robot that has just been set down rocks on its soles. It then measures three things twice: the
vertical by the accelerometer and by the joints over flat soles, the size of gravity, and the
rocking by the gyro and by the accelerometer, because a tilted, accelerated torso is pressed
sideways: a_y = (g + h w^2) roll and a_x = -(g + h w^2) pitch, for a frequency w at a height h.
"""

from math import acos, hypot

import numpy as np

from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, SensorFrame

FORCE_TICKS = 30
"""Ticks over which gravity is averaged."""
GYRO_TICKS = 60
"""Ticks of rocking that are compared; fewer than a robot takes to move into its stand."""
SETTLED_TICKS = 5
"""First ticks that are left out: a robot that is set down feels an impact."""
FORCE_RANGE = 7.0, 13.0
"""[m/s^2] Mean specific force of a robot that stands."""
TILT_MAX = 0.35
"""[rad] Largest angle between the vertical of the accelerometer and that over flat soles."""
LYING_TILT = 1.0
"""[rad] from there on the vertical of a robot that seems to lie."""
LYING_TICKS = 60
"""Ticks in which the loads of the soles must arrive; a robot that lies gets up later."""
INVERTED_TILT = 2.3
"""[rad] from there on the vertical points into the floor: no robot lies like that."""
FAST = 2.0
"""[rad/s] A robot in its first stand does not turn that fast."""
BAND_TIME, SMOOTH_TIME = 0.2, 0.02
"""[s] Time constants of the band in which rocking is compared."""
ROCKING_ANGLE, ROCKING_FORCE = 5e-4, 0.06
"""[rad, m/s^2] Least standard deviations of rocking that say anything."""
STEP_ANGLE = 0.1
"""[rad] by which the knees bend against each other at most while a robot takes its stand."""
STILL_ANGLE = 1e-4
"""[rad] Standard deviation of a gyro that shows nothing, not even noise."""
LARGE_ANGLE = 0.02
"""[rad] Standard deviation of the angle from which on the unit can be judged."""
AXES_MARGIN = 0.25
"""Sum of correlations by which the exchanged axes must fit better; right ones fit better by 0.3."""
OPPOSED = -0.45
"""Correlation of gyro and accelerometer below which they contradict each other; healthy ones reach
0.4 to 0.9."""
SWAY_TICKS = 40
"""First ticks of a walk in which the sway by the joints is compared with the lateral force."""
SWAY_RATIO, SWAY_CORRELATION = 1.5, 0.5
"""Share of the force along x that follows the sway, and its correlation, from which on the axes are
exchanged; right ones stay below 0.3."""
GAIN_MIN = 4.0
"""[m/s^2] per rad below which the gyro's unit is wrong: gravity alone gives 9.81."""


class SensorCheck:
    """Judges the first stand; one tick after the other.

    Args:
        robot: The robot that is measured.
        period: Control period [s].

    Attributes:
        trouble: Why the robot must not walk; empty while nothing is known to be wrong.
        seems_to_lie: The first frame shows a robot that lies. If its soles carry it, it does not.
    """

    def __init__(self, robot: RobotDescription, period: float) -> None:
        self._body = BodyModel(robot)
        self._dt = period
        knees = robot.left_leg.knee_pitch, robot.right_leg.knee_pitch
        self._knees = [robot.index(name) for name in knees]
        self.restart()

    def restart(self) -> None:
        """The sensors, or the robot's place, may be others from here on."""
        self.trouble = ""
        self.seems_to_lie = False
        self._lying_ticks = 0
        self._up: FloatArray | None = None
        self._forces: list[FloatArray] = []
        self._gravity_is_right = self._gyro_is_judged = self._sway_is_judged = False
        self._sway: list[FloatArray] = []
        self._angle = self._smooth = self._slow = np.zeros(3)
        self._rocking: list[tuple[FloatArray, FloatArray]] = []
        self._bent: float | None = None
        self._first = True
        self._doubtful = False

    @property
    def done(self) -> bool:
        """Nothing more is to be judged, and all was right."""
        judged = self._gravity_is_right and self._gyro_is_judged and self._sway_is_judged
        return judged and not self.trouble

    def update(
        self,
        frame: SensorFrame,
        *,
        stands: bool,
        carried: bool,
        walks: bool = False,
        light: bool = False,
        in_doubt: bool = False,
    ) -> SensorFrame:
        """One tick.

        Args:
            frame: As measured.
            stands: The gait stands or moves into its stand.
            carried: The soles are known to carry the robot.
            walks: The gait walks because it is told to.
            light: The soles are known not to carry it: it lies, falls or is held.
            in_doubt: The loads of the soles do not show a robot that stands on both.

        Returns:
            The frame for the gait: without sensors that are wrong, so that it goes on standing.
        """
        if self.done:
            return frame
        force, rate = frame.linear_acceleration, frame.angular_velocity
        if self._first:
            self._first = False
            self._up = self._vertical(frame)
            angle = _angle(force, self._up)
            self._doubtful = TILT_MAX < angle < LYING_TILT
            if angle > INVERTED_TILT:
                self.trouble = self._gravity_trouble(force)
            else:
                self.seems_to_lie = angle > LYING_TILT and _size(force) > FORCE_RANGE[0]
        if light and not self._gravity_is_right:
            self._forces.clear()
            self.trouble = ""
            return frame
        if self.seems_to_lie and not self.trouble:
            self._lying_ticks += 1
            if not carried:
                self.seems_to_lie = self._lying_ticks < LYING_TICKS
                return frame
            self.seems_to_lie = False
            self.trouble = self._gravity_trouble(force)
        if not stands and not self.trouble:
            self._forces.clear()
            self._gyro_is_judged = True  # the robot moves by itself: nothing to compare
            if not self._sway_is_judged:
                self._judge_sway(frame, walks=walks)
            return self._at_rest(frame) if self.trouble else frame
        if not in_doubt or self.trouble:
            self._judge_gravity(frame)
        else:
            self._forces.clear()
        if not self._gyro_is_judged:
            self._judge_gyro(frame)
        if self.trouble:
            return self._at_rest(frame)
        fast = not self._gyro_is_judged and _size(rate) > FAST
        if self._doubtful and not self._gravity_is_right:
            return self._at_rest(frame)
        return self._at_rest(frame) if fast else frame

    def _judge_gravity(self, frame: SensorFrame) -> None:
        if self._gravity_is_right:
            return
        self._forces.append(frame.linear_acceleration)
        if len(self._forces) < FORCE_TICKS + SETTLED_TICKS:
            return
        self._up = self._vertical(frame)
        mean: FloatArray = np.mean(self._forces[SETTLED_TICKS:], axis=0)
        self._forces.clear()
        self.trouble = self._gravity_trouble(mean)
        self._gravity_is_right = not self.trouble

    def _gravity_trouble(self, force: FloatArray) -> str:
        """What is wrong with the mean specific force (3,) [m/s^2]; empty if nothing is."""
        assert self._up is not None
        size, angle = _size(force), _angle(force, self._up)
        got = f"imu/data linear_acceleration: got ({', '.join(f'{v:.2f}' for v in force)}) m/s^2"
        allowed = (
            f"; allowed for a robot that stands: {FORCE_RANGE[0]:g} to {FORCE_RANGE[1]:g} m/s^2, "
            f"at most {TILT_MAX:g} rad from the vertical over its soles; "
        )
        guess = ""
        if size < 0.5:
            guess = "is gravity removed?"
        elif 0.7 < size < 1.3:
            guess = "unit g instead of m/s^2?"
        elif not FORCE_RANGE[0] <= size <= FORCE_RANGE[1]:
            guess = "unit or scale?"
        if angle > TILT_MAX and size >= 0.5:
            guess = f"{guess} {self._turned(force)}".strip()
        return f"{got}{allowed}{guess}; the robot stands" if guess else ""

    def _turned(self, force: FloatArray) -> str:
        """A guess how the axes are turned."""
        assert self._up is not None
        up = self._up
        if _angle(-force, up) <= TILT_MAX:
            return "sign (up is positive)?"
        for first, second in ((0, 2), (1, 2), (0, 1)):
            changed = force.copy()
            changed[[first, second]] = force[[second, first]]
            for sign in (1.0, -1.0):
                if _angle(sign * changed, up) <= TILT_MAX:
                    return f"axes {'xyz'[first]} and {'xyz'[second]} exchanged or turned?"
        return "mounting of the IMU, or a robot that does not stand upright?"

    def _judge_gyro(self, frame: SensorFrame) -> None:
        dt, rate, force = self._dt, frame.angular_velocity, frame.linear_acceleration
        left, right = frame.joint_position[self._knees].tolist()
        if self._bent is None or abs(left - right - self._bent) > STEP_ANGLE:
            self._bent = left - right
            self._rocking.clear()
        if not self._rocking:
            self._smooth = self._slow = force
        self._angle = (1.0 - dt / BAND_TIME) * self._angle + dt * rate
        self._smooth = self._smooth + dt / SMOOTH_TIME * (force - self._smooth)
        self._slow = self._slow + dt / BAND_TIME * (self._smooth - self._slow)
        self._rocking.append((self._angle, self._smooth - self._slow))
        if len(self._rocking) < GYRO_TICKS + SETTLED_TICKS:
            return
        self._gyro_is_judged = True
        rocking = np.array(self._rocking[SETTLED_TICKS:])
        self._rocking.clear()
        rocking -= rocking.mean(axis=0)
        if not self.trouble:
            self.trouble = _gyro_trouble(rocking[:, 0], rocking[:, 1])

    def _judge_sway(self, frame: SensorFrame, *, walks: bool) -> None:
        """A torso that the legs sway to one side is pressed to the other."""
        if not walks:
            self._sway.clear()
            return
        self._vertical(frame)
        y = -0.5 * sum(self._body.sole_in_torso(side).position[1] for side in (1, -1))
        force = frame.linear_acceleration
        now = np.array((y, force[0], force[1]))
        if not self._sway:
            self._smooth = self._slow = now
        self._smooth = self._smooth + self._dt / SMOOTH_TIME * (now - self._smooth)
        self._slow = self._slow + self._dt / BAND_TIME * (self._smooth - self._slow)
        self._sway.append(self._smooth - self._slow)
        if len(self._sway) < SWAY_TICKS:
            return
        self._sway_is_judged = True
        sway, along, lateral = (np.array(self._sway) - np.mean(self._sway, axis=0)).T
        guess = ""
        follows = abs(_correlation(sway, along)) > SWAY_CORRELATION
        if follows and abs(float(sway @ along)) > SWAY_RATIO * abs(float(sway @ lateral)):
            guess = "axes x and y exchanged or turned?"
        elif _correlation(sway, lateral) > -OPPOSED:
            guess = "sign of y, or an IMU that looks back?"
        if guess:
            self.trouble = (
                "imu/data linear_acceleration: does not follow the first sway of the joints; "
                f"allowed: a force to the right while the torso is on the left; {guess} Mend it "
                "and start the sensors again; the robot stands"
            )

    def _vertical(self, frame: SensorFrame) -> FloatArray:
        """Mean normal (3,) of the soles in the torso frame."""
        self._body.set_joints(frame.joint_position)
        self._body.com_in_torso()
        left, right = self._body.sole_in_torso(1).normal, self._body.sole_in_torso(-1).normal
        normal = np.array(left) + np.array(right)
        return normal / max(_size(normal), 1e-6)

    def _at_rest(self, frame: SensorFrame) -> SensorFrame:
        up = self._vertical(frame)
        return frame._replace(
            linear_acceleration=GRAVITY * up, angular_velocity=np.zeros(3),
            mean_angular_velocity=None,
        )  # fmt: skip


def _gyro_trouble(angle: FloatArray, force: FloatArray) -> str:
    """What is wrong with the gyro, by its integral (n, 3) and the force (n, 3) in one band."""
    pressed = np.column_stack((force[:, 1], -force[:, 0]))  # by roll and pitch
    moved, shown = pressed.std(axis=0) > ROCKING_FORCE, angle[:, :2].std(axis=0) > ROCKING_ANGLE
    own = [_correlation(angle[:, i], pressed[:, i]) for i in range(2)]
    wrong = [i for i in range(2) if moved[i] and shown[i] and own[i] < OPPOSED]
    guess = f"sign of {' and '.join('xy'[i] for i in wrong)}?" if wrong else ""
    if moved.all() and shown.all():
        exchanged = [_correlation(angle[:, 1 - i], pressed[:, i]) for i in range(2)]
        if abs(exchanged[0]) + abs(exchanged[1]) > sum(map(abs, own)) + AXES_MARGIN:
            guess = "axes x and y exchanged?"
    if (moved & (angle[:, :2].std(axis=0) < STILL_ANGLE)).any():
        guess = "no motion at all: unit, or a gyro that does not work?"
    for i in range(2):
        power = float(angle[:, i] @ angle[:, i])
        slope = abs(float(angle[:, i] @ pressed[:, i])) / power if power > 0.0 else GAIN_MIN
        if moved[i] and angle[:, i].std() > LARGE_ANGLE and slope < GAIN_MIN:
            guess = f"deg/s instead of rad/s? {guess}".strip()
            break
    if not guess:
        return ""
    return (
        f"imu/data angular_velocity: correlation of {own[0]:.2f} in roll and {own[1]:.2f} in pitch "
        f"with the accelerometer in the first stand; allowed: above {OPPOSED:g}, in rad/s; {guess} "
        "Mend it and start the sensors again; the robot stands"
    )


def _correlation(a: FloatArray, b: FloatArray) -> float:
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def _size(vector: FloatArray) -> float:
    return hypot(*vector.tolist())


def _angle(a: FloatArray, b: FloatArray) -> float:
    size = _size(a) * _size(b)
    return acos(min(1.0, max(-1.0, float(a @ b) / size))) if size > 0.0 else 0.0
