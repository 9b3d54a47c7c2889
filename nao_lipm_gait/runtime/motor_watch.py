"""Does each leg motor still move its joint? Judged while the robot walks.

A joint is somewhere between its targets of the last moments, also if messages are late. One whose
motor gives no torque leaves them within 0.1 to 0.2 s, as soon as it carries a load.
"""

from collections.abc import Sequence

import numpy as np

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray

OLDER, NEWER = 7, 2
"""Control periods by which a reading may lag behind its target, and be ahead of it."""
LEFT = 0.06
"""[rad] outside its targets at which a joint no longer follows them. NAOs that are pushed leave
them by 0.01; an encoder that slips, by up to 0.052."""
USUAL = 3.0
"""The same as a multiple of what the second joint has left its own by: motors that are too weak for
a walk are more than one."""
TICKS = 6
"""Readings in a row. A sole that slips and grips again forces a knee out for 4."""
WALKED = 0.6
"""[s] of steps before a walk is judged: what is wrong from the start is found by `JointCheck`,
which knows more reasons."""
BRIDGED, UNSETTLED = 3, 12
"""Control periods to the next reading up to which nothing is lost that matters, and readings after
a longer gap that are left out: targets have not arrived either, or late."""


class MotorWatch:
    """Compares leg joints with the range of their targets; one tick after the other.

    Motors that give way under load are not judged.

    Args:
        robot: The robot.
        period: Control period [s].

    Attributes:
        trouble: Which joint does not follow; empty while none is known.
        needed: The robot has motors that can be judged.
    """

    def __init__(self, robot: RobotDescription, period: float) -> None:
        followers = {follower for _, follower in robot.coupled_joints}  # without a motor
        names = dict.fromkeys((*robot.left_leg.names, *robot.right_leg.names))
        self._names = [name for name in names if name not in followers]
        self._index = np.array([robot.index(name) for name in self._names])
        self._walk_ticks = round(WALKED / period)
        self.needed = not robot.soft_joint
        self.restart()

    def restart(self) -> None:
        """The motors may be mended."""
        self.trouble = ""
        self._usual = 0.0
        self.interrupt()

    def interrupt(self) -> None:
        """The robot does not walk, or nobody knows where its joints should be."""
        self._walked = self._unsettled = 0
        self._last: FloatArray | None = None
        self._count = np.zeros(len(self._names), dtype=int)

    def update(self, measured: FloatArray, targets: Sequence[FloatArray], ticks: int) -> None:
        """One reading of a robot that walks.

        Args:
            measured: Joint angles (n,) [rad].
            targets: Those (n,) [rad] of `OLDER` control periods before to `NEWER` after the one
                that the reading should show.
            ticks: Control periods since the last reading.
        """
        self._walked += ticks
        if ticks > BRIDGED:
            self._unsettled = UNSETTLED
        now, last = measured[self._index], self._last
        self._last = now
        self._unsettled = max(0, self._unsettled - 1)
        if last is None or self._unsettled or self._walked < self._walk_ticks or self.trouble:
            self._count[:] = 0
            return
        wanted = np.array(targets)[:, self._index]
        left = np.maximum(now - wanted.max(axis=0), wanted.min(axis=0) - now)
        # A reading that does not change at all is of an encoder that is stuck.
        gone = (left > max(LEFT, USUAL * self._usual)) & (now != last)
        self._count = np.where(gone, self._count + 1, 0)
        self._usual = max(self._usual, float(np.partition(left, -2)[-2]))
        if self._count.max() < TICKS:
            return
        joint = int(np.argmax(np.where(self._count >= TICKS, left, 0.0)))
        self.trouble = (
            f"joint_states position[{self._names[joint]}]: got {left[joint]:.2g} rad outside its "
            f"last targets; allowed: {LEFT:g} rad; motor without torque, or blocked? The robot "
            "stands"
        )
