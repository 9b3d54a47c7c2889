"""Hold simulated time to the wall clock, without drift and without a mad chase after a stall."""

import time
from collections.abc import Callable

BACKLOG = 0.2
"""[s] wall time that may be made up; what lies further back is let go."""


class Pacer:
    """Says when step number k is due.

    The due times follow from the step count and one start time, so rounding never adds up.
    """

    def __init__(
        self,
        period: int,
        factor: float,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Args:
        period: simulated time of one step [ns].
        factor: simulated seconds per wall second; 0 = as fast as possible.
        clock: monotonic time [ns].
        """
        self._wall_period = period / factor if factor else 0.0
        self._clock = clock
        self._steps = 0
        self._start = clock()
        self.lost = 0
        """[ns] wall time that was let go so far."""

    def wait(self) -> float:
        """[s] until the next step is due; 0 or less when it is."""
        if not self._wall_period:
            return 0.0
        return (self._due() - self._clock()) * 1e-9

    def stepped(self) -> None:
        """Count a step. After a stall, time beyond the backlog is let go."""
        self._steps += 1
        if not self._wall_period:
            return
        behind = self._clock() - self._due() - round(BACKLOG * 1e9)
        if behind > 0:
            self._start += behind
            self.lost += behind

    def restart(self) -> None:
        """The time that has passed until now does not count (a wait for someone else)."""
        self._start = self._clock()
        self._steps = 0

    def _due(self) -> int:
        return self._start + round(self._steps * self._wall_period)
