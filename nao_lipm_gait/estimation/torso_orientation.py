"""The torso's orientation against gravity, from gyro, accelerometer and the flat stance foot.

The state is u, the upward vertical in the torso frame. The gyro turns it; two slow pulls keep it
true: towards the specific force, whose mean over a gait cycle is gravity, and towards the normal
of the stance sole, which lies flat on the ground unless the robot tips. At first the accelerometer
counts as the mean of what it has said so far, because the first sample may be an impact's.
"""

from math import acos, asin, atan2, sqrt

from nao_lipm_gait.geometry import dot
from nao_lipm_gait.types import GRAVITY, Point3

UPRIGHT: Point3 = (0.0, 0.0, 1.0)


class TorsoOrientation:
    """Complementary filter on the vertical; yaw is not observed."""

    def __init__(self, accelerometer_time: float, stance_time: float, stance_limit: float):
        """Time constants of both pulls [s]; the tilt [rad] above which the sole is not flat."""
        self.set_times(accelerometer_time, stance_time, stance_limit)
        self._up = UPRIGHT
        self._age = 0.0

    def set_times(
        self, accelerometer_time: float, stance_time: float, stance_limit: float
    ) -> None:
        self._accelerometer_time = accelerometer_time
        self._stance_time = stance_time
        self._stance_limit = stance_limit

    @property
    def up_in_torso(self) -> Point3:
        """Unit vertical in the torso frame."""
        return self._up

    @property
    def roll(self) -> float:
        """[rad], REP-103."""
        return atan2(self._up[1], self._up[2])

    @property
    def pitch(self) -> float:
        """[rad], REP-103."""
        return -asin(min(1.0, max(-1.0, self._up[0])))

    @property
    def tilt(self) -> float:
        """Angle between the torso's z axis and the vertical [rad]."""
        return acos(min(1.0, max(-1.0, self._up[2])))

    def reset(self, specific_force: Point3) -> None:
        """Start from the accelerometer alone, as at rest; upright if it says nothing."""
        self._age = 0.0
        length = sqrt(dot(specific_force, specific_force))
        self._up = _scaled(specific_force, 1.0 / length) if length > 1.0 else UPRIGHT

    def reset_upright(self) -> None:
        """Start upright, for a robot that moves: one sample says nothing about gravity then."""
        self._age = 0.0
        self._up = UPRIGHT

    def update(
        self,
        angular_velocity: Point3,
        specific_force: Point3,
        sole_normal: Point3 | None,
        dt: float,
    ) -> None:
        """One tick: gyro [rad/s] and accelerometer [m/s^2] in the torso frame, dt [s];
        sole_normal: the stance sole's z axis in the torso frame by the joint angles, None while
        the robot does not stand on it.
        """
        wx, wy, wz = angular_velocity
        x, y, z = self._up
        # A fixed vertical seen from a turning torso: du/dt = u x w.
        x, y, z = x + dt * (y * wz - z * wy), y + dt * (z * wx - x * wz), z + dt * (x * wy - y * wx)
        # Not normalised before averaging: only the raw specific force has gravity as its mean.
        self._age += dt
        pull = dt / min(self._accelerometer_time, self._age + dt)
        ax, ay, az = specific_force
        x += pull * (ax / GRAVITY - x)
        y += pull * (ay / GRAVITY - y)
        z += pull * (az / GRAVITY - z)
        if sole_normal is not None and self.tilt < self._stance_limit:
            pull = dt / self._stance_time
            x += pull * (sole_normal[0] - x)
            y += pull * (sole_normal[1] - y)
            z += pull * (sole_normal[2] - z)
        length = sqrt(x * x + y * y + z * z)
        self._up = (x / length, y / length, z / length) if length > 1e-6 else UPRIGHT


def _scaled(vector: Point3, factor: float) -> Point3:
    return vector[0] * factor, vector[1] * factor, vector[2] * factor
