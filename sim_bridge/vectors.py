"""Vectors of three and rotations in plain floats: numpy takes several times as long for one."""

import math

import numpy as np

from nao_lipm_gait.types import FloatArray, Point3

Rows = tuple[Point3, Point3, Point3]
"""The rows of a (3, 3) rotation matrix."""


def rows_of(matrix: FloatArray) -> Rows:
    """Of a (3, 3) array."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def rotation_rows(x: float, y: float, z: float, w: float) -> Rows:
    """The rotation of the unit quaternion x y z w."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def turned(rotation: Rows, vector: Point3) -> Point3:
    """R v."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def turned_back(rotation: Rows, vector: Point3) -> Point3:
    """R^T v."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def cross(first: Point3, second: Point3) -> Point3:
    """The cross product."""
    a, b, c = first
    x, y, z = second
    return b * z - c * y, c * x - a * z, a * y - b * x


def halfway(first: FloatArray, second: FloatArray) -> Rows:
    """The rotation in the middle between two quaternions (4,)."""
    (a, b, c, d), (x, y, z, w) = first.tolist(), second.tolist()
    sign = 1.0 if a * x + b * y + c * z + d * w >= 0.0 else -1.0
    x, y, z, w = x + sign * a, y + sign * b, z + sign * c, w + sign * d
    size = math.sqrt(x * x + y * y + z * z + w * w)
    return rotation_rows(x / size, y / size, z / size, w / size)


def rotation_matrix(quaternion: FloatArray) -> FloatArray:
    """(3, 3) of a unit quaternion (4,) x y z w."""
    x, y, z, w = quaternion.tolist()
    return np.array(rotation_rows(x, y, z, w))
