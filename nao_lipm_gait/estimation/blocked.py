"""Whether the robot is blocked: its steps fall short of those that it wants to make.

A robot that walks against something is held back. Its CoM lags, so the feedback shortens the steps,
and the swing foot has not arrived when it takes over. The joints show both: the steps of the
odometry are shorter than the wanted ones, for as long as the robot treads on. Those of a free walk
are so only while the wanted ones change.
"""

from collections import deque
from math import hypot

from robot_core.geometry import relative
from robot_core.types import Point2, Pose2

STEPS = 4
"""Number of steps over which a mean is taken: two strides."""
SHORT_AHEAD, SHORT_SIDEWAYS, SHORT = 0.25, 0.4, 0.003
"""Share of the wanted step ahead or back and sideways, and length [m] beyond it, by which blocked
steps fall short. Free robots that stumble sideways lose a third of their steps."""
STEP_MIN = 0.01
"""Shortest wanted step [m] that tells."""
RELEASE = 0.5
"""Share of that limit below which the robot is no longer blocked."""


class BlockedDetector:
    """Compares the steps of the odometry with the wanted ones, one step of a walk after the other.

    Attributes:
        way: Way, forward and to the left [m], in which the robot is blocked; None if it is not.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """The walk ends."""
        self.way: Point2 | None = None
        self._q_in_odom: Pose2 | None = None
        self._steps: deque[tuple[float, float, float, float]] = deque(maxlen=2 * STEPS)

    def step(self, wanted: Pose2, q_in_odom: Pose2) -> None:
        """The support changes.

        Args:
            wanted: Size that the step was meant to have, in its Q.
            q_in_odom: Pose of the new Q by the odometry.
        """
        last, self._q_in_odom = self._q_in_odom, q_in_odom
        if last is None:
            return
        made = relative(q_in_odom, last)
        self._steps.append((wanted[0], wanted[1], made[0], made[1]))
        if len(self._steps) < 2 * STEPS:
            return
        steps = list(self._steps)
        before_x, before_y, _, _ = _mean(steps[:STEPS])
        x, y, made_x, made_y = _mean(steps[STEPS:])
        size = hypot(x, y)
        if size < STEP_MIN:
            self.way = None
            return
        short = size - (made_x * x + made_y * y) / size
        share = (SHORT_AHEAD * abs(x) + SHORT_SIDEWAYS * abs(y)) / (abs(x) + abs(y))
        limit = SHORT + share * size + hypot(x - before_x, y - before_y)
        if short <= (limit if self.way is None else RELEASE * limit):
            self.way = None
        elif self.way is None:
            self.way = x, y


def _mean(steps: list[tuple[float, float, float, float]]) -> tuple[float, float, float, float]:
    x = y = made_x = made_y = 0.0
    for step in steps:
        x += step[0]
        y += step[1]
        made_x += step[2]
        made_y += step[3]
    count = len(steps)
    return x / count, y / count, made_x / count, made_y / count
