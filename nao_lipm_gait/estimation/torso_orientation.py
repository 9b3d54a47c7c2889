"""Torso orientation relative to gravity, from gyro, accelerometer and the flat support foot.

The state is u, the unit vertical in the torso frame. The gyro turns it. Two slow corrections remove
its drift: towards the specific force, whose mean over a gait cycle is gravity, and towards the
normal of the support sole, which lies flat on the ground unless the robot tips. At first
the mean of all accelerometer samples so far is used, because the first one may be an impact.
"""

from math import acos, asin, atan2, cos, hypot, sqrt

from robot_core.geometry import dot
from robot_core.types import GRAVITY, Point3

UPRIGHT: Point3 = (0.0, 0.0, 1.0)
UPRIGHT_TIME = 0.3
"""[s] For how long a robot that moves counts as having been upright: an impact must not tilt it."""

STANCE_UP_MIN = cos(0.35)
"""Cosine of the tilt above which the stance sole is not taken as flat."""


class TorsoOrientation:
    """Complementary filter of the vertical; yaw is not observed.

    Args:
        accelerometer_time: Time constant [s] of the correction by the specific force.
        stance_time: Time constant [s] of the correction by the support sole.

    Attributes:
        up_in_torso: Unit vertical in the torso frame.
    """

    def __init__(self, accelerometer_time: float, stance_time: float) -> None:
        self._accelerometer_time = accelerometer_time
        self._stance_time = stance_time
        self.up_in_torso = UPRIGHT
        self._age = 0.0

    def set_stance_time(self, stance_time: float) -> None:
        """Change the time constant [s] of the correction by the support sole."""
        self._stance_time = stance_time

    @property
    def roll(self) -> float:
        """Roll [rad], REP-103."""
        return atan2(self.up_in_torso[1], self.up_in_torso[2])

    @property
    def pitch(self) -> float:
        """Pitch [rad], REP-103."""
        return -asin(min(1.0, max(-1.0, self.up_in_torso[0])))

    @property
    def tilt(self) -> float:
        """Angle [rad] between the torso's z axis and the vertical."""
        return acos(min(1.0, max(-1.0, self.up_in_torso[2])))

    def reset(self, specific_force: Point3, age: float = 0.0) -> None:
        """Begin with the accelerometer alone, as at rest; upright if it measures no force.

        Args:
            specific_force: Accelerometer [m/s^2] in the torso frame.
            age: Time [s] for which this has been its mean.
        """
        self._age = age
        length = sqrt(dot(specific_force, specific_force))
        if length > 1.0:
            x, y, z = specific_force
            scale = 1.0 / length
            self.up_in_torso = (x * scale, y * scale, z * scale)
        else:
            self.up_in_torso = UPRIGHT

    def reset_moving(self, specific_force: Point3) -> None:
        """Begin upright, as for a moving robot, whose first samples may be far from gravity.

        Args:
            specific_force: Accelerometer [m/s^2] in the torso frame; of a robot that lies it is so
                far from upright that only the next samples count.
        """
        x, y, z = specific_force
        self._age = UPRIGHT_TIME if hypot(x, y) < z else 0.0
        self.up_in_torso = UPRIGHT

    def update(
        self,
        angular_velocity: Point3,
        specific_force: Point3,
        sole_normal: Point3 | None,
        dt: float,
    ) -> None:
        """One tick.

        Args:
            angular_velocity: Gyro [rad/s] in the torso frame.
            specific_force: Accelerometer [m/s^2] in the torso frame.
            sole_normal: Unit z axis of the support sole in the torso frame, by the joint angles;
                None while the robot does not stand on it.
            dt: Time [s] since the last tick.
        """
        wx, wy, wz = angular_velocity
        x, y, z = self.up_in_torso
        # A fixed vertical in the frame of a turning torso: du/dt = u x w.
        x, y, z = x + dt * (y * wz - z * wy), y + dt * (z * wx - x * wz), z + dt * (x * wy - y * wx)
        # Not normalised before averaging: only the raw specific force has gravity as its mean.
        self._age += dt
        share = dt / min(self._accelerometer_time, self._age + dt)
        ax, ay, az = specific_force
        x += share * (ax / GRAVITY - x)
        y += share * (ay / GRAVITY - y)
        z += share * (az / GRAVITY - z)
        if sole_normal is not None and self.up_in_torso[2] > STANCE_UP_MIN:
            share = dt / self._stance_time
            x += share * (sole_normal[0] - x)
            y += share * (sole_normal[1] - y)
            z += share * (sole_normal[2] - z)
        length = sqrt(x * x + y * y + z * z)
        self.up_in_torso = (x / length, y / length, z / length) if length > 1e-6 else UPRIGHT
