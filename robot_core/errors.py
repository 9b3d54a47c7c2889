"""The exception for refused input, and what counts as a number."""

import difflib
import math
import os
import re
import traceback
from collections.abc import Iterable, Mapping
from itertools import chain
from reprlib import Repr
from typing import Any, TypeGuard

LONGEST = 300
"""Number of characters of a field or value in an error message."""
LONGEST_ALLOWED = 2000
"""Number of characters of what is allowed: it may list the names of a file."""
MOST_ITEMS = 100
"""Items of a value, nested ones included, up to which it is shown as `repr` shows it."""
LONGEST_NAME = 60
"""Characters of an unknown name for which a similar one is looked for."""
RESEMBLES = 0.8
"""Share of characters that a name has in common with the one that was meant."""
_NUMPY = re.compile(r"\bnp\.\w+\(([-\w.+]*)\)")
"""A number of numpy, as `np.float64(0.0)`."""
_SHORT = Repr()
_SHORT.maxlevel, _SHORT.maxstring = 2, LONGEST


class NaoGaitError(ValueError):
    """An input was refused.

    Args:
        field: Name of the field.
        value: Value of the field.
        allowed: What would have been accepted, or the names that would have been.
        names: Such names, where `allowed` says more. "Did you mean" asks for the one that the value
            up to its "=", or the last key of the field, resembles.

    Attributes:
        field: Name of the field.
        value: Value of the field.
        allowed: What would have been accepted.
    """

    def __init__(
        self, field: str, value: object, allowed: str | Iterable[str], names: Iterable[str] = ()
    ) -> None:
        if not isinstance(allowed, str):
            names = tuple(allowed)
            allowed = f"one of {', '.join(names)}"
        self.field = field
        self.value = value
        self.allowed = allowed
        self._near = near = _nearest(field, value, tuple(names))
        meant = f" did you mean {clipped(near[0])}?" if near else ""
        allowed = clipped(allowed, LONGEST_ALLOWED)
        super().__init__(f"{clipped(field)}: got {_shown(value)};{meant} allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, object, str, list[str]]]:
        """Pickle all fields, so that the error can cross a process boundary."""
        return type(self), (self.field, self.value, self.allowed, self._near)


def _nearest(field: str, value: object, names: tuple[str, ...]) -> list[str]:
    """The one of the names that an unknown name resembles, if one does."""
    key = re.split(r"[.:\s]", field)[-1]
    words = (value.partition("=")[0], key) if isinstance(value, str) else (key,)
    unknown = (word for word in words if word not in names and len(word) <= LONGEST_NAME)
    found = (difflib.get_close_matches(word, names, 1, RESEMBLES) for word in unknown)
    return next(filter(None, found), [])


def _shown(value: object) -> str:
    """A value as text, truncated to a readable length; a huge one is never formatted whole."""
    try:
        text = repr(value) if _items(value, MOST_ITEMS) <= MOST_ITEMS else _SHORT.repr(value)
    except Exception:  # integers of thousands of digits; objects whose own `repr` fails
        text = f"a value of type {type(value).__name__} that cannot be printed"
    return clipped(_NUMPY.sub(r"\1", text))


def _items(value: object, most: int) -> int:
    """Number of items in nested containers, counted until there are more than `most`."""
    if isinstance(value, str | bytes):
        return 1 + len(value) // LONGEST
    if not isinstance(value, Mapping | list | tuple | set | frozenset):
        return 1
    count = 1
    for each in chain.from_iterable(value.items()) if isinstance(value, Mapping) else value:
        count += _items(each, most - count)
        if count > most:
            break
    return count


def clipped(text: str, longest: int = LONGEST) -> str:
    """At most so many characters, in one line that cannot control a terminal."""
    text = text if len(text) <= longest else f"{text[:longest]}..."
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else ascii(each)[1:-1] for each in text
    )


def one_line(error: BaseException) -> str:
    """What an unexpected exception says, and where it was raised, in one line."""
    text = clipped(f"{type(error).__name__}: {' '.join(str(error).split())}", LONGEST_ALLOWED)
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
