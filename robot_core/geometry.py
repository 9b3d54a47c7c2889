"""Points, vectors, rotations and planar poses in plain floats; rows of points and angles in arrays.

A tick works with single points and vectors. For these, Python floats are several times faster than
small numpy arrays.

Conventions, everywhere in the project:

- planar pose: x [m], y [m], yaw [rad], counter-clockwise (REP-103);
- rotation: the rows of its (3, 3) matrix, which maps the rotated frame to the reference frame;
- quaternion: x, y, z, w, of unit length;
- roll, pitch, yaw [rad], in this order: R = Rz(yaw) Ry(pitch) Rx(roll).
"""

from math import atan2, cos, sin, sqrt, tau
from typing import Any

import numpy as np

from robot_core.types import FloatArray, Point3, Pose2

Rotation = tuple[Point3, Point3, Point3]
"""The rows of a (3, 3) rotation matrix."""
Quaternion = tuple[float, float, float, float]
"""x, y, z, w, of unit length."""

ORIGIN: Pose2 = (0.0, 0.0, 0.0)
"""The planar pose of a frame in itself."""

# -- arrays ----------------------------------------------------------------------------------------


def as_point(vector: FloatArray) -> Point3:
    """An array (3,) as three floats."""
    x, y, z = vector.tolist()
    return x, y, z


def float_view(array: FloatArray) -> "memoryview[float]":
    """The memory of an array (n,); its elements are faster to access than the array's."""
    view: Any = array.data
    return view


def as_rotation(matrix: FloatArray) -> Rotation:
    """A rotation matrix (3, 3) as rows of floats."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def wrapped(angles: FloatArray) -> FloatArray:
    """The same directions [rad], from -pi to pi."""
    result: FloatArray = angles - tau * np.rint(angles / tau)
    return result


def rotate_each(x: FloatArray, y: FloatArray, yaw: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vectors x, y (n,), each rotated by its yaw [rad], (n,) or one for all."""
    c, s = np.cos(yaw), np.sin(yaw)
    return c * x - s * y, s * x + c * y


def planar_rotation(yaw: float) -> FloatArray:
    """The matrix (2, 2) that rotates by yaw [rad]."""
    c, s = cos(yaw), sin(yaw)
    return np.array(((c, -s), (s, c)))


# -- planar poses ----------------------------------------------------------------------------------


def rotate_planar(x: float, y: float, yaw: float) -> tuple[float, float]:
    """The vector x, y, rotated by yaw [rad]."""
    c, s = cos(yaw), sin(yaw)
    return c * x - s * y, s * x + c * y


def compose(pose: Pose2, offset: Pose2) -> Pose2:
    """The pose that is at `offset` in the frame of `pose`."""
    x, y, yaw = pose
    dx, dy, turn = offset
    c = cos(yaw)
    s = sin(yaw)
    return x + c * dx - s * dy, y + s * dx + c * dy, yaw + turn


def relative(pose: Pose2, frame: Pose2) -> Pose2:
    """`pose` in the frame of `frame`; both are given in the same frame."""
    dx = pose[0] - frame[0]
    dy = pose[1] - frame[1]
    c = cos(frame[2])
    s = sin(frame[2])
    return c * dx + s * dy, -s * dx + c * dy, pose[2] - frame[2]


def midpoint(a: Pose2, b: Pose2) -> Pose2:
    """The mean of two poses whose yaws differ by less than pi."""
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


# -- vectors ---------------------------------------------------------------------------------------


def dot(a: Point3, b: Point3) -> float:
    """Inner product of two vectors of one frame."""
    ax, ay, az = a
    bx, by, bz = b
    return ax * bx + ay * by + az * bz


def cross(a: Point3, b: Point3) -> Point3:
    """Cross product of two vectors of one frame."""
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


# -- rotations and quaternions ---------------------------------------------------------------------


def rotate(rotation: Rotation, vector: Point3) -> Point3:
    """R v: a vector of the rotated frame in the reference frame."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def rotate_back(rotation: Rotation, vector: Point3) -> Point3:
    """R^T v: a vector of the reference frame in the rotated frame."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Rotation:
    """Rz(yaw) Ry(pitch) Rx(roll), angles in [rad]."""
    cr, sr = cos(roll), sin(roll)
    cp, sp = cos(pitch), sin(pitch)
    cy, sy = cos(yaw), sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def rotation_from_quaternion(x: float, y: float, z: float, w: float) -> Rotation:
    """The rotation of a unit quaternion."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def rotation_halfway(first: FloatArray, second: FloatArray) -> Rotation:
    """The rotation in the middle between two unit quaternions (4,), along the shorter way."""
    (a, b, c, d), (x, y, z, w) = first.tolist(), second.tolist()
    sign = 1.0 if a * x + b * y + c * z + d * w >= 0.0 else -1.0
    x, y, z, w = x + sign * a, y + sign * b, z + sign * c, w + sign * d
    size = sqrt(x * x + y * y + z * z + w * w)
    return rotation_from_quaternion(x / size, y / size, z / size, w / size)


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """The quaternion of Rz(yaw) Ry(pitch) Rx(roll), angles in [rad]."""
    cr, sr = cos(0.5 * roll), sin(0.5 * roll)
    cp, sp = cos(0.5 * pitch), sin(0.5 * pitch)
    cy, sy = cos(0.5 * yaw), sin(0.5 * yaw)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def yaw_of_quaternion(x: float, y: float, z: float, w: float) -> float:
    """Yaw [rad] of a unit quaternion, in the order yaw, pitch, roll."""
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def rotation_matrix(quaternion: FloatArray) -> FloatArray:
    """The matrix (3, 3) of a unit quaternion (4,)."""
    x, y, z, w = quaternion.tolist()
    return np.array(rotation_from_quaternion(x, y, z, w))
