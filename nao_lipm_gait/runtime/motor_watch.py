"""Does each leg motor still give torque? Judged while the robot walks.

A joint is somewhere between its targets of the last moments, also if messages are late. One that is
not is forced away, by a floor or by another robot, and its motor pulls back; or its motor gives no
torque. What the motor gives tells them apart, on a robot that measures it.
"""

from collections.abc import Sequence

import numpy as np

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

OLDER, NEWER = 7, 2
"""Control periods by which a reading may lag behind its target, and be ahead of it."""
LEFT = 0.03
"""[rad] outside its targets from which a motor pulls a joint back."""
NO_TORQUE = 0.05
"""Share of the stall torque below which a motor does not pull."""
FAST = 0.3
"""Share of the no-load speed: a motor that moves its joint back faster needs no torque for it."""
TICKS = 4
"""Readings in a row: torques pass through zero."""
BRIDGED, UNSETTLED = 3, 12
"""Control periods to the next reading up to which nothing is lost that matters, and readings that
are left out after a longer gap or an interruption: targets have not arrived either, or late."""


class MotorWatch:
    """Compares leg joints with the range of their targets; one tick after the other.

    Args:
        robot: The robot.
        period: Control period [s].

    Attributes:
        trouble: Which motor gives no torque; empty while none is known.
    """

    def __init__(self, robot: RobotDescription, period: float) -> None:
        followers = {follower for _, follower in robot.coupled_joints}  # without a motor
        names = dict.fromkeys((*robot.left_leg.names, *robot.right_leg.names))
        self._names = [name for name in names if name not in followers]
        self._index = np.array([robot.index(name) for name in self._names])
        motors = [robot.motors[name] for name in self._names]
        self._no_torque = NO_TORQUE * np.array([motor.stall_torque for motor in motors])
        self._fast = FAST * period * np.array([motor.no_load_speed for motor in motors])
        self.restart()

    def restart(self) -> None:
        """The motors may be mended."""
        self.trouble = ""
        self._pulled = np.zeros(len(self._names), dtype=bool)
        """A driver may fill in zeros for a torque that is not measured."""
        self.interrupt()

    def interrupt(self) -> None:
        """The robot does not walk, or nobody knows where its joints should be."""
        self._last: FloatArray | None = None
        self._unsettled = UNSETTLED
        self._count = np.zeros(len(self._names), dtype=int)

    def update(
        self, measured: FloatArray, effort: FloatArray, targets: Sequence[FloatArray], ticks: int
    ) -> None:
        """One reading of a robot that walks.

        Args:
            measured: Joint angles (n,) [rad].
            effort: Motor torques (n,) [N m]; NaN where they are not measured.
            targets: Those (n,) [rad] of `OLDER` control periods before to `NEWER` after the one
                that the reading should show.
            ticks: Control periods since the last reading.
        """
        if ticks > BRIDGED:
            self.interrupt()
        self._unsettled = max(0, self._unsettled - 1)
        idle = ~(np.abs(effort[self._index]) > self._no_torque)  # true for NaN
        self._pulled |= ~idle
        now, last = measured[self._index], self._last
        self._last = now
        if last is None or self._unsettled or self.trouble or not targets:
            self._count[:] = 0
            return
        wanted = np.array(targets)[:, self._index]
        above, below = now - wanted.max(axis=0), wanted.min(axis=0) - now
        left = np.maximum(above, below)
        back = np.where(above > below, last - now, now - last)
        # A reading that does not change at all is of an encoder that is stuck.
        limp = (left > LEFT) & idle & self._pulled & (back < ticks * self._fast) & (now != last)
        self._count = np.where(limp, self._count + 1, 0)
        if self._count.max() < TICKS:
            return
        joint = int(np.argmax(self._count))
        self.trouble = (
            f"joint_states effort[{self._names[joint]}]: got {effort[self._index[joint]]:.2g} N m, "
            f"{left[joint]:.2g} rad outside its last targets; allowed: at least "
            f"{self._no_torque[joint]:.2g} N m from {LEFT:g} rad on; motor off? The robot stands"
        )
