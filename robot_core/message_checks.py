"""Checks of single fields of a message; a NaoGaitError names the field that is refused."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.types import FloatArray

_NANOSECONDS = 1_000_000_000
_NAMES_SHOWN = 5
_NAME_LENGTH = 40


def stamp_of(sec: int, nanosec: int, field: str) -> int:
    """Join the two parts of a ROS stamp to [ns].

    Raises:
        NaoGaitError: For a negative time, or a second or more in `nanosec`.
    """
    if nanosec >= _NANOSECONDS:
        raise NaoGaitError(f"{field}.nanosec", nanosec, "0 to 999999999")
    if sec < 0:
        raise NaoGaitError(f"{field}.sec", sec, "0 or more")
    return sec * _NANOSECONDS + nanosec


def finite(value: float, field: str, limit: float, unit: str) -> float:
    """Check that a number is finite and not beyond `limit` in size; returns it.

    Raises:
        NaoGaitError: If it is not.
    """
    if -limit <= value <= limit:  # false for NaN as well
        return value
    raise NaoGaitError(field, value, f"a finite number from {-limit:g} to {limit:g} {unit}")


def read_vector(values: Sequence[float], field: str, limit: float, unit: str) -> FloatArray:
    """Check the three components of a vector like `finite` does; returns it as (3,).

    Raises:
        NaoGaitError: With the first component that is refused.
    """
    for axis, value in zip("xyz", values, strict=True):
        if not -limit <= value <= limit:
            finite(value, f"{field}.{axis}", limit, unit)
    return np.array(values, dtype=float)


def some(names: Sequence[str]) -> str:
    """Shorten a list of names for a message: the first few, each of a bounded length."""
    shown = ", ".join(name[:_NAME_LENGTH] for name in names[:_NAMES_SHOWN])
    rest = len(names) - _NAMES_SHOWN
    return shown if rest <= 0 else f"{shown} and {rest} more"


def repeated(names: Sequence[str]) -> str:
    """List the names that occur more than once, shortened."""
    return some([name for name, count in Counter(names).items() if count > 1])
