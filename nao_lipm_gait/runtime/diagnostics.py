"""Health of the gait: what goes into the log, and one report per second for the diagnostics.

The log says a thing when it begins, when it gets worse and when it ends. The reports show the state
of now. `sim_bridge` uses `Throttle` for its own log.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from nao_lipm_gait.runtime.tick_times import TickSummary
from nao_lipm_gait.types import GaitState, GaitStatus

SENSORS, WALK, COMMANDS = "sensors", "walk", "commands"
"""The reports, and the groups of what is said."""
SILENCE = 0.5
"""[s] without joint states that is an error."""
IDLE = 10.0
"""[s] after the last velocity command, after which its absence is no warning any more."""
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

    def holds(self, key: str) -> bool:
        """Whether a condition holds now."""
        return key in self._conditions

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


# -- publishers ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PublisherCounts:
    """Publishers on the topics of this gait, as discovery sees them.

    Attributes:
        cmd_vel: Senders of velocity commands.
        joint_states: Robots.
        joint_command: Gaits, this one included.
        mismatched: Senders of `cmd_vel` with another message type, described.
    """

    cmd_vel: int = 1
    joint_states: int = 1
    joint_command: int = 1
    mismatched: str = ""


class PublisherWatch:
    """Reports topics that have more publishers than they should.

    Discovery keeps a process that was killed until its lease ends. A second publisher is therefore
    logged only if it is still there after that time. The reports show it at once.

    Args:
        diagnostics: Takes what was found.
        clock: Any monotonic time [s].
    """

    LEASE = 25.0
    """[s] The default lease of Fast DDS is 20 s, of Cyclone DDS 10 s."""

    def __init__(self, diagnostics: Diagnostics, clock: Callable[[], float]) -> None:
        self._diagnostics = diagnostics
        self._clock = clock
        self._since: dict[str, float] = {}

    def update(self, counts: PublisherCounts) -> None:
        """Compare the numbers with those that are allowed; to be called once per second."""
        n = counts.joint_states
        self._check(
            "joint_states", n, SENSORS, Level.ERROR,
            f"{n} publishers on joint_states; allowed: one robot; does another run share this "
            "ROS_DOMAIN_ID?",
        )  # fmt: skip
        n = counts.joint_command
        self._check(
            "joint_command", n, WALK, Level.ERROR,
            f"{n} publishers on joint_command; allowed: one gait; the simulated robot "
            "executes only the commands of the first",
        )  # fmt: skip
        n = counts.cmd_vel
        self._check(
            "cmd_vel", n, COMMANDS, Level.WARN,
            f"{n} publishers on cmd_vel; the newest command counts",
        )  # fmt: skip
        if counts.mismatched:
            self._diagnostics.begin(COMMANDS, Level.ERROR, "cmd_vel type", counts.mismatched)
        else:
            self._diagnostics.end("cmd_vel type", "every sender of cmd_vel uses the right type")

    def _check(self, topic: str, count: int, group: str, level: Level, text: str) -> None:
        key = f"publishers of {topic}"
        if count <= 1:
            self._since.pop(topic, None)
            self._diagnostics.end(key, f"one publisher on {topic} again")
            return
        now = self._clock()
        if now - self._since.setdefault(topic, now) > self.LEASE:
            self._diagnostics.begin(group, level, key, text)
        else:
            self._diagnostics.remark(group, level, text)


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
        deadline_misses: Ticks that took longer than a control period, since the start.
        status: Status of the last tick; None before the first.
        command_age: Sensor time [s] since the last velocity command; None before the first.
        command_timed_out: A command to move is too old, so the robot stops.
        gyro_bias_sigma: Standard deviation of the gyro's bias [rad/s].
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
    gyro_bias_sigma: float = 0.0
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
        "gyro bias deviation [rad/s]": f"{health.gyro_bias_sigma:.5f}",
        "faults": str(health.faults),
    }
    return Report(WALK, level, message, values)


def _commands(health: Health, remarks: Sequence[Remark]) -> Report:
    level, message = Level.OK, "cmd_vel arrives"
    if health.command_age is None:
        message = "no cmd_vel so far"
    elif health.command_timed_out and health.command_age < IDLE:
        level = Level.WARN
        message = f"no cmd_vel for {health.command_age:.1f} s: the robot stops"
    elif health.command_timed_out:
        message = f"idle, no cmd_vel for {health.command_age:.0f} s"
    level, message = _with_remarks(level, message, remarks)
    age = "" if health.command_age is None else f"{health.command_age:.3f}"
    return Report(COMMANDS, level, message, {"cmd_vel age [s]": age})
