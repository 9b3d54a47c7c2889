"""How fast the stance soles turn on the ground, for a robot without a yaw gyro that leans forward.

With roll phi, pitch theta and yaw psi of the torso (REP-103), the roll gyro reads

    omega_x = phi' - psi' sin(theta) + bias

so a torso that leans shows a share of its turning there. Over whole strides the roll comes back to
where it was, which the joints tell: roll and pitch are taken over the stance sole, so that a slope
does not matter. The bias is learned while the robot stands. What the sum over a stride then lacks
is a turn that the joints have not seen: the soles have turned.

A Kalman filter with one measurement per stride tells the three apart:

    x = (phi, c, bias), c [rad/m]: turn of the soles per walked metre
    phi(t) = phi + integral (omega_x + (psi'_joints + c |v|) sin(theta) - bias) dt
    z = mean over the stride of the torso's roll over its sole, expected: the mean of phi(t)

Means, because the roll of one moment depends on when in the sway the support changes.
It takes some strides to see a steady drift, and sees nothing of a single step or an upright torso.

How fast the stance sole turns on the ground, which only a yaw gyro can tell at once.

On a slippery floor the moment of the swing leg turns the stance foot. The joints do not see that:
they know how the torso turns over the sole, the gyro knows how it turns in the world.

How the torso turns about the vertical over its stance sole, by the joint angles.
"""

from math import atan2, hypot, remainder, sqrt, tau

import numpy as np

from nao_lipm_gait.estimation.com_measurement import LevelFrame
from nao_lipm_gait.geometry import dot
from nao_lipm_gait.types import FloatArray, Point3


class TurnOverSole:
    """Differences of the torso's heading over the sole that carries it."""

    def __init__(self) -> None:
        self._support = 0
        self._heading = 0.0

    def update(self, support: int, support_sole: LevelFrame) -> float | None:
        """The torso's turn [rad] since the last tick; None in one in which the support changes.

        support +1 left or -1 right.
        """
        before, self._heading = self._heading, support_sole.torso_yaw
        if support != self._support:
            self._support = support
            return None
        return remainder(self._heading - before, tau)


BIAS_TIME = 1.0
"""[s] of the average that learns the gyro's bias while the robot stands."""


class StanceTurn:
    """Turn of the stance sole from yaw gyro and joint angles."""

    def __init__(self) -> None:
        self._over_sole = TurnOverSole()
        self._bias = 0.0

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        angular_velocity: Point3,
        dt: float,
        at_rest: bool,
    ) -> float:
        """The sole's turn [rad] in this tick; zero in the one in which the support changes.

        support +1 left or -1 right; gyro [rad/s] in the torso frame; at_rest: the robot stands
        still, so what the gyro shows is its bias.
        """
        rate = dot(angular_velocity, support_sole.up)
        if at_rest:
            self._bias += min(1.0, dt / BIAS_TIME) * (rate - self._bias)
        over_sole = self._over_sole.update(support, support_sole)
        if at_rest or over_sole is None:
            return 0.0
        return (rate - self._bias) * dt - over_sole


BIAS_SIGMA = 0.005
"""[rad/s] of a gyro's bias before the robot has stood still."""
REST_READINGS, REST_SPREAD = 50, 0.03
"""How many make a mean that tells the bias at rest; [rad/s] that a gyro at rest may scatter."""
REST_SHARE, REST_SIGMA_MIN = 0.2, 1e-4
"""Share of the scatter by which the mean may be wrong, because a robot that has just stopped still
rocks; [rad/s] by which it may be wrong where nothing scatters."""
TURN_SIGMA = 0.3
"""[rad/m] of the soles' turn before a direction has been walked in; 6 deg/s at 35 cm/s."""
TURN_MAX = 1.0
"""[rad/m] that is believed: a gyro whose bias has jumped must not turn the robot in circles."""
ROLL_SIGMA = 0.004
"""[rad] of the mean roll by the joints, from stride to stride."""
UNKNOWN_ROLL = 0.1
"""[rad] of a roll of which nothing is known."""
ROLL_WALK, TURN_WALK, BIAS_WALK = 0.001, 0.1, 1e-4
"""Process noise per root of time: [rad/s^0.5], [rad/m/s^0.5], [rad/s/s^0.5]."""
GATE = 3.0
"""Deviations by which a measurement may surprise; beyond them the robot tips or is moved."""
SPEED_MIN = 0.05
"""[m/s] from which a walk has a direction."""
MAIN_AXIS = 1.5
"""A walk has the direction of the axis along which it is this much faster."""

_ROLL, _TURN, _BIAS = range(3)


