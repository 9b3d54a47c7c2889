"""What is known of a robot: names, limits, motors, soles, stand pose."""

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.types import FloatArray, Point2


@dataclass(frozen=True, slots=True)
class Motor:
    """A motor behind its gear, as felt at the joint."""

    stall_torque: float
    """[N m], without losses in the gear."""
    no_load_speed: float
    """[rad/s]"""
    reflected_inertia: float
    """[kg m^2]"""


@dataclass(frozen=True, slots=True)
class JointLimit:
    """Limits of a joint from the URDF."""

    lower: float
    """[rad]"""
    upper: float
    """[rad]"""
    velocity: float
    """[rad/s]"""
    effort: float
    """[N m]"""


@dataclass(frozen=True, slots=True)
class LegJoints:
    """Names of the joints of one leg, from the hip down."""

    hip_yaw: str
    hip_roll: str
    hip_pitch: str
    knee_pitch: str
    ankle_pitch: str
    ankle_roll: str

    @property
    def names(self) -> tuple[str, ...]:
        return dataclasses.astuple(self)


@dataclass(frozen=True, slots=True, eq=False)
class RobotDescription:
    """One robot. Joint arrays are (n,) in the order of `joint_names`; the arrays are read-only."""

    name: str
    urdf_path: Path
    urdf: str
    """The text of the URDF."""
    joint_names: tuple[str, ...]
    left_leg: LegJoints
    right_leg: LegJoints
    hip: str
    """`shared_yaw_pitch` (one motor, tilted axes) or `yaw` (a vertical axis each)."""
    coupled_joints: tuple[tuple[str, str], ...]
    """(leader, follower) pairs that one motor turns to the same angle."""
    shoulder_pitch: tuple[str, str]
    """Left, right: the joints that swing the arms; positive swings an arm back."""
    shoulder_roll: tuple[str, str] | None
    """Left, right: the joints that spread the arms, about x; None without them."""
    waist_pitch: str | None
    """The joint that leans the upper body over the hips; None without it."""
    preset: str
    """The gait preset that was made for this robot."""
    gyro_axes: int | None
    """3 where the robot has a yaw gyro; None = as in the plant."""
    encoder_bits: int | None
    """Counts of an encoder per turn = 2^bits; None = as in the plant."""
    base_frame: str
    torso_frame: str
    imu_frame: str
    sole_frames: tuple[str, str]
    """Left, right: below the ankle axes, on the ground plane of a flat foot."""
    stand_pose: FloatArray
    """(n,) [rad], inside the limits."""
    sole_outline: tuple[Point2, ...]
    """Convex hull of the left sole in its sole frame, counter-clockwise [m]; right: y mirrored."""
    sole_corners: tuple[Point2, ...]
    """Four points of the left outline: front inner, front outer, rear outer, rear inner."""
    ankle_limits: Mapping[str, tuple[tuple[float, float, float], ...]]
    """`left`, `right` -> rows (AnklePitch, lowest AnkleRoll, highest AnkleRoll), pitch rising."""
    motors: Mapping[str, Motor]
    limits: Mapping[str, JointLimit]
    lower: FloatArray = field(init=False)
    """(n,) [rad]"""
    upper: FloatArray = field(init=False)
    """(n,) [rad]"""
    velocity_limit: FloatArray = field(init=False)
    """(n,) [rad/s]"""

    def __post_init__(self) -> None:
        limits = [self.limits[name] for name in self.joint_names]
        for name, values in (
            ("lower", [limit.lower for limit in limits]),
            ("upper", [limit.upper for limit in limits]),
            ("velocity_limit", [limit.velocity for limit in limits]),
        ):
            object.__setattr__(self, name, read_only(values))

    def index(self, joint: str) -> int:
        """Where `joint` stands in a joint array."""
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise NaoGaitError("joint", joint, f"one of {', '.join(self.joint_names)}") from None


def read_only(values: Iterable[float]) -> FloatArray:
    """(n,) An array that nobody changes by mistake."""
    array = np.array(tuple(values), dtype=np.float64)
    array.setflags(write=False)
    return array
