"""What is said of the gait: lines for the log, and remarks for the next report.

The log says a thing when it begins, when it gets worse and when it ends; `reports` makes the
reports. `sim_bridge` uses `Throttle` and `LogLine` for its own log.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

SENSORS, WALK, COMMANDS = "sensors", "walk", "commands"
"""The reports, and the groups of what is said."""
_PER_REPORT = 32
"""Remarks kept for a report; a flood of bad messages must not grow a list."""
_KEYS_MAX = 256


class Level(IntEnum):
    """As in diagnostic_msgs/DiagnosticStatus; OK goes to the log as INFO."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class LogLine(NamedTuple):
    """A line for the log.

    Attributes:
        level: Its severity.
        text: The line.
    """

    level: Level
    text: str


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that goes into the next report.

    Attributes:
        level: Its severity.
        text: What happened.
    """

    level: Level
    text: str


# -- log -------------------------------------------------------------------------------------------


class _Episode:
    """Messages of one key since they began."""

    __slots__ = ("count", "first", "held_back", "last", "shown", "until", "wait")

    def __init__(self, now: float, wait: float) -> None:
        self.first = self.last = now
        self.wait = wait
        self.until = now + wait
        self.count = self.shown = 1
        self.held_back = 0


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
    """[s] without a message, after which a message of the key is new again."""
    MANY = 5
    """Messages held back, from which on their end is worth a line."""

    def __init__(self, period: float = 2.0) -> None:
        self._period = period
        self._episodes: dict[str, _Episode] = {}

    def allow(self, key: str, now: float, burst: int = 1) -> int | None:
        """Decide whether a message goes into the log.

        Args:
            key: Key of messages that are alike.
            now: Any monotonic time [s].
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
        if not episode.count:
            episode.first = now
        episode.last = now
        episode.count += 1
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

        Args:
            now: As for `allow`.

        Returns:
            Key, number of messages, and time from the first to the last [s].
        """
        found = []
        for key, episode in self._episodes.items():
            if episode.count and now - episode.last > self.QUIET:
                if episode.held_back >= self.MANY:
                    found.append((key, episode.count, episode.last - episode.first))
                    episode.held_back = 0
                episode.count = 0
        return found


class _Condition(NamedTuple):
    group: str
    level: Level
    text: str
    kind: str


class Diagnostics:
    """Collects what is to be said: log lines at once, remarks for the next report.

    An event happens at a moment; a condition lasts from `begin` to `end`.

    Args:
        clock: Any monotonic time [s].

    Attributes:
        rejected: Refused messages per topic.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._throttle = Throttle()
        self._log: list[LogLine] = []
        self._remarks: dict[str, list[Remark]] = {SENSORS: [], WALK: [], COMMANDS: []}
        self._conditions: dict[str, _Condition] = {}
        self.rejected: Counter[str] = Counter()

    def log(self, level: Level, text: str) -> None:
        """Add a line to the log."""
        self._log.append(LogLine(level, text))

    def log_event(self, level: Level, key: str, text: str, burst: int = 1) -> bool:
        """Add a line to the log, unless enough of its key were shown; says whether it did.

        Args:
            level: Its severity.
            key: Key of events that are alike; see `Throttle`.
            text: What happened.
            burst: See `Throttle.allow`.
        """
        held_back = self._throttle.allow(key, self._clock(), burst)
        if held_back is None:
            return False
        self.log(level, text + (f" ({held_back} more like it)" if held_back else ""))
        return True

    def event(self, group: str, level: Level, key: str, text: str, burst: int = 1) -> None:
        """Log and report something that happened.

        Args:
            group: The report: SENSORS, WALK or COMMANDS.
            level: As for `log_event`.
            key: As for `log_event`.
            text: What happened.
            burst: See `Throttle.allow`.
        """
        self.remark(group, level, text)
        self.log_event(level, key, text, burst)

    def begin(self, group: str, level: Level, key: str, text: str, kind: str = "") -> None:
        """Report a condition that holds now; call it again to update its text.

        It is logged when it begins, when its level rises and when its kind changes.

        Args:
            group: The report: SENSORS, WALK or COMMANDS.
            level: Its severity.
            key: Key of the condition.
            text: What it is.
            kind: Tells apart conditions that share a key and thereby their end.
        """
        before = self._conditions.get(key)
        self._conditions[key] = _Condition(group, level, text, kind)
        if before is None or level > before.level or kind != before.kind:
            self.remark(group, level, text)
            self.log(level, text)

    def end(self, key: str, text: str) -> None:
        """End a condition; if it held, `text` is logged."""
        if self._conditions.pop(key, None) is not None:
            self.log(Level.OK, text)

    def remark(self, group: str, level: Level, text: str) -> None:
        """Put something into the next report only."""
        remarks = self._remarks[group]
        if len(remarks) < _PER_REPORT:
            remarks.append(Remark(level, text))

    def take_log(self) -> tuple[LogLine, ...]:
        """The log lines since the last call."""
        if not self._log:
            return ()
        lines = tuple(self._log)
        self._log.clear()
        return lines

    def watch(self) -> None:
        """Log which events have ended; to be called a few times per second."""
        for key, count, seconds in self._throttle.ended(self._clock()):
            self.log(Level.OK, f"no more warnings about {key}: {count} in {seconds:.1f} s")

    def take_remarks(self) -> dict[str, tuple[Remark, ...]]:
        """The conditions that hold, and what happened since the last call, by group."""
        taken = {group: tuple(remarks) for group, remarks in self._remarks.items()}
        for condition in self._conditions.values():
            remark = Remark(condition.level, condition.text)
            taken[condition.group] = (remark, *taken[condition.group])
        for remarks in self._remarks.values():
            remarks.clear()
        return taken
