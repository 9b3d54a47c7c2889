"""One root for everything this package refuses, and what counts as a number."""

import math
from typing import Any, TypeGuard


class NaoGaitError(ValueError):
    """A refused input: says which field, what it held and what would have been allowed."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field}: got {value!r}; allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, object, str]]:
        """Keep the evidence when the error crosses a process boundary."""
        return type(self), (self.field, self.value, self.allowed)


def is_number(value: Any) -> TypeGuard[int | float]:
    """A finite number that a float can hold; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False
