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


class _Episode:
    """Messages of one key since they began."""

    __slots__ = ("begun", "count", "first", "held_back", "last", "shown", "until", "wait")

    def __init__(self, now: float, wait: float) -> None:
        self.first = self.last = now
        self.wait = wait
        self.until = now + wait
        self.count = self.shown = self.begun = 1
        self.held_back = 0

    def begin_again(self, now: float, wait: float) -> None:
        """Wait as after the first message; what was held back is still to be counted."""
        self.wait, self.until = wait, now + wait
        self.shown = 1
        self.begun += 1


class Throttle:
    """Shows the first messages of a key, then fewer and fewer of them while they continue.

    Args:
        period: Time [s] after the first message until the next reminder; it grows with each.
    """

    GROWTH = 5.0
    LONGEST = 1000.0
    QUIET = 10.0
    """[s] without a message, after which a key's messages have ended."""
    FORGET = 300.0
    """[s] without a message, after which all about the key is forgotten."""
    BEGINNINGS = 6
    """Bursts shown from their first message on before all is forgotten. A user who tries again sees
    each; of what comes back every few seconds for hours so many more lines are shown, not more."""
    MANY = 5
    """Messages held back, from which on their end is worth a line."""

    def __init__(self, period: float = 2.0) -> None:
        self._period = period
        self._episodes: dict[str, _Episode] = {}

    def allow(self, key: str, now: float, burst: int = 1) -> int | None:
        """Decide at `now` [s] whether a message goes into the log.

        Args:
            key: Key of messages that are alike.
            now: Any monotonic time.
            burst: Messages shown in the first period; more than one if those of a key differ.

        Returns:
            None to hold it back; else how many of this key were held back since the last one.
        """
        episode = self._episodes.get(key)
        if episode is None or now - episode.last > self.FORGET:
            if len(self._episodes) >= _KEYS_MAX:
                self._episodes.clear()  # keys come from outside: never grow without bound
            self._episodes[key] = _Episode(now, self._period)
            return 0
        quiet = now - episode.last > self.QUIET
        if quiet or not episode.count:
            episode.first = now
            episode.count = 0
        episode.last = now
        episode.count += 1
        if quiet and episode.begun < self.BEGINNINGS:
            episode.begin_again(now, self._period)
            held_back, episode.held_back = episode.held_back, 0
            return held_back
        if now < episode.until:
            if episode.shown < burst:
                episode.shown += 1
                return 0
            episode.held_back += 1
            return None
        held_back, episode.held_back = episode.held_back, 0
        episode.wait = min(self.GROWTH * episode.wait, self.LONGEST)
        episode.until = now + episode.wait
        return held_back

    def ended(self, now: float) -> list[tuple[str, int, float]]:
        """The keys whose messages have ended since the last call, if many were held back.

        Returns:
            Key, number of messages, and time from the first to the last [s].
        """
        found = []
        for key, episode in self._episodes.items():
            if episode.count and now - episode.last > self.QUIET:
                if min(episode.count, episode.held_back) >= self.MANY:
                    found.append((key, episode.count, episode.last - episode.first))
                    episode.held_back = 0
                episode.count = 0
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
