"""Which axes, signs and units of the IMU explain the motion of a robot that walks on its feet.

The support sole at s in the torso frame stands still, so joints and gyro tell the velocity of the
torso, v = -s' - w x s, and with gravity g u the specific force f = v' + w x v + g u, u' = -w x u.
For a torso near the upright, whose height over the sole is h, that is along x and y

    f_x = -s_x'' - a(w_y),   f_y = -s_y'' + a(w_x),   a(w) = -h w' + g (integral of w).

Each hypothesis of what the IMU measures leaves a part of the force unexplained. All signals pass
one band, so that constant errors and noise do not count. A robot that is held, lies or falls moves
in a way that no hypothesis explains.
"""

from functools import cache
from itertools import permutations, product
from math import atan2, pi, radians, remainder, tau
from typing import NamedTuple

import numpy as np

from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.types import GRAVITY, LEFT, RIGHT, FloatArray, SensorFrame

SMOOTH_TIME, BAND_TIME = 0.02, 0.25
"""[s] Time constants of the band, each twice."""
MEMORY = 1.5
"""[s] Time constant with which evidence is forgotten."""
FIRST, EVERY = 20, 10
"""Ticks of a walk from which on, and after which, the hypotheses are compared."""
BETTER = 1.3
"""Factor by which the axes as they are must leave more unexplained than others to be wrong. It is
larger before `SURE` ticks, as their power `HASTE`."""
SURE, HASTE = 70, 1.5
BEST, CLEAR = 0.9, 0.5
"""Factors of what others leave unexplained below which the axes as they are explain the motion
best, and must be right."""
ALIKE = 1.3
"""Factor within which hypotheses explain the motion equally well."""
UNEXPLAINED = 0.25
"""Largest share of the motion, the force and what the joints add to it, that a hypothesis may leave
unexplained."""
EMPTY = 0.7
"""Share of the motion along one axis from which on a hypothesis explains nothing of it."""
CONFIRMABLE, CONFIRMED = 30, 100
"""Ticks of walking after which the axes may be found right, and whose motion they must explain best
if it is not clear."""
LONGEST = 1000
"""Ticks of walking after which roll and pitch are no longer judged."""
STILL = 80
"""Ticks of a walk in which a gyro shows some motion."""
DEAD = 0.01
"""[rad/s] Deviation of a gyro that shows no motion; healthy ones reach 0.03 in the first steps."""
REST = 0.2
"""Share of the force from which on the joints alone do not explain it."""
ON_ITS_FEET = 0.6
"""Correlation of the lateral force with that of a torso that the joints move over the sole."""
DEAD_TURN = 0.01
"""Share of the squared turns below which a gyro shows none."""
TURN_RANGE, TURNS = (0.03, 0.5), 5
"""[rad] Turn of a step that counts, and their number from which on yaw is judged."""
TURN_UNEXPLAINED = 0.4
"""Largest share of the squared turns by the joints that the gyro, or its opposite, may leave."""


class Hypothesis(NamedTuple):
    """What the IMU may measure.

    Attributes:
        guess: In words; empty for the axes as they are.
        weights: (2, 7) of the signals whose sum is unexplained, along x and y.
    """

    guess: str
    weights: FloatArray


