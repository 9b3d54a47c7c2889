"""The IMU against the soles of a robot that stands still on level ground."""

from math import asin, atan2, sqrt

from robot_core.types import Point3

SETTLING_TIME = 2.5
"""Time [s] for which a robot rocks after it has taken its stand."""
QUIET_RATE = 0.1
"""Largest deviation [rad/s] of the gyro from its mean in a quiet stand: noise, and the rocking that
is left, are below 0.03."""


class StandAlignment:
    """Means of gyro, accelerometer and sole normals over a quiet stand.

    Attributes:
        time: Duration [s] of the mean in this stand; 0 = none yet, the values are those of the last
            quiet stand.
        gyro: Mean gyro [rad/s], its bias.
        roll: Roll [rad] of the torso by the accelerometer minus that over the soles.
        pitch: The same for the pitch [rad].
    """

    def __init__(self) -> None:
        self.gyro: Point3 = (0.0, 0.0, 0.0)
        self.roll = self.pitch = 0.0
        self.restart()

    def restart(self) -> None:
        """A stand begins; the means of the last one are kept until this one has its own."""
        self.time = 0.0
        self._settling = 0.0
        self._count = 0
        self._gyro: Point3 = (0.0, 0.0, 0.0)
        self._force: Point3 = (0.0, 0.0, 0.0)
        self._normal: Point3 = (0.0, 0.0, 0.0)

    def update(
        self, gyro: Point3, force: Point3, left_normal: Point3, right_normal: Point3, dt: float
    ) -> None:
        """One tick of a settled stand. A robot that is moved meanwhile has to come to rest again.

        Args:
            gyro: Gyro [rad/s] in the torso frame.
            force: Accelerometer [m/s^2] in the torso frame.
            left_normal: Unit normal of the left sole in the torso frame, by the joint angles.
            right_normal: The same of the right sole.
            dt: Time [s] since the last tick.
        """
        self._settling += dt
        if self._settling < SETTLING_TIME:
            return
        if self.time > 0.0 and _distance(gyro, self.gyro) > QUIET_RATE:
            self.restart()
            return
        self._count += 1
        self._gyro = _plus(self._gyro, gyro)
        self._force = _plus(self._force, force)
        self._normal = _plus(_plus(self._normal, left_normal), right_normal)
        n = self._count
        self.gyro = self._gyro[0] / n, self._gyro[1] / n, self._gyro[2] / n
        roll, pitch = _tilt(self._force)
        sole_roll, sole_pitch = _tilt(self._normal)
        self.roll, self.pitch = roll - sole_roll, pitch - sole_pitch
        self.time = self._settling - SETTLING_TIME


def _plus(a: Point3, b: Point3) -> Point3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _distance(a: Point3, b: Point3) -> float:
    return sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


def _tilt(up: Point3) -> tuple[float, float]:
    """Roll and pitch [rad] of a torso in which the vertical is along `up`."""
    x, y, z = up
    length = sqrt(x * x + y * y + z * z)
    return (atan2(y, z), -asin(x / length)) if length > 0.0 else (0.0, 0.0)
