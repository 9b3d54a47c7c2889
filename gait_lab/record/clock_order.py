"""Simulated time for messages that are handled late.

A busy recorder takes its messages topic by topic, so what it handles after a tick of the clock may
have arrived long before it. Arrival times, which the middleware takes, tell.
"""

from bisect import bisect_right
from collections.abc import Callable

Write = Callable[[str, int, bytes], None]
"""topic, simulated time [ns], serialised message"""
KEPT = 100_000
"""Ticks of the clock that are remembered, 1000 s at 100 Hz."""


class ClockOrder:
    """Gives every message the simulated time of its arrival, in ns; or the wall time, if told to.

    Holds what comes before the first tick, so it may be told late that there is no clock.
    """

    def __init__(self, write: Write) -> None:
        self._write = write
        self._arrivals: list[int] = []
        self._ticks: list[int] = []
        self._waiting: list[tuple[str, int, bytes]] = []
        self._wall = False

    @property
    def now(self) -> int | None:
        """The newest tick; None before the first."""
        return self._ticks[-1] if self._ticks else None

    def tick(self, topic: str, arrived: int, stamp: int, data: bytes) -> None:
        """A message of the clock, `stamp` its simulated time; `arrived` on any steady clock."""
        self._arrivals.append(max(arrived, self._arrivals[-1] if self._arrivals else arrived))
        self._ticks.append(stamp)
        if len(self._ticks) > 2 * KEPT:
            del self._arrivals[:KEPT], self._ticks[:KEPT]
        self._write(topic, stamp, data)
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            self.message(*each)

    def message(self, topic: str, arrived: int, data: bytes) -> None:
        """Any other message: written once the clock has passed it."""
        if self._wall:
            self._write(topic, arrived, data)
        elif not self._arrivals or arrived >= self._arrivals[-1]:
            self._waiting.append((topic, arrived, data))
        else:
            self._write(topic, self._at(arrived), data)

    def _at(self, arrived: int) -> int:
        return self._ticks[max(0, bisect_right(self._arrivals, arrived) - 1)]

    def use_wall_time(self) -> None:
        """There is no clock: arrival counts, for what waits and for all that comes."""
        self._wall = True
        waiting, self._waiting = self._waiting, []
        for each in waiting:
            self._write(*each)

    def close(self) -> None:
        """Write what still waits; what came before any tick gets the time 0."""
        for topic, arrived, data in self._waiting:
            self._write(topic, self._at(arrived) if self._ticks else 0, data)
        self._waiting.clear()
