"""How a robot turns while it falls, lies and gets up.

The yaw gyro of a robot that has none reads 0. While the torso is far from upright, the other two
see most of the turn: what remains is about 50 degrees (standard deviation), without them 110.
"""

from math import atan2, remainder, sqrt, tau

from robot_core.geometry import cross, dot
from robot_core.rate_limiter import limited_step
from robot_core.types import Point3

FORWARD_MIN = 0.5
"""Smallest horizontal part of the torso's x axis: that of a vertical one has no direction."""
RATE_MAX = 8.0
"""[rad/s] With which the change during such a pose is added: `odom` does not jump (REP-105)."""


class YawOffFeet:
    """Yaw of the torso by the gyro alone, also through poses in which the yaw is undefined.

    The state is a unit vector that is fixed in the world and horizontal, in the torso frame. The
    gyro turns it, the vertical keeps it horizontal.
    """

    def __init__(self) -> None:
        self._fixed: Point3 | None = None
        self._yaw = 0.0

    def interrupt(self) -> None:
        """The robot is on its feet again; begin anew with the next tick."""
        self._fixed = None

    def update(self, up: Point3, angular_velocity: Point3, dt: float) -> float:
        """One tick.

        Args:
            up: Unit vertical in the torso frame.
            angular_velocity: Gyro [rad/s] in the torso frame; z is 0 without a yaw gyro.
            dt: Time [s] since the last tick.

        Returns:
            Change of the yaw [rad] since the last tick, at most `RATE_MAX` times `dt`; what is more
            follows. 0 in the first tick and while the torso's x axis is far from horizontal.
        """
        if self._fixed is None:
            self._fixed, self._yaw = _horizontal((1.0, 0.0, 0.0), up), 0.0
            return 0.0
        turn = cross(self._fixed, angular_velocity)  # of a fixed vector in a turning frame
        x, y, z = (a + dt * b for a, b in zip(self._fixed, turn, strict=True))
        self._fixed = _horizontal((x, y, z), up)
        forward = (1.0 - up[0] * up[0], -up[0] * up[1], -up[0] * up[2])
        if dot(forward, forward) < FORWARD_MIN**2:
            return 0.0
        left = cross(up, forward)
        yaw = -atan2(dot(self._fixed, left), dot(self._fixed, forward))
        change = limited_step(0.0, remainder(yaw - self._yaw, tau), RATE_MAX * dt)
        self._yaw += change
        return change


def _horizontal(vector: Point3, up: Point3) -> Point3:
    """The direction of the horizontal part of a vector; x, y, z in the torso frame."""
    along = dot(vector, up)
    x, y, z = (a - along * b for a, b in zip(vector, up, strict=True))
    length = sqrt(x * x + y * y + z * z)
    if length < 1e-6:
        return _horizontal((0.0, 1.0, 0.0), up)
    return x / length, y / length, z / length
