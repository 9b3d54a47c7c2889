"""The health of the gait, once a second."""

from collections.abc import Mapping
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from nao_lipm_gait.ros.messages import to_time
from nao_lipm_gait.ros.tick_statistics import TickSummary
from nao_lipm_gait.signals import GaitState, GaitStatus

SILENCE = 0.5
"""[s] without sensors that is worth an error."""


@dataclass(frozen=True, slots=True)
class Health:
    """What the node knows about itself at the end of a second."""

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
    status: GaitStatus | None


def diagnostics(node: str, hardware: str, health: Health, new_faults: bool) -> DiagnosticArray:
    """One status for the sensors and one for the walk."""
    array = DiagnosticArray()
    if health.status is not None:
        array.header.stamp = to_time(health.status.stamp)
    array.status = [
        _sensors(node, hardware, health),
        _walk(node, hardware, health, new_faults),
    ]
    return array


def _sensors(node: str, hardware: str, health: Health) -> DiagnosticStatus:
    level, message = DiagnosticStatus.OK, "sensors arrive"
    if health.sensor_age is None:
        level, message = DiagnosticStatus.STALE, "no joint_states so far"
    elif health.sensor_age > SILENCE:
        level, message = DiagnosticStatus.ERROR, f"no joint_states for {health.sensor_age:.1f} s"
    values = {
        "sensor age [s]": "" if health.sensor_age is None else f"{health.sensor_age:.3f}",
        "missed ticks": str(health.missed_ticks),
        **{f"rejected {topic}": str(count) for topic, count in health.rejected.items()},
    }
    return _status(level, f"{node}: sensors", message, hardware, values)


def _walk(
    node: str, hardware: str, health: Health, new_faults: bool
) -> DiagnosticStatus:
    status, ticks = health.status, health.ticks
    if status is None:
        return _status(DiagnosticStatus.STALE, f"{node}: walk", "no tick so far", hardware, {})
    level, message = DiagnosticStatus.OK, status.state.value
    if status.state is GaitState.FALLEN:
        level = DiagnosticStatus.ERROR
    elif new_faults:
        level, message = DiagnosticStatus.ERROR, f"{status.state.value}, targets held or cut"
    elif status.ik_residual > 1e-3 or status.clipped_joints:
        level, message = DiagnosticStatus.WARN, f"{status.state.value}, target out of reach"
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
        "observer innovation x [mm]": f"{innovation[0] * 1e3:.2f}",
        "observer innovation y [mm]": f"{innovation[1] * 1e3:.2f}",
        "IK residual [mm]": f"{status.ik_residual * 1e3:.3f}",
        "clipped joints": str(status.clipped_joints),
        "torso roll [rad]": f"{status.torso_roll:.4f}",
        "torso pitch [rad]": f"{status.torso_pitch:.4f}",
        "faults": str(health.faults),
    }
    return _status(level, f"{node}: walk", message, hardware, values)


def _status(
    level: bytes, name: str, message: str, hardware: str, values: Mapping[str, str]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id=hardware,
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