class ImuAxes:
    """Judges the first steps, one tick after the other.

    Args:
        body: Kinematics of the robot.
        period: Control period [s].
        yaw_gyro: The robot has one.

    Attributes:
        trouble: What is probably wrong; empty while nothing is known to be.
    """

    def __init__(self, body: BodyModel, period: float, *, yaw_gyro: bool) -> None:
        self._body, self._dt = body, period
        self._hypotheses = _hypotheses()
        self._weights = np.array([each.weights for each in self._hypotheses])
        self.trouble = ""
        self._confirmed = self._judged = 0
        self._yaw_is_judged = not yaw_gyro
        self._turns = np.zeros((2, 2))
        self._turned = 0
        self._stamp = 0
        self.interrupt()

    def interrupt(self) -> None:
        """The steps end: what comes next is another motion."""
        self._ticks = 0
        self._evidence = np.zeros((7, 7))
        self._rates = np.zeros((2, 3))
        self._turn: tuple[int, float, float] | None = None

    @property
    def done(self) -> bool:
        """The axes are known to be right."""
        return self._tilt_is_judged and self._yaw_is_judged

    @property
    def _tilt_is_judged(self) -> bool:
        return self._confirmed >= CONFIRMED or self._judged >= LONGEST

    def update(self, frame: SensorFrame, support: int) -> None:
        """One tick of a walk.

        Args:
            frame: As measured.
            support: The leg on which the robot stands, LEFT or RIGHT.
        """
        if frame.stamp - self._stamp > 1.5e9 * self._dt:  # frames were lost
            self.interrupt()
        self._stamp = frame.stamp
        if not self._tilt_is_judged:
            self._compare(frame, support)
        if not self._yaw_is_judged:
            self._compare_yaw(frame, support)
        self._joints = frame.joint_position

    # -- roll and pitch ----------------------------------------------------------------------------

    def _compare(self, frame: SensorFrame, support: int) -> None:
        dt, rate = self._dt, frame.angular_velocity
        self._body.set_joints(frame.joint_position)
        soles = np.array([self._body.sole_in_torso(side).position for side in (LEFT, RIGHT)])
        side = 0 if support == LEFT else 1
        if self._ticks == 0:
            self._soles, self._rate = soles, rate
            self._velocity = self._angle = np.zeros(3)
            self._stages = np.zeros((4, 7))
            self._first = np.append(frame.linear_acceleration[:2], np.zeros(5))
        self._ticks += 1
        self._judged += 1
        self._rates += rate, rate * rate
        velocity = (self._soles - soles)[side] / dt
        moved = (velocity - self._velocity) / dt
        self._angle = self._angle + dt * rate
        turned = soles[side, 2] * (rate - self._rate) / dt + GRAVITY * self._angle
        self._soles, self._rate, self._velocity = soles, rate, velocity
        signals = np.concatenate((frame.linear_acceleration[:2], moved[:2], turned))
        banded = self._in_band(signals - self._first)
        self._evidence = (1.0 - dt / MEMORY) * self._evidence + np.outer(banded, banded)
        if self._ticks % EVERY == 0 or FIRST <= self._ticks < CONFIRMABLE:
            self._judge()

    def _in_band(self, signals: FloatArray) -> FloatArray:
        """The signals (7,) behind two low passes and two high passes of the first order."""
        for stage, low in enumerate(self._stages):
            smooths = stage < 2
            time = SMOOTH_TIME if smooths else BAND_TIME
            low += self._dt / (time + self._dt) * (signals - low)
            signals = low.copy() if smooths else signals - low
        return signals

    def _judge(self) -> None:
        along = self._left_along()
        motion_along = self._forces_along() + self._evidence[(2, 3), (2, 3)]
        # A sole that rocks or slips along one axis is explained by nothing; what leaves least of
        # such a motion is not better.
        empty = along > EMPTY * motion_along
        left = np.sum(np.where(empty, np.maximum(along, along[0]), along), axis=1)
        motion = float(np.sum(motion_along[0]))
        best = int(np.argmin(left[1:])) + 1
        better = BETTER * max(1.0, SURE / self._ticks) ** HASTE
        if left[best] < UNEXPLAINED * motion and left[0] > better * left[best]:
            # Of those that explain it nearly as well the simplest, which come first.
            simplest = 1 + int(np.argmax(left[1:] < ALIKE * left[best]))
            self.trouble = self._hypotheses[simplest].guess
        elif self._ticks >= CONFIRMABLE:
            self._judge_still()
            if left[0] < min(UNEXPLAINED * motion, BEST * left[best]):
                self._confirmed += CONFIRMED if left[0] < CLEAR * left[best] else EVERY

    def _left_along(self) -> FloatArray:
        """(N, 2) Motion along x and y that each hypothesis leaves unexplained."""
        return np.sum(self._weights @ self._evidence * self._weights, axis=2)

    def _forces_along(self) -> FloatArray:
        """(N, 2) Force along x and y by each hypothesis."""
        force = self._weights[:, :, :2]
        return np.sum(force @ self._evidence[:2, :2] * force, axis=2)

    def _judge_still(self) -> None:
        """A gyro that shows nothing of what the force does beyond the joints."""
        evidence = self._evidence
        if self._ticks < STILL:
            return
        lateral = evidence[1, 3] / max((evidence[1, 1] * evidence[3, 3]) ** 0.5, 1e-9)
        if lateral < ON_ITS_FEET:
            return
        mean, squares = self._rates / self._ticks
        still = squares - mean * mean < DEAD * DEAD
        for axis, force, moved in ((0, 1, 3), (1, 0, 2)):
            rest = evidence[force, force] - 2.0 * evidence[force, moved] + evidence[moved, moved]
            if still[axis] and rest > REST * evidence[force, force]:
                self.trouble = f"no motion of angular_velocity.{'xy'[axis]}: unit, or it is dead?"
                return

    # -- yaw ---------------------------------------------------------------------------------------

    def _compare_yaw(self, frame: SensorFrame, support: int) -> None:
        """Compare the turn of each step by the joints of its support leg with that by the gyro."""
        turn = self._turn
        if turn is not None and turn[0] == support:
            rate = float(frame.angular_velocity[2])
            self._turn = support, turn[1], turn[2] + self._dt * rate
            return
        if turn is not None:
            step = remainder(self._yaw(self._joints, turn[0]) - turn[1], tau), turn[2]
            low, high = TURN_RANGE
            if low < abs(step[0]) < high:
                self._turns += np.outer(step, step)
                self._turned += 1
                self._judge_yaw()
        self._turn = support, self._yaw(frame.joint_position, support), 0.0

    def _yaw(self, joints: FloatArray, support: int) -> float:
        """Yaw [rad] of the torso over a sole."""
        self._body.set_joints(joints)
        x, y, _ = self._body.sole_in_torso(support).forward
        return -atan2(y, x)

    def _judge_yaw(self) -> None:
        (joints, both), (_, gyro) = self._turns.tolist()
        if self._turned < TURNS:
            return
        right, opposed = joints - 2.0 * both + gyro, joints + 2.0 * both + gyro
        if gyro < DEAD_TURN * joints:
            self.trouble = "no motion of angular_velocity.z: unit, or a gyro without yaw?"
        elif opposed < TURN_UNEXPLAINED * joints and right > BETTER * opposed:
            self.trouble = "sign of angular_velocity.z?"
        elif right < TURN_UNEXPLAINED * joints:
            self._yaw_is_judged = True


