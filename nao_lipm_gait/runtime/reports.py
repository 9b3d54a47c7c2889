"""One report per second each of the sensors, the walk and the commands, for the diagnostics."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from nao_lipm_gait.runtime.diagnostics import COMMANDS, SENSORS, WALK, Remark
from robot_core.log import SILENCE, Level, Report
from robot_core.types import GaitState, GaitStatus

IDLE = 10.0
"""[s] after the last velocity command, after which its absence is no warning any more."""
UNREACHED = 1e-3
"""[m] Distance of a sole from its target that is reported."""
_SHOWN = 3
"""Remarks shown in a report."""


@dataclass(frozen=True, slots=True)
class TickSummary:
    """Number of ticks, and their durations [us]."""

    count: int
    p50: float
    p99: float
    maximum: float


def quantile(ordered: Sequence[float], share: float) -> float:
    """The smallest of the sorted values that at least `share` of them do not exceed."""
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


class TickTimes:
    """Durations of ticks since the last summary, the newest 10000 at most, and missed deadlines.

    A tick that takes longer than a control `period` [s] misses its deadline. That is late only if
    the robot did not wait: in lockstep, no joint state arrives before the last one is answered.

    Attributes:
        misses: Ticks that took longer than a control period, since the start.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._durations: deque[float] = deque(maxlen=10_000)
        self._missed_until: float | None = None
        self.misses = 0

    def add(self, begin: float, end: float) -> None:
        """Keep a tick from `begin` to `end`, any monotonic time [s]."""
        self._durations.append((end - begin) * 1e6)
        if end - begin > self._period:
            self.misses += 1
            self._missed_until = end

    def was_late(self, arrived: float) -> bool:
        """Whether the tick before was late; for each joint state, which `arrived` [s]."""
        end, self._missed_until = self._missed_until, None
        return end is not None and arrived < end

    def summarize(self) -> TickSummary | None:
        """Summarize the ticks since the last call; None if there were none."""
        if not self._durations:
            return None
        ordered = sorted(self._durations)
        self._durations.clear()
        return TickSummary(
            len(ordered), quantile(ordered, 0.5), quantile(ordered, 0.99), ordered[-1]
        )


@dataclass(frozen=True, slots=True)
class Health:
    """The state of the gait at the end of a second; what is None has not happened yet.

    Attributes:
        ticks: Ticks of this second.
        sensor_age: Wall time [s] since the last joint state.
        missed_ticks: Frames that never arrived, since the start.
        rejected: Refused messages per topic, since the start.
        faults: Ticks whose targets were held or clipped by the guard, since the start.
        deadline_misses: Ticks that took longer than a control period, since the start.
        status: Status of the last tick.
        command_age: Sensor time [s] since the last velocity command.
        command_timed_out: A command to move is too old, so the robot stops.
        gyro_bias_sigma: Standard deviation of the gyro's bias [rad/s].
        joints_refused: Joint states arrive, but cannot be read.
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
    joints_refused: bool = False
    remarks: Mapping[str, Sequence[Remark]] | None = None


def reports(health: Health) -> tuple[Report, ...]:
    """Make one report each for the sensors, the walk and the commands."""
    makers = {SENSORS: _sensors, WALK: _walk, COMMANDS: _commands}
    remarks = health.remarks or {}
    return tuple(make(health, remarks.get(group, ())) for group, make in makers.items())


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
    none = "no usable joint_states" if health.joints_refused else "no joint_states"
    if health.sensor_age is None:
        level, message = Level.STALE, f"{none} so far"
    elif health.sensor_age > SILENCE:
        level, message = Level.ERROR, f"{none} for {health.sensor_age:.1f} s"
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
    elif status.state is GaitState.LIFTED:
        level = Level.WARN
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
