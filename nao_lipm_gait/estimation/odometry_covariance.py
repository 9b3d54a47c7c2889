"""Covariance of the odometry's pose, by the walked way and the variance of the heading."""

from collections import deque
from math import hypot

from robot_core.geometry import ORIGIN
from robot_core.types import Pose2, PoseCovariance

WAY_NOISE = 0.03
"""Deviation [m/m^0.5] of the walked way: feet that slip, and errors of the joint angles."""
VARIANCE_MIN = 1e-6
"""Smallest variance [m^2, rad^2]; filters cannot use 0."""
UNSEEN_STEPS = 4
"""Steps after which a blocked robot is noticed at the latest."""


class OdometryCovariance:
    """Covariance of the odometry's pose, step by step.

    With a heading error e, a step (dx, dy) in odom is (-dy, dx) e off; the covariance follows as
    F P F' + Q. The variance of the heading is that of the yaw slip's estimator. If it decreases, an
    earlier error was found, and the covariance of heading and place decreases alike. The way
    of a blocked robot may be all wrong, so it counts as a deviation of its own.
    """

    def __init__(self) -> None:
        self.pose = PoseCovariance(xx=VARIANCE_MIN, yy=VARIANCE_MIN, yaw=VARIANCE_MIN)
        self._last: Pose2 = ORIGIN
        self._before: deque[Pose2] = deque([ORIGIN], UNSEEN_STEPS)
        self._blocked_way = 0.0, 0.0

    def step(self, base_footprint: Pose2, yaw_variance: float, *, blocked: bool = False) -> None:
        """One step.

        Args:
            base_footprint: Pose of base_footprint in odom.
            yaw_variance: Variance [rad^2] of the heading.
            blocked: The robot walks against something, since some steps ago if it did not before.
        """
        x, y, _ = base_footprint
        dx, dy = x - self._last[0], y - self._last[1]
        self._last = base_footprint
        xx, xy, yy, x_yaw, y_yaw, yaw = self.pose
        way = WAY_NOISE**2 * hypot(dx, dy)
        yaw_after = max(yaw_variance, VARIANCE_MIN)
        share = min(1.0, yaw_after / yaw)
        self.pose = PoseCovariance(
            xx - 2.0 * dy * x_yaw + dy * dy * yaw + way,
            xy + dx * x_yaw - dy * y_yaw - dx * dy * yaw,
            yy + 2.0 * dx * y_yaw + dx * dx * yaw + way,
            share * (x_yaw - dy * yaw),
            share * (y_yaw + dx * yaw),
            yaw_after,
        )
        self._add_blocked(base_footprint, blocked=blocked)

    def _add_blocked(self, base_footprint: Pose2, *, blocked: bool) -> None:
        """Add what the square of the way of a blocked robot has grown by."""
        x, y = self._blocked_way
        if blocked:
            first = self._before[0]
            after = base_footprint[0] - first[0], base_footprint[1] - first[1]
            pose = self.pose
            self.pose = pose._replace(
                xx=pose.xx + max(0.0, after[0] ** 2 - x * x),
                yy=pose.yy + max(0.0, after[1] ** 2 - y * y),
            )
            self._blocked_way = max(abs(x), abs(after[0])), max(abs(y), abs(after[1]))
            return
        if (x, y) != (0.0, 0.0):  # that way is counted
            self._before.clear()
            self._blocked_way = 0.0, 0.0
        self._before.append(base_footprint)
