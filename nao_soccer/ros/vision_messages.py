"""Conversion between the types of vision and ROS messages."""

from collections.abc import Iterable

import numpy as np
from geometry_msgs.msg import Pose, PoseArray, PoseStamped, PoseWithCovarianceStamped
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from nao_soccer.vision.controller import ImageInput
from nao_soccer.vision.percepts import Covariance2, Kind, Percept, Percepts
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_from_quaternion
from robot_core.robot.camera import Intrinsics
from robot_core.ros.messages import BASE_FOOTPRINT, stamp_in, to_time
from robot_core.types import FloatArray

KINDS = tuple(Kind)
LINE_POINT, CORNER = len(KINDS), len(KINDS) + 1
"""The field `kind` of `vision/percepts` is an index of `KINDS`, or one of these two: a point of a
line, or a corner of the part of the ground that the image shows."""
LINE_FIELDS = ("x", "y", "z", "var_x", "cov_xy", "var_y")
PERCEPT_FIELDS = (*LINE_FIELDS, "yaw", "kind")
"""Fields of `vision/lines` and `vision/percepts`: [m], [m^2], [rad]."""
_UNKNOWN = np.pi**2
"""[rad^2] Variance of an orientation that is not known."""


# -- from messages ---------------------------------------------------------------------------------


def image_input(message: Image, topic: str) -> ImageInput:
    """Contents of an image."""
    return ImageInput(
        stamp_in(message.header, topic),
        message.width,
        message.height,
        message.encoding,
        message.step,
        bytes(message.data),
    )


def intrinsics(message: CameraInfo, topic: str, *, rectified: bool = False) -> Intrinsics:
    """The pinhole of `camera_info`: P, which is that of the rectified image; K where P is not set.

    Args:
        message: `camera_info`; its D describes the image before it was rectified.
        topic: Its name, for errors.
        rectified: Whether the image is rectified.

    Raises:
        NaoGaitError: The image is distorted, or rectified and P is not set.
    """
    p, k = message.p.tolist(), message.k.tolist()
    if rectified and not p[0]:
        raise NaoGaitError(f"{topic} p", p, "the pinhole of the rectified image")
    if any(message.d) and not rectified:
        allowed = "zeros: rectify the image, and set the parameter images to its topic (image_rect)"
        raise NaoGaitError(f"{topic} d", list(message.d), allowed)
    fx, fy, cx, cy = (p[0], p[5], p[2], p[6]) if p[0] else (k[0], k[4], k[2], k[5])
    return Intrinsics(message.width, message.height, fx, fy, cx, cy)


def torso_pose(message: PoseStamped) -> tuple[int, FloatArray, FloatArray]:
    """Stamp [ns], position (3,) [m] and rotation (3, 3) of `gait/torso_pose`."""
    position, turn = message.pose.position, message.pose.orientation
    return (
        stamp_in(message.header, "gait/torso_pose"),
        np.array((position.x, position.y, position.z)),
        np.array(rotation_from_quaternion(turn.x, turn.y, turn.z, turn.w)),
    )


# -- to messages -----------------------------------------------------------------------------------


def ball(percepts: Percepts, ball: Percept, radius: float) -> PoseWithCovarianceStamped:
    """`vision/ball`: the centre of the ball."""
    message = PoseWithCovarianceStamped(header=_header(percepts))
    message.pose.pose = _pose(ball, radius)
    message.pose.covariance = planar_covariance(ball.covariance)
    return message


def planar_covariance(covariance: Covariance2) -> FloatArray:
    """(36,) covariance of a pose on the floor, or of its velocity, by xx, xy, yy of its place."""
    xx, xy, yy = covariance
    full = np.diag((0.0, 0.0, 1e-4, _UNKNOWN, _UNKNOWN, _UNKNOWN))
    full[:2, :2] = ((xx, xy), (xy, yy))
    flat: FloatArray = full.ravel()
    return flat


def poses(percepts: Percepts, objects: Iterable[Percept]) -> PoseArray:
    """The places and yaws of objects; empty if none was seen."""
    return PoseArray(header=_header(percepts), poses=[_pose(each) for each in objects])


def lines(percepts: Percepts) -> PointCloud2:
    """`vision/lines`: x, y, z [m], var_x, cov_xy, var_y [m^2] of each line point."""
    places = percepts.line_points
    rows = np.column_stack((places, np.zeros(len(places)), percepts.line_covariances))
    return _cloud(percepts, rows, LINE_FIELDS)


def percept_cloud(percepts: Percepts) -> PointCloud2:
    """`vision/percepts`: all that one image shows; as `lines`, with yaw [rad] and kind."""
    found = percepts.objects if percepts.ball is None else (percepts.ball, *percepts.objects)
    lines, corners = len(percepts.line_points), len(percepts.visible)
    rows = np.zeros((len(found) + lines + corners, len(PERCEPT_FIELDS)))
    for row, each in zip(rows, found, strict=False):
        row[:] = (*each.position, 0.0, *each.covariance, each.yaw, KINDS.index(each.kind))
    points = rows[len(found) : len(found) + lines]
    points[:, :2], points[:, 3:6] = percepts.line_points, percepts.line_covariances
    points[:, 7] = LINE_POINT
    rows[len(found) + lines :, :2] = percepts.visible
    rows[len(found) + lines :, 7] = CORNER
    return _cloud(percepts, rows, PERCEPT_FIELDS)


def debug(percepts: Percepts, picture: np.ndarray, camera: str) -> Image:
    """`vision/debug`."""
    message = Image(header=_header(percepts), encoding="rgb8", step=3 * picture.shape[1])
    message.header.frame_id = f"{camera}_optical_frame"
    message.height, message.width = picture.shape[:2]
    message.data = picture.tobytes()
    return message


def _header(percepts: Percepts) -> Header:
    return Header(stamp=to_time(percepts.stamp), frame_id=BASE_FOOTPRINT)


def _pose(percept: Percept, z: float = 0.0) -> Pose:
    pose = Pose()
    pose.position.x, pose.position.y = percept.position
    pose.position.z = z
    pose.orientation.z = float(np.sin(0.5 * percept.yaw))
    pose.orientation.w = float(np.cos(0.5 * percept.yaw))
    return pose


def _cloud(percepts: Percepts, rows: FloatArray, names: tuple[str, ...]) -> PointCloud2:
    """A cloud of float32 fields, one row (n, fields) each."""
    width = 4 * len(names)
    return PointCloud2(
        header=_header(percepts),
        height=1,
        width=len(rows),
        fields=[
            PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
            for index, name in enumerate(names)
        ],
        point_step=width,
        row_step=width * len(rows),
        data=rows.astype("<f4").tobytes(),
        is_dense=True,
    )
