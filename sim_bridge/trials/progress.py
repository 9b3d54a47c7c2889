"""The progress of long work: a bar on a terminal, elsewhere a line now and then."""

import math
import sys
from collections.abc import Callable
from typing import IO, Any

from tqdm import tqdm

EVERY = 60.0
"""[s] of wall time between two lines."""
LINE = "{desc}: {n:.0f} of {total:.0f}, {elapsed} passed, {remaining} left{postfix}"


class Progress(tqdm):  # type: ignore[type-arg]
    """A tqdm bar on stderr that is removed at its end; into a pipe or file, one line per minute.

    Args:
        show: False shows nothing.
        **bar: As tqdm has them.
    """

    def __init__(self, *args: Any, show: bool = True, **bar: Any) -> None:
        self._lines = not sys.stderr.isatty()
        if self._lines:
            bar |= {"bar_format": LINE, "delay": EVERY, "mininterval": EVERY,
                    "maxinterval": EVERY, "miniters": 1}  # fmt: skip
        super().__init__(*args, disable=not show, leave=False, **bar)

    @staticmethod
    def status_printer(file: IO[str]) -> Callable[[str], None]:
        """What shows a state of the bar on this file."""
        if file.isatty():
            return tqdm.status_printer(file)
        return lambda text: print(text, file=file, flush=True)

    def close(self) -> None:
        """End it; a line has nothing to be removed."""
        if self._lines:
            self.delay = math.inf
        super().close()
