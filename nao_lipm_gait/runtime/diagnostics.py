"""What is said of the gait: lines for the log, and remarks for the next report.

The log says a thing when it begins, when it gets worse and when it ends.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from robot_core.log import Level, LogLine, Throttle

SENSORS, WALK, COMMANDS = "sensors", "walk", "commands"
"""The reports, and the groups of what is said."""
_PER_REPORT = 32
"""Remarks kept for a report; a flood of bad messages must not grow a list."""


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that goes into the next report."""

    level: Level
    text: str


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

        `Throttle.allow` explains key and burst.
        """
        held_back = self._throttle.allow(key, self._clock(), burst)
        if held_back is None:
            return False
        self.log(level, text + (f" ({held_back} more like it)" if held_back else ""))
        return True

    def event(self, group: str, level: Level, key: str, text: str, burst: int = 1) -> None:
        """Log something that happened, as `log_event`, and put it into the report of a group."""
        self.remark(group, level, text)
        self.log_event(level, key, text, burst)

    def begin(self, group: str, level: Level, key: str, text: str, kind: str = "") -> None:
        """Report a condition that holds now; call it again to update its text.

        It is logged when it begins, when its level rises and when its kind changes.

        Args:
            group: The report: SENSORS, WALK or COMMANDS.
            level: Its severity.
            key: Names the condition for its end.
            text: What it is.
            kind: Tells apart conditions that share a key.
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
            over = f"{count} warnings in {seconds:.1f} s, none for {Throttle.QUIET:.0f} s"
            self.log(Level.OK, f"{key}: {over}")

    def take_remarks(self) -> dict[str, tuple[Remark, ...]]:
        """The conditions that hold, and what happened since the last call, by group."""
        taken = {group: tuple(remarks) for group, remarks in self._remarks.items()}
        for condition in self._conditions.values():
            remark = Remark(condition.level, condition.text)
            taken[condition.group] = (remark, *taken[condition.group])
        for remarks in self._remarks.values():
            remarks.clear()
        return taken