class LeanTurn:
    """Turn of the stance sole from the roll gyro and the joint angles."""

    def __init__(self) -> None:
        self._over_sole = TurnOverSole()
        self._over_sole_rate = 0.0
        self._still: list[float] = []
        self._doubted: float | None = None
        """[rad/s] the last mean at rest, where it was an outlier."""
        self._walking = False
        self._direction: tuple[str, bool] | None = None
        self._stride = _Stride()
        self._x = np.zeros(3)
        self._P = np.diag([0.0, 0.0, BIAS_SIGMA**2])

    def update(
        self,
        support: int,
        support_sole: LevelFrame,
        sole_normal: Point3,
        roll_rate: float,
        velocity: tuple[float, float],
        dt: float,
        at_rest: bool,
    ) -> float:
        """The sole's turn [rad] in this tick, as far as it is steady.

        support +1 left or -1 right; the sole's normal and the gyro [rad/s] in the torso frame;
        velocity by odometry [m/s]; at_rest: the robot stands still, so what the gyro shows is its
        bias.
        """
        over_sole = self._over_sole.update(support, support_sole)
        if at_rest:
            self._walking = False
            self._learn_bias(roll_rate, dt)
            return 0.0
        self._still.clear()
        self._set_out(velocity)
        if over_sole is not None:
            self._over_sole_rate = over_sole / dt
        elif support > 0:
            self._end_stride()
        x, y, z = sole_normal
        lean, speed = -x, hypot(*velocity)
        self._stride.add(roll_rate + self._over_sole_rate * lean, lean * speed, atan2(y, z), dt)
        return float(self._x[_TURN]) * speed * dt

    def _learn_bias(self, roll_rate: float, dt: float) -> None:
        self._P[_BIAS, _BIAS] += BIAS_WALK**2 * dt
        self._still.append(roll_rate)
        if len(self._still) < REST_READINGS:
            return
        mean, spread = float(np.mean(self._still)), float(np.std(self._still))
        self._still.clear()
        if spread > REST_SPREAD:
            return
        H = np.array((0.0, 0.0, 1.0))
        sigma = max(REST_SHARE * spread, REST_SIGMA_MIN)
        if self._is_outlier(H, mean - self._x[_BIAS], sigma):
            before, self._doubted = self._doubted, mean
            if before is None or abs(mean - before) > GATE * sqrt(2.0) * sigma:
                return
            # Twice the same: not a robot that is moved but another bias.
            self._forget(_BIAS, abs(mean))
        self._doubted = None
        self._correct(H, mean - self._x[_BIAS], sigma)

    def _set_out(self, velocity: tuple[float, float]) -> None:
        """Forget the turn when another direction is walked: each has its own."""
        if not self._walking:
            self._walking = True
            self._stride = _Stride()
            self._over_sole_rate = 0.0
            self._forget(_ROLL, UNKNOWN_ROLL)
        x, y = velocity
        if hypot(x, y) < SPEED_MIN:
            return
        along_x = abs(x) > abs(y) if self._direction is None else self._direction[0] == "x"
        if max(abs(x), abs(y)) > MAIN_AXIS * min(abs(x), abs(y)):
            along_x = abs(x) > abs(y)
        direction = ("x", x > 0.0) if along_x else ("y", y > 0.0)
        if direction != self._direction:
            self._direction = direction
            self._forget(_TURN, TURN_SIGMA)

    def _end_stride(self) -> None:
        stride, self._stride = self._stride, _Stride()
        if stride.time == 0.0:
            return
        rolled, leaned, time, roll = stride.means()
        H = np.array((1.0, leaned, -time))
        surprise = roll - rolled - float(H @ self._x)
        if self._is_outlier(H, surprise, ROLL_SIGMA):
            surprise += self._x[_ROLL]
            self._forget(_ROLL, UNKNOWN_ROLL)
        self._correct(H, surprise, ROLL_SIGMA)
        F = np.array(((1.0, stride.leaned, -stride.time), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
        self._x = F @ self._x
        self._x[_ROLL] += stride.rolled
        self._x[_TURN] = min(max(self._x[_TURN], -TURN_MAX), TURN_MAX)
        Q = np.diag(np.square((ROLL_WALK, TURN_WALK, BIAS_WALK)) * stride.time)
        self._P = F @ self._P @ F.T + Q

    def _is_outlier(self, H: FloatArray, surprise: float, sigma: float) -> bool:
        return abs(surprise) > GATE * sqrt(float(H @ self._P @ H) + sigma**2)

    def _correct(self, H: FloatArray, surprise: float, sigma: float) -> None:
        K = self._P @ H / (H @ self._P @ H + sigma**2)
        self._x = self._x + K * surprise
        self._P = self._P - np.outer(K, H @ self._P)

    def _forget(self, state: int, sigma: float) -> None:
        """Nothing is known any more about one state but how large it may be."""
        self._x[state] = 0.0
        self._P[state] = self._P[:, state] = 0.0
        self._P[state, state] = sigma**2


class _Stride:
    """What happens from one step on the left foot to the next."""

    def __init__(self) -> None:
        self.time = 0.0
        self.rolled = 0.0
        """[rad] by gyro and joints, without bias and turn of the soles."""
        self.leaned = 0.0
        """[m] walked, times the sine of the lean."""
        self._sums = [0.0, 0.0, 0.0, 0.0]
        self._ticks = 0

    def add(self, roll_rate: float, lean_speed: float, roll: float, dt: float) -> None:
        """One tick: d rolled / dt [rad/s], d leaned / dt [m/s], roll by the joints [rad]."""
        self.time += dt
        self.rolled += roll_rate * dt
        self.leaned += lean_speed * dt
        for i, value in enumerate((self.rolled, self.leaned, self.time, roll)):
            self._sums[i] += value
        self._ticks += 1

    def means(self) -> tuple[float, float, float, float]:
        """Over the ticks so far: rolled, leaned, time since the beginning, roll by the joints."""
        rolled, leaned, time, roll = (total / self._ticks for total in self._sums)
        return rolled, leaned, time, roll
