"""Checks of single fields of a message or call; a NaoGaitError names the one that is refused."""

import math
import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.types import FloatArray

_NANOSECONDS = 1_000_000_000
_LARGEST = sys.float_info.max
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


def read_array(
    values: object, field: str, shape: tuple[int, ...], limit: float = math.inf, unit: str = "",
    names: Sequence[str] = (),
) -> FloatArray:
    """Check an array, or nested lists, of finite numbers up to `limit` in size.

    Args:
        values: What somebody gave.
        field: Its name.
        shape: Its shape.
        limit: Largest absolute value.
        unit: Of the numbers.
        names: Of the items of a vector, for the message; "xyz" = `field.x`, none = indices.

    Returns:
        A copy, of the shape.

    Raises:
        NaoGaitError: It is no such array, or names the first number that is refused.
    """
    numbers: FloatArray
    try:
        found = np.asarray(values)
    except ValueError:  # lists of different lengths
        found = np.empty(0, dtype=object)
    usable = found.dtype.kind in "fiu"
    if usable and found.shape == shape:
        numbers = found.astype(float)
        good = abs(numbers) <= min(limit, _LARGEST)  # false for NaN as well
        if good.all():
            return numbers
    span = "" if math.isinf(limit) else f" from {-limit:g} to {limit:g}"
    if not usable or found.shape != shape:
        shown = f"shape {found.shape}" if usable and found.shape else values
        allowed = f"an array of shape {shape} of finite numbers{span}" + f" [{unit}]" * bool(unit)
        raise NaoGaitError(field, shown, allowed)
    index = np.unravel_index(int(np.argmin(good)), shape)
    place = names[int(index[0])] if names else ", ".join(map(str, index))
    place = f".{place}" if isinstance(names, str) else f"[{place}]"
    allowed = f"a finite number{span} {unit}".rstrip()
    raise NaoGaitError(f"{field}{place}", float(numbers[index]), allowed)


def some(names: Sequence[str]) -> str:
    """Shorten a list of names for a message: the first few, each of a bounded length."""
    shown = ", ".join(name[:_NAME_LENGTH] for name in names[:_NAMES_SHOWN])
    rest = len(names) - _NAMES_SHOWN
    return shown if rest <= 0 else f"{shown} and {rest} more"


def repeated(names: Sequence[str]) -> str:
    """List the names that occur more than once, shortened."""
    return some([name for name, count in Counter(names).items() if count > 1])
