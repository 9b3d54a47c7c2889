"""What the gait knows about its own health, and what it has to say about it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from nao_lipm_gait.ros.tick_statistics import TickSummary
from nao_lipm_gait.signals import GaitState, GaitStatus

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
