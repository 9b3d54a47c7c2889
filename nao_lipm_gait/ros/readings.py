"""From the numbers of a message to checked values. Plain data in and out, no ROS types.

Everything that is refused raises NaoGaitError with topic and field, value and what is allowed.
"""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import FloatArray, VelocityCommand

SPEED_ABSURD = 10.0
"""[m/s] No command for a small humanoid: a wrong unit or a broken sender."""
TURN_ABSURD = 100.0
"""[rad/s]"""
JOINT_MARGIN = 0.5
"""[rad] A joint that reads further beyond its limits than this is a broken reading."""
JOINT_SPEED_ABSURD = 200.0
"""[rad/s]"""
ACCELERATION_ABSURD = 1000.0
"""[m/s^2] Beyond any accelerometer of a robot."""
ROTATION_ABSURD = 200.0
"""[rad/s] Beyond any gyro of a robot."""

_NANOSECONDS = 1_000_000_000


def stamp_of(sec: int, nanosec: int, field: str) -> int:
    """[ns] from the two parts of a ROS stamp."""
    if nanosec >= _NANOSECONDS:
        raise NaoGaitError(f"{field}.nanosec", nanosec, "0 to 999999999")
    if sec < 0:
        raise NaoGaitError(f"{field}.sec", sec, "0 or more")
    return sec * _NANOSECONDS + nanosec


def finite(value: float, field: str, limit: float, unit: str) -> float:
    """`value`, if it is finite and not beyond `limit` in size."""
    if not math.isfinite(value) or abs(value) > limit:
        raise NaoGaitError(field, value, f"a finite number from {-limit:g} to {limit:g} {unit}")
    return value


def read_velocity(
    linear: Sequence[float], angular: Sequence[float], topic: str = "cmd_vel"
) -> VelocityCommand:
    """The planar part of a twist; linear and angular are x, y, z in [m/s] and [rad/s].

    The other three components are ignored, but must be finite: a sender with a NaN anywhere is
    broken.
    """
    for axis, value in zip("xyz", linear, strict=True):
        finite(value, f"{topic} linear.{axis}", SPEED_ABSURD, "m/s")
    for axis, value in zip("xyz", angular, strict=True):
        finite(value, f"{topic} angular.{axis}", TURN_ABSURD, "rad/s")
    return VelocityCommand(x=linear[0], y=linear[1], yaw=angular[2])


def read_vector(values: Sequence[float], field: str, limit: float, unit: str) -> FloatArray:
    """(3,) finite numbers of at most `limit`."""
    for axis, value in zip("xyz", values, strict=True):
        finite(value, f"{field}.{axis}", limit, unit)
    return np.array(values, dtype=float)


def check_orientation(quaternion: Sequence[float], covariance_0: float, topic: str) -> None:
    """Complain about an IMU that claims an orientation and gives none. x, y, z, w.

    REP-145: orientation_covariance[0] = -1 says that there is no orientation.
    """
    if covariance_0 == -1.0:
        return
    norm = math.sqrt(sum(value * value for value in quaternion))
    if not math.isfinite(norm) or abs(norm - 1.0) > 0.1:
        raise NaoGaitError(
            f"{topic} orientation",
            tuple(round(value, 6) for value in quaternion),
            "a unit quaternion, or orientation_covariance[0] = -1 for none",
        )


def some(names: Sequence[str]) -> str:
    """The first few of names that came from outside, none of them longer than a line."""
    shown = ", ".join(name[:40] for name in names[:5])
    return shown if len(names) <= 5 else f"{shown} and {len(names) - 5} more"


def repeated(names: Sequence[str]) -> str:
    """The names that occur more than once."""
    return some([name for name, count in Counter(names).items() if count > 1])


class JointReader:
    """Reads joints by name into the order of the robot's joint arrays."""

    def __init__(self, robot: RobotDescription, topic: str) -> None:
        self._topic = topic
        self._order = robot.joint_names
        self._lower = robot.lower - JOINT_MARGIN
        self._upper = robot.upper + JOINT_MARGIN
        self._names: list[str] | None = None
        self._indices = np.zeros(0, dtype=np.intp)

    def read(
        self, names: Sequence[str], position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[FloatArray, FloatArray | None]:
        """Position (n,) [rad] and velocity (n,) [rad/s], None where the message has no velocity.

        The names may come in any order and with extra joints among them.
        """
        indices = self._indices_of(names)
        count = len(names)
        if len(position) != count:
            raise NaoGaitError(
                f"{self._topic} position", f"{len(position)} values", f"{count}, one for each name"
            )
        if len(velocity) not in (0, count):
            raise NaoGaitError(
                f"{self._topic} velocity",
                f"{len(velocity)} values",
                f"{count}, one for each name, or none",
            )
        q = np.asarray(position, dtype=float)[indices]
        # A NaN fails the comparison too.
        inside = (q >= self._lower) & (q <= self._upper)
        if not inside.all():
            bad = int(np.argmin(inside))
            raise NaoGaitError(
                f"{self._topic} position[{self._order[bad]}]",
                float(q[bad]),
                f"a finite number from {self._lower[bad]:.3g} to {self._upper[bad]:.3g} rad",
            )
        if len(velocity) == 0:
            return q, None
        qd = np.asarray(velocity, dtype=float)[indices]
        slow = np.abs(qd) <= JOINT_SPEED_ABSURD
        if not slow.all():
            bad = int(np.argmin(slow))
            raise NaoGaitError(
                f"{self._topic} velocity[{self._order[bad]}]",
                float(qd[bad]),
                f"a finite number of at most {JOINT_SPEED_ABSURD:g} rad/s",
            )
        return q, qd

    def _indices_of(self, names: Sequence[str]) -> np.ndarray:
        if names == self._names:  # the usual case: the same sender as before
            return self._indices
        field = f"{self._topic} name"
        place = {name: index for index, name in enumerate(names)}
        if len(place) != len(names):
            raise NaoGaitError(field, f"{repeated(names)} more than once", "each joint once")
        missing = [name for name in self._order if name not in place]
        if missing:
            raise NaoGaitError(
                field,
                f"no {', '.join(missing)}",
                f"all {len(self._order)} joints of the robot, in any order",
            )
        self._indices = np.array([place[name] for name in self._order], dtype=np.intp)
        self._names = list(names)
        return self._indices
