"""Points and vectors in space: three numbers, with which Python reckons faster than with arrays.

Poses on the ground plane: x [m], y [m], yaw [rad].
"""

from math import cos, sin
from typing import Any

from nao_lipm_gait.types import FloatArray, Point3, Pose2


def turned(x: float, y: float, yaw: float) -> tuple[float, float]:
    """The vector x, y turned by yaw [rad], counter-clockwise."""
    c, s = cos(yaw), sin(yaw)
    return c * x - s * y, s * x + c * y


def compose(pose: Pose2, offset: Pose2) -> Pose2:
    """The pose that lies at `offset` in the frame of `pose`."""
    x, y, yaw = pose
    c = cos(yaw)
    s = sin(yaw)
    return x + c * offset[0] - s * offset[1], y + s * offset[0] + c * offset[1], yaw + offset[2]


def relative(pose: Pose2, frame: Pose2) -> Pose2:
    """`pose` seen from `frame`, both given in the same frame."""
    dx = pose[0] - frame[0]
    dy = pose[1] - frame[1]
    c = cos(frame[2])
    s = sin(frame[2])
    return c * dx + s * dy, -s * dx + c * dy, pose[2] - frame[2]


def halfway(a: Pose2, b: Pose2) -> Pose2:
    """The pose in the middle of two that differ by less than half a turn."""
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


def point(vector: FloatArray) -> Point3:
    """(3,) as three numbers."""
    values: list[float] = vector.tolist()
    return values[0], values[1], values[2]


def numbers(array: FloatArray) -> "memoryview[float]":
    """The memory of an array (n,), whose single numbers are quicker to reach than the array's."""
    view: Any = array.data
    return view


def dot(a: Point3, b: Point3) -> float:
    """Inner product of two vectors of one frame."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
