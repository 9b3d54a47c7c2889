"""Health of the gait: what goes into the log, and one report per second for the diagnostics.

The log says a thing when it begins, when it gets worse and when it ends. The reports show the state
of now. `sim_bridge` uses `Throttle` for its own log.
"""

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from nao_lipm_gait.types import GaitState, GaitStatus

SENSORS, WALK, COMMANDS = "sensors", "walk", "commands"
"""The reports, and the groups of what is said."""
SILENCE = 0.5
"""[s] without joint states that is an error."""
UNREACHED = 1e-3
"""[m] Distance of a sole from its target that is reported."""
_PER_REPORT = 32
"""Remarks kept for a report; a flood of bad messages must not grow a list."""
_SHOWN = 3
"""Remarks shown in a report."""
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


# -- tick times ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TickSummary:
    """Durations of ticks.

    Attributes:
        count: Number of ticks.
        p50: Median [us].
        p99: 99th percentile [us].
        maximum: [us].
    """

    count: int
    p50: float
    p99: float
    maximum: float


def quantile(ordered: Sequence[float], share: float) -> float:
    """The smallest of the sorted values that at least `share` of them do not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


class TickStatistics:
    """Keeps the durations since the last summary, the newest 10000 at most."""

    def __init__(self) -> None:
        self._durations: deque[float] = deque(maxlen=10_000)

    def add(self, duration: float) -> None:
        """Keep the duration [us] of a tick."""
        self._durations.append(duration)

    def summarize(self) -> TickSummary | None:
        """Summarize the ticks since the last call; None if there were none."""
        if not self._durations:
            return None
        ordered = sorted(self._durations)
        self._durations.clear()
        return TickSummary(
            len(ordered), quantile(ordered, 0.5), quantile(ordered, 0.99), ordered[-1]
        )


# -- log -------------------------------------------------------------------------------------------


class Throttle:
    """Lets a few messages per key and period through and counts those that it holds back.

    Args:
        period: [s].
    """

    def __init__(self, period: float = 2.0) -> None:
        self._period = period
        self._windows: dict[str, list[float]] = {}
        """Key -> [begin of the window, messages in it]."""

    def allow(self, key: str, now: float, burst: int = 1) -> int | None:
        """Decide whether a message goes into the log.

        Args:
            key: Key of messages that are alike.
            now: Any monotonic time [s].
            burst: Messages per period; more than one if the messages under a key differ.

        Returns:
            None to hold it back; else how many of this key were held back in the last period.
        """
        window = self._windows.get(key)
        if window is None:
            if len(self._windows) >= _KEYS_MAX:
                self._windows.clear()  # keys come from outside: never grow without bound
            self._windows[key] = [now, 1]
            return 0
        begin, count = window
        if now - begin < self._period:
            window[1] = count + 1
            return 0 if count < burst else None
        self._windows[key] = [now, 1]
        return max(0, int(count) - burst)


class Diagnostics:
    """Collects what is to be said: log lines at once, remarks for the next report.

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
        self.rejected: Counter[str] = Counter()

    def event(self, group: str, level: Level, key: str, text: str, burst: int = 1) -> None:
        """Report something that happened.

        Args:
            group: The report: SENSORS, WALK or COMMANDS.
            level: Its severity.
            key: Key of events that are alike; the log shows `burst` of them per period.
            text: What happened.
            burst: See `key`.
        """
        remarks = self._remarks[group]
        if len(remarks) < _PER_REPORT:
            remarks.append(Remark(level, text))
        held_back = self._throttle.allow(key, self._clock(), burst)
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self._log.append(LogLine(level, text + more))

    def take_log(self) -> tuple[LogLine, ...]:
        """The log lines since the last call."""
        if not self._log:
            return ()
        lines = tuple(self._log)
        self._log.clear()
        return lines

    def take_remarks(self) -> dict[str, tuple[Remark, ...]]:
        """The remarks since the last call, by group."""
        taken = {group: tuple(remarks) for group, remarks in self._remarks.items()}
        for remarks in self._remarks.values():
            remarks.clear()
        return taken


@dataclass(frozen=True, slots=True)
class PublisherCounts:
    """Publishers on the topics of this gait, as discovery sees them.

    Attributes:
        cmd_vel: Senders of velocity commands.
        joint_states: Robots.
        joint_command: Gaits, this one included.
    """

    cmd_vel: int = 1
    joint_states: int = 1
    joint_command: int = 1


def report_publishers(counts: PublisherCounts, diagnostics: Diagnostics) -> None:
    """Report topics that have more publishers than they should."""
    if counts.joint_states > 1:
        diagnostics.event(
            SENSORS, Level.ERROR, "robots",
            f"{counts.joint_states} publishers on joint_states; allowed: one robot; does another "
            "run share this ROS_DOMAIN_ID?",
        )  # fmt: skip
    if counts.joint_command > 1:
        diagnostics.event(
            WALK, Level.ERROR, "gaits",
            f"{counts.joint_command} publishers on joint_command; allowed: one gait; the simulated "
            "robot executes only the first one's commands",
        )  # fmt: skip
    if counts.cmd_vel > 1:
        diagnostics.event(
            COMMANDS, Level.WARN, "drivers",
            f"{counts.cmd_vel} publishers on cmd_vel; the newest command counts",
        )  # fmt: skip


