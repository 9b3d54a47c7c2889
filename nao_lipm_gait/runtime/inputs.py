"""Contents of the messages as plain data, and the checks of single fields.

The same data come from DDS, from a simulated robot or from a test. Every refusal is a NaoGaitError
with topic and field, value, and what is allowed. `sim_bridge` uses the checks for its own topics.
"""

from collections.abc import Sequence
from dataclasses import dataclass

Triple = tuple[float, float, float]

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


