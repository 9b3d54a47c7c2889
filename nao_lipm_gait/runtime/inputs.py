"""Contents of the messages as plain data, and what velocity and head commands mean.

The same data come from DDS, from a simulated robot or from a test. Every refusal is a NaoGaitError
with topic and field, value, and what is allowed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from robot_core.errors import NaoGaitError
from robot_core.geometry import yaw_of_quaternion
from robot_core.head_goals import Angles, Follow, Frame, Goal, LookAt, Search
from robot_core.message_checks import finite
from robot_core.robot import RobotDescription
from robot_core.types import Point2, Point3, Pose2, VelocityCommand

SPEED_ABSURD = 10.0
"""[m/s] No command for a small humanoid: a wrong unit or a broken sender."""
TURN_ABSURD = 100.0
"""[rad/s]"""
DISTANCE_ABSURD = 1000.0
"""[m]"""
ANGLE_ABSURD = 100.0
"""[rad]"""
HEAD_MODES = ("search", "free")


@dataclass(frozen=True, slots=True)
class TwistInput:
    """`cmd_vel`: linear x, y, z [m/s] and angular x, y, z [rad/s]."""

    linear: Point3
    angular: Point3


@dataclass(frozen=True, slots=True)
class ImuInput:
    """`imu/data`, along the axes of the torso (REP-145).

    Attributes:
        angular_velocity: x, y, z [rad/s].
        linear_acceleration: x, y, z [m/s^2]; (0, 0, +9.81) at rest upright.
        orientation: Quaternion x, y, z, w.
        orientation_covariance: First element; -1 means that the field is not filled (REP-145).
        angular_velocity_covariance: First element; -1 as above.
        linear_acceleration_covariance: First element; -1 as above.
    """

    sec: int
    nanosec: int
    angular_velocity: Point3
    linear_acceleration: Point3
    orientation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    orientation_covariance: float = -1.0
    angular_velocity_covariance: float = 0.0
    linear_acceleration_covariance: float = 0.0


@dataclass(frozen=True, slots=True)
class JointInput:
    """`joint_states`.

    Attributes:
        names: Joints in any order; joints that the robot does not have are ignored.
        position: [rad], one for each name.
        effort: Torques of the motors [N m], one for each name; NaN or empty = not measured.
        waited: Wall time [s] from the arrival of the message until it was taken; for reports only.
        arrived: Time of its arrival [ns] on the clock of the stamps; None if that is unknown.
    """

    sec: int
    nanosec: int
    names: Sequence[str]
    position: Sequence[float]
    effort: Sequence[float] = ()
    waited: float = 0.0
    arrived: int | None = None


@dataclass(frozen=True, slots=True)
class LoadInput:
    """`l_sole/wrench` or `r_sole/wrench`.

    Attributes:
        side: 0 left, 1 right.
        force: Normal force of the floor on the sole [N].
    """

    sec: int
    nanosec: int
    side: int
    force: float


@dataclass(frozen=True, slots=True)
class TemperatureInput:
    """`temperature` of the motor of a joint [deg C]."""

    sec: int
    nanosec: int
    joint: str
    degrees: float


Input = TwistInput | ImuInput | JointInput | LoadInput | TemperatureInput


def read_velocity(message: TwistInput) -> VelocityCommand:
    """Take the planar part of a twist.

    The other three components are ignored, but must be finite: a sender that has a NaN anywhere is
    broken.

    Raises:
        NaoGaitError: With the component that is refused.
    """
    for axis, value in zip("xyz", message.linear, strict=True):
        finite(value, f"cmd_vel linear.{axis}", SPEED_ABSURD, "m/s")
    for axis, value in zip("xyz", message.angular, strict=True):
        finite(value, f"cmd_vel angular.{axis}", TURN_ABSURD, "rad/s")
    return VelocityCommand(x=message.linear[0], y=message.linear[1], yaw=message.angular[2])


def head_angles(
    names: Sequence[str], position: Sequence[float], robot: RobotDescription
) -> Angles:
    """Read `~/head`: pan and tilt [rad] by the names of their joints, clipped to the joint limits.

    Raises:
        NaoGaitError: For other joints, or an angle that is not finite.
    """
    if robot.head is None:
        raise NaoGaitError("~/head", ", ".join(names), f"nothing: {robot.name} has no head")
    if len(names) > len(robot.head) or sorted(names) != sorted(robot.head) or len(position) != 2:
        shown = ", ".join(name[:100] for name in names[:3])
        got = f"{len(names)} names ({shown}) with {len(position)} positions"
        raise NaoGaitError("~/head", got, f"{' and '.join(robot.head)} with a position each")
    found = dict(zip(names, position, strict=True))
    angles = []
    for name in robot.head:
        limit = robot.limits[name]
        angle = finite(found[name], f"~/head position[{name}]", ANGLE_ABSURD, "rad")
        angles.append(min(max(angle, limit.lower), limit.upper))
    return Angles(*angles)


def head_point(topic: str, point: Point3, frame_id: str, robot: RobotDescription) -> LookAt:
    """Read `~/look_at` or `~/follow`.

    Args:
        topic: Name of the topic, for errors.
        point: x, y, z [m] in the frame of the header.
        frame_id: One of the torso's frames, `base_footprint` or `odom`.
        robot: Names its frames.

    Raises:
        NaoGaitError: For another frame, or a number that is not finite.
    """
    x, y, z = (
        finite(value, f"{topic} point.{axis}", DISTANCE_ABSURD, "m")
        for axis, value in zip("xyz", point, strict=True)
    )
    frames = {
        robot.torso_frame: Frame.TORSO,
        robot.base_frame: Frame.TORSO,
        Frame.FOOTPRINT.value: Frame.FOOTPRINT,
        Frame.ODOM.value: Frame.ODOM,
    }
    if frame_id not in frames:
        raise NaoGaitError(f"{topic} header.frame_id", frame_id, frames)
    return LookAt((x, y, z), frames[frame_id])


def head_follow(point: Point3, frame_id: str, robot: RobotDescription) -> Follow:
    """Read `~/follow`; see `head_point`."""
    seen = head_point("~/follow", point, frame_id, robot)
    return Follow(seen.point, seen.frame)


def kick_goal(
    point: Point2, quaternion: tuple[float, float, float, float], frame_id: str
) -> Pose2:
    """Read `~/kick`: the ball x, y [m] and the direction of its way [rad], in base_footprint.

    Raises:
        NaoGaitError: For another frame, or a number that is not finite.
    """
    if frame_id != Frame.FOOTPRINT.value:
        raise NaoGaitError("~/kick header.frame_id", frame_id, Frame.FOOTPRINT.value)
    x, y = (finite(each, "~/kick pose.position", DISTANCE_ABSURD, "m") for each in point)
    turn = "~/kick pose.orientation"
    qx, qy, qz, qw = (finite(each, turn, 1.1, "of a unit quaternion") for each in quaternion)
    return x, y, yaw_of_quaternion(qx, qy, qz, qw)


def head_mode(text: str) -> Goal | None:
    """Read `~/head_mode`: a search, or None to give the head back to the gait.

    Raises:
        NaoGaitError: For another text.
    """
    if text not in HEAD_MODES:
        raise NaoGaitError("~/head_mode", text, HEAD_MODES)
    return Search() if text == "search" else None
