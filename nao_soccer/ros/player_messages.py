"""Conversion between the world model and ROS messages."""

import math
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PolygonStamped, PoseArray, PoseWithCovarianceStamped
from geometry_msgs.msg import Pose as PoseMessage
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2

from nao_soccer.ros.vision_messages import (
    KINDS,
    LINE_FIELDS,
    OBJECT_FIELDS,
    planar_covariance,
)
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from nao_soccer.world.state import BallEstimate, PoseEstimate
from robot_core.errors import NaoGaitError
from robot_core.geometry import yaw_of_quaternion
from robot_core.ros.messages import stamp_in, to_time
from robot_core.types import FloatArray, Pose2

FIELD = "field"
"""Frame of the field: origin in its centre, x towards the opponents' goal."""
POINTS_MAX = 5000
"""Longer clouds are refused."""
IMAGES_MAX = 8
"""Number of images whose messages may wait for each other."""


def odometry(message: Odometry) -> tuple[int, Pose2]:
    """Stamp [ns] and pose of base_footprint in odom."""
    at, q = message.pose.pose.position, message.pose.pose.orientation
    return stamp_in(message.header, "odom"), (at.x, at.y, yaw_of_quaternion(q.x, q.y, q.z, q.w))


@dataclass(slots=True)
class PerceptParts:
    """The messages of one image, until they are complete.

    Attributes:
        lines: `vision/lines`.
        objects: `vision/percepts`.
        view: `vision/view`.
    """

    lines: PointCloud2 | None = None
    objects: PointCloud2 | None = None
    view: PolygonStamped | None = None

    @property
    def complete(self) -> bool:
        """All messages are there."""
        return self.lines is not None and self.objects is not None and self.view is not None

    def joined(self, stamp: int) -> Percepts | None:
        """The percepts of the image; None while a message is missing."""
        if self.lines is None or self.objects is None or self.view is None:
            return None
        lines = _rows(self.lines, LINE_FIELDS, "vision/lines")
        found = [
            Percept(_kind(row[7]), (row[0], row[1]), (row[3], row[4], row[5]), row[6])
            for row in _rows(self.objects, OBJECT_FIELDS, "vision/percepts").tolist()
        ]
        corners = [(point.x, point.y) for point in self.view.polygon.points]
        return Percepts(
            stamp,
            next((each for each in found if each.kind is Kind.BALL), None),
            tuple(each for each in found if each.kind is not Kind.BALL),
            lines[:, :2],
            lines[:, 3:],
            (),
            np.zeros((0, 2)),
            np.array(corners, dtype=float).reshape(-1, 2),
        )


class PerceptBuffer:
    """Messages of images of which others are still missing."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, PerceptParts]] = []

    def add(self, part: str, stamp: int, message: PointCloud2 | PolygonStamped) -> Percepts | None:
        """Keep a message.

        Two cameras may have images with one stamp: a part that is there already begins another one.

        Args:
            part: Which attribute of `PerceptParts` it is.
            stamp: [ns] of its image.
            message: The message.

        Returns:
            The percepts of the image that it completes; None = none.
        """
        parts = next(
            (each for at, each in self._waiting if at == stamp and getattr(each, part) is None),
            None,
        )
        if parts is None:
            parts = PerceptParts()
            self._waiting.append((stamp, parts))
        setattr(parts, part, message)
        if parts.complete:
            self._waiting = [each for each in self._waiting if each[1] is not parts]
            return parts.joined(stamp)
        # The oldest by arrival: after a restart of the clock stamps are smaller than before.
        del self._waiting[:-IMAGES_MAX]
        return None


def _kind(number: float) -> Kind:
    if not (0 <= number < len(KINDS) and number == int(number)):  # refuses NaN as well
        raise NaoGaitError("vision/percepts kind", number, f"0 to {len(KINDS) - 1}")
    return KINDS[int(number)]


def _rows(cloud: PointCloud2, names: tuple[str, ...], topic: str) -> FloatArray:
    """(n, fields) of a cloud that vision has made."""
    count = cloud.width * cloud.height
    given = tuple(each.name for each in cloud.fields)
    if given != names or cloud.is_bigendian or count > POINTS_MAX:
        raise NaoGaitError(topic, f"{count} points of {given}", f"at most {POINTS_MAX} of {names}")
    if len(cloud.data) != 4 * len(names) * count:
        allowed = f"{4 * len(names) * count} bytes"
        raise NaoGaitError(f"{topic} data", f"{len(cloud.data)} bytes", allowed)
    rows = np.frombuffer(bytes(cloud.data), dtype="<f4").reshape(count, len(names))
    return rows.astype(float)


# -- to messages -----------------------------------------------------------------------------------


def pose(stamp: int, own: PoseEstimate) -> PoseWithCovarianceStamped:
    """`pose`."""
    message = PoseWithCovarianceStamped()
    message.header.stamp, message.header.frame_id = to_time(stamp), FIELD
    message.pose.pose = _planar(own.pose)
    c = own.covariance
    covariance = np.zeros((6, 6))
    covariance[np.ix_((0, 1, 5), (0, 1, 5))] = (
        (c.xx, c.xy, c.x_yaw), (c.xy, c.yy, c.y_yaw), (c.x_yaw, c.y_yaw, c.yaw),
    )  # fmt: skip
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


def _planar(place: Pose2) -> PoseMessage:
    message = PoseMessage()
    message.position.x, message.position.y = place[:2]
    message.orientation.z = math.sin(0.5 * place[2])
    message.orientation.w = math.cos(0.5 * place[2])
    return message
