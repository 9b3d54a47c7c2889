"""Points and vectors in space: three numbers, with which Python reckons faster than with arrays."""

from typing import Any

from nao_lipm_gait.signals import FloatArray, Point3


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
