"""Who else publishes on the topics of a gait, and what is to be said about it.

What there is to say: collected for the next report, and logged where that does not flood.

Keep a flood of equal warnings readable.

What the gait knows about its own health, and what it has to say about it.

How long the ticks of the last while took.
"""

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from nao_lipm_gait.types import GaitState, GaitStatus


@dataclass(frozen=True, slots=True)
class TickSummary:
    """Durations in microseconds."""

    count: int
    p50: float
    p99: float
    maximum: float


def quantile(ordered: list[float], share: float) -> float:
    """The smallest value that at least `share` of the sorted values do not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


class TickStatistics:
    """Keeps the durations since the last summary, the newest 10000 at most."""

    def __init__(self) -> None:
        self._durations: deque[float] = deque(maxlen=10_000)

    def add(self, duration: float) -> None:
        """Duration [us]"""
        self._durations.append(duration)

    def summarize(self) -> TickSummary | None:
        """Summary since the last call; None when there was no tick."""
        if not self._durations:
            return None
        ordered = sorted(self._durations)
        self._durations.clear()
        return TickSummary(
            len(ordered), quantile(ordered, 0.5), quantile(ordered, 0.99), ordered[-1]
        )


SILENCE = 0.5
"""[s] without sensors that is worth an error."""


class Level(IntEnum):
    """As in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that happened since the last report."""

    level: Level
    text: str


@dataclass(frozen=True, slots=True)
class Health:
    """The state of the gait at the end of a second."""

    ticks: TickSummary | None
    """Of this second; None without a tick."""
    sensor_age: float | None
    """[s] wall time since the last joint state; None before the first."""
    missed_ticks: int
    """Frames that never came, since the start."""
    rejected: Mapping[str, int]
    """Refused messages per topic, since the start."""
    faults: int
    """Ticks whose targets were held or cut, since the start."""
    deadline_misses: int
    """Ticks that took longer than one control period, since the start."""
    status: GaitStatus | None
    command_age: float | None = None
    """[s] of sensor time since the last velocity command; None before the first."""
    command_timed_out: bool = False
    """A command to move became too old, and the robot stops."""
    sensors: Sequence[Remark] = ()
    walk: Sequence[Remark] = ()
    commands: Sequence[Remark] = ()


@dataclass(frozen=True, slots=True)
class Report:
    """One line of the diagnostics."""

    name: str
    level: Level
    message: str
    values: Mapping[str, str]


def reports(health: Health) -> tuple[Report, ...]:
    """One report each for the sensors, the walk and the commands."""
    return _sensors(health), _walk(health), _commands(health)


def _worst(
    level: Level, message: str, remarks: Sequence[Remark]
) -> tuple[Level, str]:
    """Level and message with the remarks: the worst ones first, each once."""
    found = dict.fromkeys(
        remark.text for remark in sorted(remarks, key=lambda remark: -remark.level)
    )
    worst = max((remark.level for remark in remarks), default=Level.OK)
    shown = [text for text in (message, *list(found)[:3]) if text]
    return max(level, worst), "; ".join(shown)


def _sensors(health: Health) -> Report:
    level, message = Level.OK, "sensors arrive"
    if health.sensor_age is None:
        level, message = Level.STALE, "no joint_states so far"
    elif health.sensor_age > SILENCE:
        level, message = Level.ERROR, f"no joint_states for {health.sensor_age:.1f} s"
    elif health.sensors:
        message = ""
    level, message = _worst(level, message, health.sensors)
    values = {
        "sensor age [s]": "" if health.sensor_age is None else f"{health.sensor_age:.3f}",
        "missed ticks": str(health.missed_ticks),
        **{f"rejected {topic}": str(count) for topic, count in health.rejected.items()},
    }
    return Report("sensors", level, message, values)


def _walk(health: Health) -> Report:
    status, ticks = health.status, health.ticks
    if status is None:
        return Report("walk", *_worst(Level.STALE, "no tick so far", health.walk), {})
    level = Level.OK
    if status.state is GaitState.FALLEN:
        level = Level.ERROR
    elif status.ik_residual > 1e-3 or status.clipped_joints:
        level = Level.WARN
    message = status.state.value
    if level is Level.WARN:
        message += ", target out of reach"
    level, message = _worst(level, message, health.walk)
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
    return Report("walk", level, message, values)


def _commands(health: Health) -> Report:
    level, message = Level.OK, "cmd_vel arrives"
    if health.command_age is None:
        message = "no cmd_vel so far"
    elif health.command_timed_out:
        level = Level.WARN
        message = f"no cmd_vel for {health.command_age:.1f} s: the robot stops"
    level, message = _worst(level, message, health.commands)
    age = "" if health.command_age is None else f"{health.command_age:.3f}"
    return Report("commands", level, message, {"cmd_vel age [s]": age})


_MAX_KEYS = 256


class Throttle:
    """Lets a few messages per key and period through and counts the ones that it held back."""

    def __init__(self, period: float = 2.0) -> None:
        """Period [s]"""
        self._period = period
        self._windows: dict[str, list[float]] = {}  # key -> [begin, messages in the window]

    def allow(self, key: str, now: float, burst: int = 1) -> int | None:
        """None to keep quiet; else how many of this key were held back in the last period.

        now: any monotonic time [s]. burst: messages per period; more than one where a key stands
        for faults that differ.
        """
        window = self._windows.get(key)
        if window is None:
            if len(self._windows) >= _MAX_KEYS:
                self._windows.clear()  # keys come from outside: never grow without bound
            self._windows[key] = [now, 1]
            return 0
        begin, count = window
        if now - begin < self._period:
            window[1] = count + 1
            return 0 if count < burst else None
        self._windows[key] = [now, 1]
        return max(0, int(count) - burst)


SENSORS, WALK, COMMANDS = "sensors", "walk", "commands"
_PER_REPORT = 32
"""A flood of bad messages shall not grow a list."""


class Remarks:
    """Remarks by group, and how many messages were refused."""

    def __init__(self, log: Callable[[Level, str], None], clock: Callable[[], float]) -> None:
        """clock: any monotonic time [s]."""
        self._log = log
        self._clock = clock
        self._throttle = Throttle()
        self._said: dict[str, list[Remark]] = {SENSORS: [], WALK: [], COMMANDS: []}
        self.rejected: Counter[str] = Counter()
        """Refused messages per topic."""

    def tell(self, group: str, level: Level, key: str, text: str, burst: int = 1) -> None:
        """Into the next report; into the log `burst` times per key and period."""
        said = self._said[group]
        if len(said) < _PER_REPORT:
            said.append(Remark(level, text))
        held_back = self._throttle.allow(key, self._clock(), burst)
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self._log(level, text + more)

    def take(self) -> dict[str, tuple[Remark, ...]]:
        """What was said since the last call, by group."""
        taken = {group: tuple(said) for group, said in self._said.items()}
        for said in self._said.values():
            said.clear()
        return taken


@dataclass(frozen=True, slots=True)
class Others:
    """Publishers on the topics of this gait, as discovery sees them; this gait counts too."""

    cmd_vel: int = 1
    joint_states: int = 1
    joint_command: int = 1

    def report(self, remarks: Remarks) -> None:
        """Say what is more than one."""
        if self.joint_states > 1:
            remarks.tell(
                SENSORS, Level.ERROR, "robots",
                f"{self.joint_states} publishers on joint_states; allowed: one robot; does "
                "another run share this ROS_DOMAIN_ID?",
            )  # fmt: skip
        if self.joint_command > 1:
            remarks.tell(
                WALK, Level.ERROR, "gaits",
                f"{self.joint_command} publishers on joint_command; allowed: one gait; the "
                "simulated robot obeys the one that it obeyed before",
            )  # fmt: skip
        if self.cmd_vel > 1:
            remarks.tell(
                COMMANDS, Level.WARN, "drivers",
                f"{self.cmd_vel} publishers on cmd_vel; the newest command counts",
            )  # fmt: skip