# -- reports ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Health:
    """The state of the gait at the end of a second.

    Attributes:
        ticks: Ticks of this second; None without a tick.
        sensor_age: Wall time [s] since the last joint state; None before the first.
        missed_ticks: Frames that never arrived, since the start.
        rejected: Refused messages per topic, since the start.
        faults: Ticks whose targets were held or clipped by the guard, since the start.
        deadline_misses: Ticks that took longer than one control period, since the start.
        status: Status of the last tick; None before the first.
        command_age: Sensor time [s] since the last velocity command; None before the first.
        command_timed_out: A command to move is too old, and the robot stops.
        remarks: What happened in this second, by report.
    """

    ticks: TickSummary | None
    sensor_age: float | None
    missed_ticks: int
    rejected: Mapping[str, int]
    faults: int
    deadline_misses: int
    status: GaitStatus | None
    command_age: float | None = None
    command_timed_out: bool = False
    remarks: Mapping[str, Sequence[Remark]] | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """One status of the diagnostics.

    Attributes:
        name: SENSORS, WALK or COMMANDS.
        level: The worst of what is said.
        message: One line.
        values: Numbers as text, with their unit in the name.
    """

    name: str
    level: Level
    message: str
    values: Mapping[str, str]


def reports(health: Health) -> tuple[Report, ...]:
    """Make one report each for the sensors, the walk and the commands."""
    remarks = health.remarks or {}
    return (
        _sensors(health, remarks.get(SENSORS, ())),
        _walk(health, remarks.get(WALK, ())),
        _commands(health, remarks.get(COMMANDS, ())),
    )


def _with_remarks(level: Level, message: str, remarks: Sequence[Remark]) -> tuple[Level, str]:
    """Level and message together with the remarks: the worst ones first, each once."""
    found = dict.fromkeys(
        remark.text for remark in sorted(remarks, key=lambda remark: -remark.level)
    )
    worst = max((remark.level for remark in remarks), default=Level.OK)
    shown = [text for text in (message, *list(found)[:_SHOWN]) if text]
    return max(level, worst), "; ".join(shown)


def _sensors(health: Health, remarks: Sequence[Remark]) -> Report:
    level, message = Level.OK, "sensors arrive"
    if health.sensor_age is None:
        level, message = Level.STALE, "no joint_states so far"
    elif health.sensor_age > SILENCE:
        level, message = Level.ERROR, f"no joint_states for {health.sensor_age:.1f} s"
    elif remarks:
        message = ""
    level, message = _with_remarks(level, message, remarks)
    values = {
        "sensor age [s]": "" if health.sensor_age is None else f"{health.sensor_age:.3f}",
        "missed ticks": str(health.missed_ticks),
        **{f"rejected {topic}": str(count) for topic, count in health.rejected.items()},
    }
    return Report(SENSORS, level, message, values)


def _walk(health: Health, remarks: Sequence[Remark]) -> Report:
    status, ticks = health.status, health.ticks
    if status is None:
        return Report(WALK, *_with_remarks(Level.STALE, "no tick so far", remarks), {})
    level, message = Level.OK, status.state.value
    if status.state is GaitState.FALLEN:
        level = Level.ERROR
    elif status.ik_residual > UNREACHED or status.clipped_joints:
        level = Level.WARN
        message += ", target out of reach"
    level, message = _with_remarks(level, message, remarks)
    innovation = [
        measured - expected
        for measured, expected in zip(
            status.com_measured_in_q, status.com_expected_in_q, strict=True
        )
    ]
    values = {
        "state": status.state.value,
        "motion": status.motion,
        "support": status.support,
        "steps": str(status.step_count),
        "ticks per second": str(ticks.count if ticks else 0),
        "tick p50 [us]": f"{ticks.p50:.0f}" if ticks else "",
        "tick p99 [us]": f"{ticks.p99:.0f}" if ticks else "",
        "tick max [us]": f"{ticks.maximum:.0f}" if ticks else "",
        "deadline misses": str(health.deadline_misses),
        "observer innovation x [mm]": f"{innovation[0] * 1e3:.2f}",
        "observer innovation y [mm]": f"{innovation[1] * 1e3:.2f}",
        "IK residual [mm]": f"{status.ik_residual * 1e3:.3f}",
        "clipped joints": str(status.clipped_joints),
        "torso roll [rad]": f"{status.torso_roll:.4f}",
        "torso pitch [rad]": f"{status.torso_pitch:.4f}",
        "faults": str(health.faults),
    }
    return Report(WALK, level, message, values)


def _commands(health: Health, remarks: Sequence[Remark]) -> Report:
    level, message = Level.OK, "cmd_vel arrives"
    if health.command_age is None:
        message = "no cmd_vel so far"
    elif health.command_timed_out:
        level = Level.WARN
        message = f"no cmd_vel for {health.command_age:.1f} s: the robot stops"
    level, message = _with_remarks(level, message, remarks)
    age = "" if health.command_age is None else f"{health.command_age:.3f}"
    return Report(COMMANDS, level, message, {"cmd_vel age [s]": age})
