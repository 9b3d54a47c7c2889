"""What a message says, as plain data: the same whether it came over DDS or from a test."""

from collections.abc import Sequence
from dataclasses import dataclass

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class TwistInput:
    """`cmd_vel`: x, y, z."""

    linear: Triple
    """[m/s]"""
    angular: Triple
    """[rad/s]"""


@dataclass(frozen=True, slots=True)
class ImuInput:
    """`imu/data`, along the axes of the torso (REP-145)."""

    sec: int
    nanosec: int
    angular_velocity: Triple
    """[rad/s]"""
    linear_acceleration: Triple
    """[m/s^2]"""
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """Quaternion x y z w."""
    orientation_covariance: float = -1.0
    """First element; -1 = there is no orientation."""
    angular_velocity_covariance: float = 0.0
    """First element; -1 = there is no such field."""
    linear_acceleration_covariance: float = 0.0
    """First element; -1 = there is no such field."""


@dataclass(frozen=True, slots=True)
class JointInput:
    """`joint_states`."""

    sec: int
    nanosec: int
    names: Sequence[str]
    position: Sequence[float]
    """[rad], one for each name."""
    velocity: Sequence[float]
    """[rad/s], one for each name or none."""


@dataclass(frozen=True, slots=True)
class LoadInput:
    """`l_sole/wrench`, `r_sole/wrench`."""

    sec: int
    nanosec: int
    side: int
    """0 left, 1 right."""
    force: float
    """[N] of the floor along the normal of the sole."""


Input = TwistInput | ImuInput | JointInput | LoadInput
