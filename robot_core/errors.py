"""The exception for refused input, and what counts as a number."""

import math
import os
import traceback
from typing import Any, TypeGuard

LONGEST = 300
"""Number of characters of a field or value in an error message."""


class NaoGaitError(ValueError):
    """An input was refused.

    Args:
        field: Name of the field.
        value: Value of the field.
        allowed: What would have been accepted.

    Attributes:
        field: Name of the field.
        value: Value of the field.
        allowed: What would have been accepted.
    """

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{_clipped(field)}: got {_shown(value)}; allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, object, str]]:
        """Pickle all three fields, so that the error can cross a process boundary."""
        return type(self), (self.field, self.value, self.allowed)


def _shown(value: object) -> str:
    """A value as text, truncated to a readable length."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print integers of thousands of digits
        text = f"an {type(value).__name__} too long to print"
    return _clipped(text)


def _clipped(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def one_line(error: BaseException) -> str:
    """What an unexpected exception says, and where it was raised, in one line."""
    text = f"{type(error).__name__}: {' '.join(str(error).split())}"
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return text
    last = frames[-1]
    return f"{text} ({os.path.basename(last.filename)}:{last.lineno} in {last.name})"


def is_number(value: Any) -> TypeGuard[int | float]:
    """Whether it is a finite number within the range of a float; booleans are not."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False
