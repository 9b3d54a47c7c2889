"""Does each leg motor still give torque? Judged while the robot walks.

A joint is somewhere between its targets of the last moments, also if messages are late. One that is
not is forced away, by a floor or by another robot, and its motor pulls back; or its motor gives no
torque. What the motor gives tells them apart, on a robot that measures it.
"""

from collections.abc import Callable, Sequence

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
        legs = set(robot.leg_joints) - followers
        self._names = robot.joint_names
        motors = [robot.motors[name] for name in self._names]
        judged = np.array([name in legs for name in self._names])
        stall = np.array([motor.stall_torque for motor in motors])
        self._no_torque = np.where(judged, NO_TORQUE * stall, -1.0)
        self._fast = FAST * period * np.array([motor.no_load_speed for motor in motors])
        self.restart()

    def restart(self) -> None:
        """The motors may be mended."""
        self.trouble = ""
        self._pulled = np.zeros(len(self._names), dtype=bool)
        """A driver may fill in zeros for a torque that is not measured."""
        self._all_pulled = False
        self.interrupt()

    def interrupt(self) -> None:
        """The robot does not walk, or nobody knows where its joints should be."""
        self._last: FloatArray | None = None
        self._unsettled = UNSETTLED
        self._count = np.zeros(len(self._names), dtype=int)

    def update(
        self,
        measured: FloatArray,
        effort: FloatArray,
        target: FloatArray,
        around: Callable[[], Sequence[FloatArray]],
        ticks: int,
    ) -> None:
        """One reading of a robot that walks.

        Args:
            measured: Joint angles (n,) [rad].
            effort: Motor torques (n,) [N m]; NaN where they are not measured.
            target: Joint angles (n,) [rad] that the reading should show.
            around: Returns the targets (n,) [rad] of `OLDER` control periods before to `NEWER`
                after that one, itself included.
            ticks: Control periods since the last reading.
        """
        if ticks > BRIDGED:
            self.interrupt()
        self._unsettled = max(0, self._unsettled - 1)
        if not self._all_pulled:
            self._pulled |= np.abs(effort) > self._no_torque
            self._all_pulled = bool(self._pulled.all())
        last, self._last = self._last, measured
        if last is None or self._unsettled or self.trouble:
            return
        limp = np.abs(measured - target) > LEFT
        if limp.any():
            limp &= self._pulled & (np.abs(effort) <= self._no_torque)  # false for NaN
        if not limp.any():
            self._count[:] = 0
            return
        wanted = np.array(around())
        above, below = measured - wanted.max(axis=0), wanted.min(axis=0) - measured
        left = np.maximum(above, below)
        back = np.where(above > below, last - measured, measured - last)
        # A reading that does not change at all is of an encoder that is stuck.
        limp &= (left > LEFT) & (back < ticks * self._fast) & (measured != last)
        self._count = np.where(limp, self._count + 1, 0)
        if self._count.max() < TICKS:
            return
        joint = int(np.argmax(self._count))
        self.trouble = (
            f"joint_states effort[{self._names[joint]}]: got {effort[joint]:.2g} N m, "
            f"{left[joint]:.2g} rad outside its last targets; allowed: at least "
            f"{self._no_torque[joint]:.2g} N m from {LEFT:g} rad on; motor off? The robot stands"
        )
