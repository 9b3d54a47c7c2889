"""Conversion between the world model and ROS messages."""


import numpy as np
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import PoseArray, PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2

from nao_soccer.ros.vision_messages import (
    CORNER,
    KINDS,
    LINE_POINT,
    PERCEPT_FIELDS,
    planar_covariance,
)
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.world.state import BallEstimate, PoseEstimate
from robot_core.errors import NaoGaitError
from robot_core.geometry import ORIGIN, compose, relative
from robot_core.ros.messages import BASE_FOOTPRINT, planar_of, set_planar, stamp_in, to_time
from robot_core.types import FloatArray, Pose2

FIELD = "field"
"""Frame of the field: origin in its centre, x towards the opponents' goal."""
MAP = "map"
"""The same frame by its name in TF (REP-105)."""
POINTS_MAX = 5000
"""Longer clouds are refused."""


def odometry(message: Odometry) -> tuple[int, Pose2]:
    """Stamp [ns] and pose of base_footprint in odom."""
    at = message.pose.pose
    return stamp_in(message.header, "odom"), planar_of(at.position, at.orientation)


def percepts(message: PointCloud2) -> Percepts:
    """What one image shows, by `vision/percepts`; NaoGaitError if vision has not made it."""
    topic = "vision/percepts"
    if message.header.frame_id != BASE_FOOTPRINT:
        raise NaoGaitError(f"{topic} header.frame_id", message.header.frame_id, BASE_FOOTPRINT)
    count = message.width * message.height
    given = tuple(each.name for each in message.fields)
    if given != PERCEPT_FIELDS or message.is_bigendian or count > POINTS_MAX:
        allowed = f"at most {POINTS_MAX} of {PERCEPT_FIELDS}"
        raise NaoGaitError(topic, f"{count} points of {given}", allowed)
    size = 4 * len(PERCEPT_FIELDS) * count
    if len(message.data) != size:
        raise NaoGaitError(f"{topic} data", f"{len(message.data)} bytes", f"{size} bytes")
    rows = np.frombuffer(bytes(message.data), "<f4").reshape(count, -1).astype(float)
    kinds = rows[:, 7]
    unknown = kinds[~np.isin(kinds, np.arange(CORNER + 1))]
    if len(unknown):
        raise NaoGaitError(f"{topic} kind", unknown[0], f"0 to {CORNER}")
    found = [
        Percept(KINDS[int(row[7])], (row[0], row[1]), (row[3], row[4], row[5]), row[6])
        for row in rows[kinds < len(KINDS)].tolist()
    ]
    lines = rows[kinds == LINE_POINT]
    return Percepts(
        stamp_in(message.header, topic),
        next((each for each in found if each.kind is Kind.BALL), None),
        tuple(each for each in found if each.kind is not Kind.BALL),
        lines[:, :2],
        lines[:, 3:6],
        visible=rows[kinds == CORNER, :2],
    )


# -- to messages -----------------------------------------------------------------------------------


def map_transforms(stamp: int, own: Pose2, odometry: Pose2, odom: str) -> list[TransformStamped]:
    """`map` -> odom (REP-105), and `map` -> `field`, which are the same frame.

    Args:
        stamp: [ns] of both poses.
        own: Pose of base_footprint in the field.
        odometry: Pose of base_footprint in odom.
        odom: Name of the frame of the odometry.
    """
    transforms = []
    for child, place in (
        (odom, compose(own, relative(ORIGIN, odometry))),
        (FIELD, ORIGIN),
    ):
        message = TransformStamped(child_frame_id=child)
        message.header.stamp, message.header.frame_id = to_time(stamp), MAP
        set_planar(message.transform.translation, message.transform.rotation, place)
        transforms.append(message)
    return transforms


def pose(stamp: int, own: PoseEstimate) -> PoseWithCovarianceStamped:
    """`pose`."""
    message = PoseWithCovarianceStamped()
    message.header.stamp, message.header.frame_id = to_time(stamp), FIELD
    message.pose.pose = _planar(own.pose)
    covariance = np.zeros((6, 6))
    covariance[np.ix_((0, 1, 5), (0, 1, 5))] = own.covariance.matrix
    message.pose.covariance = covariance.ravel()
    return message


def particles(stamp: int, poses: FloatArray) -> PoseArray:
    """`particles`, of rows x, y [m], yaw [rad]."""
    message = PoseArray()
    message.header.stamp, message.header.frame_id = to_time(stamp), FIELD
    message.poses = [_planar((x, y, yaw)) for x, y, yaw in poses[:, :3].tolist()]
    return message


def ball(stamp: int, estimate: BallEstimate, radius: float) -> Odometry:
    """`ball`: place and velocity in the field."""
    message = Odometry()
    message.header.stamp, message.header.frame_id = to_time(stamp), FIELD
    message.child_frame_id = FIELD
    x, y = estimate.position_in_field
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.position.z = radius
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance = planar_covariance(estimate.position_covariance_in_field)
    vx, vy = estimate.velocity_in_field
    message.twist.twist.linear.x, message.twist.twist.linear.y = vx, vy
    message.twist.covariance = planar_covariance(estimate.velocity_covariance_in_field)
    return message


def kick(stamp: int, goal: Pose2) -> PoseStamped:
    """`gait/kick`: the ball x, y [m] and the direction of its way [rad] in base_footprint."""
    message = PoseStamped()
    message.header.stamp, message.header.frame_id = to_time(stamp), BASE_FOOTPRINT
    message.pose = _planar(goal)
    return message


def _planar(place: Pose2) -> PoseMessage:
    message = PoseMessage()
    set_planar(message.position, message.orientation, place)
    return message
