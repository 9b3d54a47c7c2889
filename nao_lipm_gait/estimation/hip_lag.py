"""How weak the motors are: by how much the hip of the swing leg lags behind its targets.

In long strides the hip pitch has to swing the whole leg, and motors without much torque fall behind
in it, while the knee follows as ever. A lag is the time tau that explains best why a joint is not
at its target, q_target - q = tau dq_target/dt over a swing. That of the knee is subtracted: latency
that is not known delays both joints alike.
"""

from nao_lipm_gait.whole_body.leg_kinematics import LegColumns
from robot_core.geometry import float_view
from robot_core.robot import RobotDescription
from robot_core.types import LEFT, RIGHT, FloatArray

STRIDE_MIN, STRIDE_MAX = 0.05, 0.07
"""Wanted steps ahead [m] that tell: in shorter ones weak motors keep up, in longer ones all lag."""
TICKS_MIN = 8
"""Ticks of a whole swing; a shorter one was interrupted."""
SWINGS = 4
"""Swings after which the lag is known."""
SMOOTHING = 0.15
"""Weight of a new swing in the mean."""


class HipLag:
    """Mean lag of the hips in strides of medium length, one tick after the other.

    Args:
        robot: The robot, scaled to the size of a NAO.

    Attributes:
        mean: Lag of the hips minus that of the knees [s]; None while it is not known.
    """

    def __init__(self, robot: RobotDescription) -> None:
        left, right = LegColumns(robot, robot.left_leg), LegColumns(robot, robot.right_leg)
        self._columns = {
            LEFT: (left.hip_pitch, left.knee_pitch),
            RIGHT: (right.hip_pitch, right.knee_pitch),
        }
        self.mean: float | None = None
        self._lag = 0.0
        self._swings = 0
        self.interrupt()

    def interrupt(self) -> None:
        """The robot does not walk, or frames are missing: the swing does not count."""
        self._support = 0
        self._ticks = 0
        self._hip = self._hip_square = self._knee = self._knee_square = 0.0

    def update(
        self,
        support: int,
        step_ahead: float,
        measured: FloatArray,
        targets: tuple[FloatArray, FloatArray, FloatArray],
        dt: float,
    ) -> None:
        """One tick of a walk.

        Args:
            support: Supporting leg, LEFT or RIGHT, when the joints were measured.
            step_ahead: Wanted step ahead [m] that the last support change ended.
            measured: Joint angles (n,) [rad].
            targets: Joint targets (n,) [rad] that they answer, between those of the tick before and
                of the tick after.
            dt: Time between two ticks [s].
        """
        if support != self._support:
            if self._support:
                self._swing_ends(step_ahead)
            self.interrupt()
            self._support = support
        before, target, after = map(float_view, targets)
        angles = float_view(measured)
        hip, knee = self._columns[-support]
        rate = 0.5 * (after[hip] - before[hip]) / dt
        self._hip += (target[hip] - angles[hip]) * rate
        self._hip_square += rate * rate
        rate = 0.5 * (after[knee] - before[knee]) / dt
        self._knee += (target[knee] - angles[knee]) * rate
        self._knee_square += rate * rate
        self._ticks += 1

    def _swing_ends(self, step_ahead: float) -> None:
        moved = self._hip_square > 0.0 and self._knee_square > 0.0
        if self._ticks < TICKS_MIN or not moved or not STRIDE_MIN <= step_ahead <= STRIDE_MAX:
            return
        lag = self._hip / self._hip_square - self._knee / self._knee_square
        self._swings += 1
        self._lag += max(SMOOTHING, 1.0 / self._swings) * (lag - self._lag)
        if self._swings >= SWINGS:
            self.mean = self._lag
