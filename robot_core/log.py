"""Lines for the log of a node, held back while they repeat; reports for its diagnostics."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

SILENCE = 1.0
"""[s] without joint states that is an error."""
_KEYS_MAX = 256


class Level(IntEnum):
    """As in diagnostic_msgs/DiagnosticStatus; OK goes to the log as INFO."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class LogLine(NamedTuple):
    """A line for the log."""

    level: Level
    text: str


class _Burst:
    """Messages of one key without a pause."""

    __slots__ = ("count", "first", "held_back", "last", "number", "shown", "until", "wait")

    def __init__(self, now: float, wait: float, number: int) -> None:
        self.first = self.last = now
        self.wait = wait
        self.until = now + wait
        self.count = self.shown = 1
        self.number = number
        self.held_back = 0


class Throttle:
    """Shows the first messages of a key, then fewer and fewer of them while they continue."""

    PERIOD = 2.0
    """[s] after the first message until the next reminder; it grows with each."""
    GROWTH = 5.0
    LONGEST = 1000.0
    QUIET = 10.0
    """[s] without a message, after which a key's messages have ended."""
    FORGET = 300.0
    """[s] without a message, after which all about the key is forgotten."""
    BURSTS = 6
    """Bursts shown from their first message on before all is forgotten. A user who tries again sees
    each; of what comes back every few seconds for hours so many more lines are shown, not more."""
    MANY = 5
    """Messages held back, from which on their end is worth a line."""

    def __init__(self) -> None:
        self._bursts: dict[str, _Burst] = {}

    def allow(self, key: str, now: float, burst: int = 1) -> int | None:
        """Decide at `now` [s] whether a message goes into the log.

        Args:
            key: Key of messages that are alike.
            now: Any monotonic time.
            burst: Messages shown in the first period; more than one if those of a key differ.

        Returns:
            None to hold it back; else how many of this key were held back since the last one.
        """
        found = self._bursts.get(key)
        if found is None or now - found.last > self.FORGET:
            if len(self._bursts) >= _KEYS_MAX:
                self._bursts.clear()  # keys come from outside: never grow without bound
            self._bursts[key] = _Burst(now, self.PERIOD, 1)
            return 0
        held_back, quiet = found.held_back, now - found.last > self.QUIET
        if quiet and found.number < self.BURSTS:
            self._bursts[key] = _Burst(now, self.PERIOD, found.number + 1)
            return held_back
        if quiet or not found.count:
            found.first, found.count = now, 0
        found.last = now
        found.count += 1
        if now < found.until:
            if found.shown < burst:
                found.shown += 1
                return 0
            found.held_back += 1
            return None
        found.held_back = 0
        found.wait = min(self.GROWTH * found.wait, self.LONGEST)
        found.until = now + found.wait
        return held_back

    def ended(self, now: float) -> list[tuple[str, int, float]]:
        """The keys whose messages have ended since the last call, if many were held back.

        Returns:
            Key, number of messages, and time from the first to the last [s].
        """
        found = []
        for key, each in self._bursts.items():
            if each.count and now - each.last > self.QUIET:
                if min(each.count, each.held_back) >= self.MANY:
                    found.append((key, each.count, each.last - each.first))
                    each.held_back = 0
                each.count = 0
        return found


@dataclass(frozen=True, slots=True)
class Report:
    """One status of the diagnostics.

    Attributes:
        name: What it is about.
        level: The worst of what is said.
        message: One line.
        values: Numbers as text, with their unit in the name.
    """

    name: str
    level: Level
    message: str
    values: Mapping[str, str]
