"""What is known of a robot: names, limits, motors, soles, stand pose."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import attrs
import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.schema import Settings, number, text
from robot_core.types import FloatArray, Point2


@attrs.frozen
class Motor(Settings):
    """A motor behind its gear, as it acts on the joint."""

    stall_torque: float = number(
        minimum=1e-9, unit="N m", meaning="Stall torque, without losses in the gear."
    )
    no_load_speed: float = number(minimum=1e-9, unit="rad/s", meaning="No-load speed.")
    reflected_inertia: float = number(
        minimum=1e-12, unit="kg m^2", meaning="Inertia of the rotor, reflected through the gear."
    )
    nominal_torque: float | None = number(
        None, 1e-9, unit="N m", meaning="Torque that it can give for ever, without gear losses."
    )
    stiffness: float | None = number(
        None, 1e-3, unit="N m/rad",
        meaning="Torque per angle by which its joint is off; null = as stiff as a plant makes it.",
    )
    damping: float | None = number(
        None, 0.0, unit="N m s/rad", meaning="Torque against its speed; null with null stiffness."
    )


@attrs.frozen
class Battery(Settings):
    """A battery."""

    energy: float = number(minimum=1.0, unit="J", meaning="Energy when it is full.")
    empty_voltage: float = number(minimum=0.1, unit="V", meaning="Voltage when it is empty.")
    nominal_voltage: float = number(
        minimum=0.1, unit="V", meaning="Voltage for which the motors' torques are given."
    )
    full_voltage: float = number(minimum=0.1, unit="V", meaning="Voltage when it is full.")


@dataclass(frozen=True, slots=True)
class JointLimit:
    """Limits of a joint from the URDF.

    Attributes:
        lower: [rad]
        upper: [rad]
        velocity: [rad/s]
        effort: [N m]
    """

    lower: float
    upper: float
    velocity: float
    effort: float


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera of a robot.

    Attributes:
        frame: Link of its optical frame (REP-103: z along the line of sight, x right, y down).
        hfov: [rad] Horizontal angle of view.
    """

    frame: str
    hfov: float


@attrs.frozen
class LegJoints(Settings):
    """Names of the joints of one leg by role; hips and ankles may follow in any order."""

    hip_yaw: str = text()
    hip_roll: str = text()
    hip_pitch: str = text()
    knee_pitch: str = text()
    ankle_pitch: str = text()
    ankle_roll: str = text()

    @property
    def names(self) -> tuple[str, ...]:
        """All names, hip, knee, ankle."""
        return (*self.hip, self.knee_pitch, *self.ankle)

    @property
    def hip(self) -> tuple[str, str, str]:
        """Yaw, roll and pitch of the hip."""
        return self.hip_yaw, self.hip_roll, self.hip_pitch

    @property
    def ankle(self) -> tuple[str, str]:
        """Pitch and roll of the ankle."""
        return self.ankle_pitch, self.ankle_roll


