"""One root for everything this package refuses, and what counts as a number."""

import math
from typing import Any, TypeGuard

LONGEST = 300
"""Characters of a value that an error message shows."""


class NaoGaitError(ValueError):
    """A refused input: says which field, what it held and what would have been allowed."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field}: got {_shown(value)}; allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, object, str]]:
        """Keep the evidence when the error crosses a process boundary."""
        return type(self), (self.field, self.value, self.allowed)


def _shown(value: object) -> str:
    """A value in an error message, cut to a readable length."""
    try:
        text = repr(value)
    except ValueError:  # Python does not print integers of thousands of digits
        text = f"an {type(value).__name__} too long to print"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def is_number(value: Any) -> TypeGuard[int | float]:
    """A finite number that a float can hold; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False