# -- hypotheses ------------------------------------------------------------------------------------

_DEGREE = radians(1.0)
_SCALES = (_DEGREE, 1.0 / _DEGREE, 0.1, 10.0, 0.5, 2.0)
_TURNS = (1, 3, 5, 7)
"""Eighths of a turn about the vertical; whole quarters are among the exchanged axes."""


@cache
def _hypotheses() -> tuple[Hypothesis, ...]:
    """All hypotheses, the axes as they are first, then the simplest."""
    forces = [_exchanged(order, signs) for order in ((0, 1), (1, 0)) for signs in _signs()]
    gyros = [_exchanged(order, signs) for order in permutations(range(3), 2) for signs in _signs()]
    pairs = [(force, gyro, 1.0) for force, gyro in product(forces, gyros)]
    pairs += [(forces[0], gyro, _DEGREE) for gyro in gyros[1:]]
    pairs += [(forces[0], gyros[0], scale) for scale in _SCALES]
    turns = [_turned(0.25 * pi * eighth) for eighth in _TURNS]
    pairs += [(turn, turn, 1.0) for turn in turns]
    pairs += [(turn, gyros[0], 1.0) for turn in turns] + [(forces[0], turn, 1.0) for turn in turns]
    pairs.sort(key=lambda pair: _complexity(*pair))
    return tuple(
        Hypothesis(_guess(force, gyro, scale), _weights(force[:, :2], scale * gyro))
        for force, gyro, scale in pairs
    )


def _complexity(force: FloatArray, gyro: FloatArray, scale: float) -> int:
    """How much would have to be wrong at once."""
    right = np.eye(2, 3)
    wrong = [not np.array_equal(force, right), not np.array_equal(gyro, right), scale != 1.0]
    as_one = _is_turn(force, gyro) and scale == 1.0
    return 2 * (sum(wrong) - (as_one and all(wrong[:2]))) + bool(gyro[:, 2].any())


def _is_turn(force: FloatArray, gyro: FloatArray) -> bool:
    """The whole IMU is turned about the vertical."""
    return np.allclose(force, gyro) and bool(np.isclose(np.linalg.det(force[:, :2]), 1.0))


def _signs() -> list[tuple[float, float]]:
    return [(x, y) for x in (1.0, -1.0) for y in (1.0, -1.0)]


def _exchanged(order: tuple[int, ...], signs: tuple[float, float]) -> FloatArray:
    """(2, 3) which gives the torso's x and y of a measured vector."""
    matrix = np.zeros((2, 3))
    matrix[(0, 1), order[:2]] = signs
    return matrix


def _turned(angle: float) -> FloatArray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array(((cos, -sin, 0.0), (sin, cos, 0.0)))


def _weights(force: FloatArray, gyro: FloatArray) -> FloatArray:
    along_x = (*force[0], -1.0, 0.0, *gyro[1])
    along_y = (*force[1], 0.0, -1.0, *-gyro[0])
    return np.array((along_x, along_y))


def _guess(force: FloatArray, gyro: FloatArray, scale: float) -> str:
    if scale == 1.0 and _is_turn(force, gyro):
        angle = round(np.degrees(atan2(force[1, 0], force[0, 0])))
        return f"an IMU that is turned by {-angle} deg about the vertical?" if angle else ""
    guesses = [_of_axes("linear_acceleration", force), _of_axes("angular_velocity", gyro)]
    if scale != 1.0:
        guesses.append(f"angular_velocity {1.0 / scale:.3g} times too large?")
    if scale == _DEGREE:
        guesses.append("deg/s instead of rad/s?")
    return " ".join(filter(None, guesses))


def _of_axes(field: str, matrix: FloatArray) -> str:
    found = np.argwhere(matrix != 0.0)
    if len(found) > 2:
        return f"{field} turned about the vertical?"
    moved = {"xyz"[axis] for pair in found.tolist() for axis in pair if pair[0] != pair[1]}
    if moved:
        return f"axes {' and '.join(sorted(moved))} of {field} exchanged?"
    wrong = [f"{field}.{'xy'[axis]}" for axis in (0, 1) if matrix[axis, axis] < 0.0]
    return f"sign of {' and '.join(wrong)}?" if wrong else ""