@dataclass(frozen=True, slots=True, eq=False)
class RobotDescription:
    """One robot. Joint arrays are (n,) in the order of `joint_names` and read-only.

    Attributes:
        name: Its name.
        urdf_path: File of the URDF.
        urdf: Text of the URDF.
        remarks: What was mended in it; nodes log it.
        from_urdf: Keys of the robot file that come from the URDF, because it leaves them out, at
            least in part.
        robot_file: Path of the robot file; None if no file fits the URDF.
        joint_names: The joints.
        left_leg: Joints of the left leg.
        right_leg: Joints of the right leg.
        coupled_joints: (leader, follower) pairs that one motor turns to the same angle.
        head: Pan and tilt joint; None without them.
        shoulder_pitch: Left and right joint that swings the arm about y; None without them.
        shoulder_roll: Left and right joint that spreads the arm, about x; None without them.
        waist_pitch: Joint that pitches the upper body on the hips; None without it.
        size: Its size over that for which the numbers of the gait hold: the NAO's, by CoM height.
        preset: Gait preset of this robot; None = the default one, fitted to it.
        gyro_axes: 3 for a robot with a yaw gyro; None = as in the plant.
        encoder_bits: Counts of an encoder per turn = 2^bits; None = as in the plant.
        command_lag: [s] From a joint command to its effect: lag and interpolation of the motors.
        base_frame: Link of the base.
        torso_frame: Link of the torso.
        upper_body_frame: Link that carries the team's colour: what the waist turns, else the torso.
        imu_frame: Link of the IMU.
        sole_frames: Left and right link below the ankle axes, in the ground plane of a flat foot.
        stand_pose: (n,) [rad], inside the limits.
        sole_outline: [m] Convex hull of the left sole in its frame, counter-clockwise; the right
            one has y mirrored.
        sole_corners: [m] Four points of that outline: front inner, front outer, rear outer, rear
            inner.
        ankle_limits: `left`, `right` -> rows (AnklePitch, lowest AnkleRoll, highest AnkleRoll)
            [rad] of increasing pitch.
        motors: Motor by joint.
        motions: Folder of its shipped motions in config/motions.
        force_sensors: [m] Left and right sole, each in its frame: front left, front right, rear
            left, rear right sensor. None = not known.
        battery: None = not known.
        cameras: Camera by name; those whose optical frame the URDF has.
        limits: Limits by joint.
        lower: (n,) [rad]
        upper: (n,) [rad]
        velocity_limit: (n,) [rad/s]
    """

    name: str
    urdf_path: Path
    urdf: str
    remarks: tuple[str, ...]
    from_urdf: tuple[str, ...]
    robot_file: Path | None
    joint_names: tuple[str, ...]
    left_leg: LegJoints
    right_leg: LegJoints
    coupled_joints: tuple[tuple[str, str], ...]
    head: tuple[str, str] | None
    shoulder_pitch: tuple[str, str] | None
    shoulder_roll: tuple[str, str] | None
    waist_pitch: str | None
    size: float
    preset: str | None
    gyro_axes: int | None
    encoder_bits: int | None
    command_lag: float
    base_frame: str
    torso_frame: str
    upper_body_frame: str
    imu_frame: str
    sole_frames: tuple[str, str]
    stand_pose: FloatArray
    sole_outline: tuple[Point2, ...]
    sole_corners: tuple[Point2, ...]
    ankle_limits: Mapping[str, tuple[tuple[float, float, float], ...]]
    motors: Mapping[str, Motor]
    motions: str
    force_sensors: tuple[tuple[Point2, ...], tuple[Point2, ...]] | None
    battery: Battery | None
    cameras: Mapping[str, Camera]
    limits: Mapping[str, JointLimit]
    lower: FloatArray = field(init=False)
    upper: FloatArray = field(init=False)
    velocity_limit: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        limits = [self.limits[name] for name in self.joint_names]
        for name, values in (
            ("lower", [limit.lower for limit in limits]),
            ("upper", [limit.upper for limit in limits]),
            ("velocity_limit", [limit.velocity for limit in limits]),
        ):
            object.__setattr__(self, name, read_only(values))

    @property
    def leg_joints(self) -> tuple[str, ...]:
        """The joints of the left leg, then those of the right one, from the hips down."""
        return (*self.left_leg.names, *self.right_leg.names)

    @property
    def has_yaw_gyro(self) -> bool:
        """Whether the IMU measures the yaw rate."""
        return self.gyro_axes == 3

    @property
    def soft_joint(self) -> str:
        """The first joint whose motor gives way under load; empty if none does."""
        soft = (name for name, motor in self.motors.items() if motor.stiffness is not None)
        return next(soft, "")

    def index(self, joint: str) -> int:
        """Index of a joint in a joint array; NaoGaitError if it is unknown."""
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise NaoGaitError("joint", joint, self.joint_names) from None


def read_only(values: Iterable[float]) -> FloatArray:
    """A read-only array (n,)."""
    array = np.array(tuple(values), dtype=np.float64)
    array.setflags(write=False)
    return array
