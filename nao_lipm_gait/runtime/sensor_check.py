"""The accelerometer proves itself in the stand before the first walk, and in its first steps.

It measures the vertical, which the joints over flat soles show too, the size of gravity, and a
force to the right while the first steps sway the torso to the left. The gyro is not judged: a robot
that is held, lies or has just fallen rocks in ways that look like a wrong one.
"""

from math import acos, hypot

import numpy as np

from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, FloatArray, SensorFrame

FORCE_TICKS = 30
"""Ticks over which gravity is averaged."""
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
BAND_TIME, SMOOTH_TIME = 0.2, 0.02
"""[s] Time constants of the band in which rocking is compared."""
OPPOSED = 0.45
"""Correlation above which the lateral force follows the sway instead of opposing it."""
SWAY_TICKS = 40
"""First ticks of a walk in which the sway by the joints is compared with the lateral force."""
SWAY_RATIO, SWAY_CORRELATION = 1.5, 0.5
"""Share of the force along x that follows the sway, and its correlation, from which on the axes are
exchanged; right ones stay below 0.3."""


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
        self.restart()

    def restart(self) -> None:
        """The sensors, or the robot's place, may be others from here on."""
        self.trouble = ""
        self.seems_to_lie = False
        self._lying_ticks = 0
        self._up: FloatArray | None = None
        self._forces: list[FloatArray] = []
        self._gravity_is_right = self._sway_is_judged = False
        self._sway: list[FloatArray] = []
        self._smooth = self._slow = np.zeros(3)
        self._first = True
        self._doubtful = False

    @property
    def done(self) -> bool:
        """Nothing more is to be judged, and all was right."""
        return self._gravity_is_right and self._sway_is_judged and not self.trouble

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
        force = frame.linear_acceleration
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
            if not self._sway_is_judged:
                self._judge_sway(frame, walks=walks)
            return self._at_rest(frame) if self.trouble else frame
        if not in_doubt or self.trouble:
            self._judge_gravity(frame)
        else:
            self._forces.clear()
        if self.trouble:
            return self._at_rest(frame)
        if self._doubtful and not self._gravity_is_right:
            return self._at_rest(frame)
        return frame

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
        elif _correlation(sway, lateral) > OPPOSED:
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


def _correlation(a: FloatArray, b: FloatArray) -> float:
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def _size(vector: FloatArray) -> float:
    return hypot(*vector.tolist())


def _angle(a: FloatArray, b: FloatArray) -> float:
    size = _size(a) * _size(b)
    return acos(min(1.0, max(-1.0, float(a @ b) / size))) if size > 0.0 else 0.0
