"""Contents of the messages as plain data, and the checks of single fields.

The same data come from DDS, from a simulated robot or from a test. Every refusal is a NaoGaitError
with topic and field, value, and what is allowed. `sim_bridge` uses the checks for its own topics.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.types import FloatArray

Triple = tuple[float, float, float]

_NANOSECONDS = 1_000_000_000
_NAMES_SHOWN = 5
_NAME_LENGTH = 40


@dataclass(frozen=True, slots=True)
class TwistInput:
    """`cmd_vel`.

    Attributes:
        linear: x, y, z [m/s].
        angular: x, y, z [rad/s].
    """

    linear: Triple
    angular: Triple


@dataclass(frozen=True, slots=True)
class ImuInput:
    """`imu/data`, along the axes of the torso (REP-145).

    Attributes:
        sec: Seconds of the stamp.
        nanosec: Nanoseconds of the stamp.
        angular_velocity: x, y, z [rad/s].
        linear_acceleration: x, y, z [m/s^2]; (0, 0, +9.81) at rest upright.
        orientation: Quaternion x, y, z, w.
        orientation_covariance: First element; -1 means that the field is not filled (REP-145).
        angular_velocity_covariance: First element; -1 as above.
        linear_acceleration_covariance: First element; -1 as above.
    """

    sec: int
    nanosec: int
    angular_velocity: Triple
    linear_acceleration: Triple
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    orientation_covariance: float = -1.0
    angular_velocity_covariance: float = 0.0
    linear_acceleration_covariance: float = 0.0


@dataclass(frozen=True, slots=True)
class JointInput:
    """`joint_states`.

    Attributes:
        sec: Seconds of the stamp.
        nanosec: Nanoseconds of the stamp.
        names: Joints in any order; joints that the robot does not have are ignored.
        position: [rad], one for each name.
        waited: Wall time [s] from the arrival of the message until it was taken; for reports only.
        arrived: Time of its arrival [ns] on the clock of the stamps; None if that is unknown.
    """

    sec: int
    nanosec: int
    names: Sequence[str]
    position: Sequence[float]
    waited: float = 0.0
    arrived: int | None = None


@dataclass(frozen=True, slots=True)
class LoadInput:
    """`l_sole/wrench` or `r_sole/wrench`.

    Attributes:
        sec: Seconds of the stamp.
        nanosec: Nanoseconds of the stamp.
        side: 0 left, 1 right.
        force: Normal force of the floor on the sole [N].
    """

    sec: int
    nanosec: int
    side: int
    force: float


@dataclass(frozen=True, slots=True)
class TemperatureInput:
    """`temperature` of one motor.

    Attributes:
        sec: Seconds of the stamp.
        nanosec: Nanoseconds of the stamp.
        joint: The motor's joint.
        degrees: [deg C]
    """

    sec: int
    nanosec: int
    joint: str
    degrees: float


Input = TwistInput | ImuInput | JointInput | LoadInput | TemperatureInput


def stamp_of(sec: int, nanosec: int, field: str) -> int:
    """Join the two parts of a ROS stamp.

    Returns:
        The stamp [ns].

    Raises:
        NaoGaitError: For a negative time, or a second or more in `nanosec`.
    """
    if nanosec >= _NANOSECONDS:
        raise NaoGaitError(f"{field}.nanosec", nanosec, "0 to 999999999")
    if sec < 0:
        raise NaoGaitError(f"{field}.sec", sec, "0 or more")
    return sec * _NANOSECONDS + nanosec


def finite(value: float, field: str, limit: float, unit: str) -> float:
    """Check that a number is finite and not beyond `limit` in size.

    Args:
        value: The number.
        field: Its topic and field, for the error.
        limit: Largest size that is allowed.
        unit: Unit of both, for the error.

    Returns:
        `value`.

    Raises:
        NaoGaitError: If it is not.
    """
    if not math.isfinite(value) or abs(value) > limit:
        raise NaoGaitError(field, value, f"a finite number from {-limit:g} to {limit:g} {unit}")
    return value


def read_vector(values: Sequence[float], field: str, limit: float, unit: str) -> FloatArray:
    """Check the three components of a vector like `finite` does.

    Args:
        values: x, y, z.
        field: Topic and field, for the error.
        limit: Largest size of a component.
        unit: Unit of all, for the error.

    Returns:
        The vector (3,).

    Raises:
        NaoGaitError: With the first component that is refused.
    """
    for axis, value in zip("xyz", values, strict=True):
        finite(value, f"{field}.{axis}", limit, unit)
    return np.array(values, dtype=float)


def some(names: Sequence[str]) -> str:
    """Shorten a list of names for a message: the first few, each of a bounded length."""
    shown = ", ".join(name[:_NAME_LENGTH] for name in names[:_NAMES_SHOWN])
    rest = len(names) - _NAMES_SHOWN
    return shown if rest <= 0 else f"{shown} and {rest} more"


def repeated(names: Sequence[str]) -> str:
    """List the names that occur more than once, shortened."""
    return some([name for name, count in Counter(names).items() if count > 1])
