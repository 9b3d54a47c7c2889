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


def _with_remarks(level: Level, message: str, remarks: Sequence[Remark]) -> tuple[Level, str]:
    """Level and message together with the remarks: the worst ones first, each once."""
    found = dict.fromkeys(
        remark.text for remark in sorted(remarks, key=lambda remark: -remark.level)
    )
    worst = max((remark.level for remark in remarks), default=Level.OK)
    shown = [text for text in (message, *list(found)[:_SHOWN]) if text]
    return max(level, worst), "; ".join(shown)


def sensors_report(
    age: float | None, refused: bool, missed: int, rejected: Mapping[str, int],
    remarks: Sequence[Remark] = (),
) -> Report:  # fmt: skip
    """Whether sensors arrive.

    Args:
        age: Wall time [s] since the last joint state; None before the first.
        refused: Joint states arrive, but cannot be read.
        missed: Frames that never arrived, since the start.
        rejected: Refused messages per topic, since the start.
        remarks: What happened since the last report.
    """
    level, message = Level.OK, "" if remarks else "sensors arrive"
    none = "no usable joint_states" if refused else "no joint_states"
    if age is None:
        level, message = Level.STALE, f"{none} so far"
    elif age > SILENCE:
        level, message = Level.ERROR, f"{none} for {age:.1f} s"
    values = {
        "sensor age [s]": "" if age is None else f"{age:.3f}",
        "missed ticks": str(missed),
        **{f"rejected {topic}": str(count) for topic, count in rejected.items()},
    }
    return Report(SENSORS, *_with_remarks(level, message, remarks), values)


def walk_report(
    status: GaitStatus | None, ticks: TickSummary | None, misses: int = 0, faults: int = 0,
    bias_sigma: float = 0.0, remarks: Sequence[Remark] = (),
) -> Report:  # fmt: skip
    """What the gait does.

    Args:
        status: Of the last tick; None before the first.
        ticks: Those since the last report.
        misses: Ticks that took longer than a control period, since the start.
        faults: Ticks whose targets were held or clipped by the guard, since the start.
        bias_sigma: Standard deviation of the gyro's bias [rad/s].
        remarks: What happened since the last report.
    """
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
    x, y = (
        1e3 * (status.com_measured_in_q[axis] - status.com_expected_in_q[axis]) for axis in (0, 1)
    )
    values = {
        "state": status.state.value,
        "motion": status.motion,
        "support": status.support,
        "steps": str(status.step_count),
        "ticks per second": str(ticks.count if ticks else 0),
        "tick p50 [us]": f"{ticks.p50:.0f}" if ticks else "",
        "tick p99 [us]": f"{ticks.p99:.0f}" if ticks else "",
        "tick max [us]": f"{ticks.maximum:.0f}" if ticks else "",
        "deadline misses": str(misses),
        "observer innovation x [mm]": f"{x:.2f}",
        "observer innovation y [mm]": f"{y:.2f}",
        "IK residual [mm]": f"{status.ik_residual * 1e3:.3f}",
        "clipped joints": str(status.clipped_joints),
        "torso roll [rad]": f"{status.torso_roll:.4f}",
        "torso pitch [rad]": f"{status.torso_pitch:.4f}",
        "gyro bias deviation [rad/s]": f"{bias_sigma:.5f}",
        "faults": str(faults),
    }
    return Report(WALK, *_with_remarks(level, message, remarks), values)


def commands_report(age: float | None, timed_out: bool, remarks: Sequence[Remark] = ()) -> Report:
    """Whether velocities are commanded.

    Args:
        age: Sensor time [s] since the last command; None before the first.
        timed_out: A command to move is too old, so the robot stops.
        remarks: What happened since the last report.
    """
    level, message = Level.OK, "cmd_vel arrives"
    if age is None:
        message = "no cmd_vel so far"
    elif timed_out and age < IDLE:
        level = Level.WARN
        message = f"no cmd_vel for {age:.1f} s: the robot stops"
    elif timed_out:
        message = f"idle, no cmd_vel for {age:.0f} s"
    values = {"cmd_vel age [s]": "" if age is None else f"{age:.3f}"}
    return Report(COMMANDS, *_with_remarks(level, message, remarks), values)
