"""The tables of a report, as rows of text."""

import math
from dataclasses import dataclass

import numpy as np

from gait_lab.report.analysis import Analysis


@dataclass(frozen=True, slots=True)
class TextTable:
    identity: str
    title: str
    note: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def number(value: float | None, digits: int = 1) -> str:
    """A dash for what was not measured."""
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text.replace("-", "−") if float(text) else text.lstrip("-")


def stretch_table(analysis: Analysis) -> TextTable | None:
    if not analysis.stretches:
        return None
    rows = []
    for stretch in analysis.stretches:
        m, command = stretch.metrics, stretch.command
        asked = ("–",) * 3 if command is None else (
            number(100 * command.x), number(100 * command.y), number(math.degrees(command.yaw)))
        rows.append(
            (
                stretch.name, f"{stretch.start:.1f}–{stretch.end:.1f}", *asked,
                number(100 * m.speed_x), number(100 * m.speed_y),
                number(math.degrees(m.turn_rate)),
                number(None if stretch.reached is None else 100 * stretch.reached, 0),
                number(1e3 * m.com_error_y_measured), number(1e3 * m.com_error_y),
                number(100 * m.flight_share),
            )
        )  # fmt: skip
    source = "ground truth" if len(analysis.walk.truth) else "odometry"
    return TextTable(
        "stretches", "Commanded and achieved",
        f"Every command that was held, measured from 2.5 s after its change as `nao_gait bench` "
        f"measures ({source}, torso's own heading). CoM: mean |expected − measured| and "
        "|expected − true| in y.",
        ("", "time [s]", "asked x [cm/s]", "y [cm/s]", "turn [°/s]", "got x [cm/s]", "y [cm/s]",
         "turn [°/s]", "reached [%]", "CoM y [mm]", "to truth [mm]", "flight [%]"),
        tuple(rows),
    )  # fmt: skip


def joint_table(analysis: Analysis) -> TextTable | None:
    if analysis.motors is None:
        return None
    rows = tuple(
        (
            joint.name,
            number(math.degrees(joint.tracking), 2),
            number(1e3 * joint.lag, 0),
            number(100 * joint.torque_share, 0),
            number(100 * joint.torque_saturated),
            number(100 * joint.speed_share, 0),
            number(100 * joint.speed_saturated),
        )
        for joint in analysis.motors.joints
    )
    return TextTable(
        "jointtable", "Joints in numbers",
        "Error: RMS of target and angle with the lag taken out. Torque: of a nominal motor of the "
        "reference plant at its speed; over 100 % brakes, or is a stronger robot.",
        ("joint", "error [°]", "lag [ms]", "most torque [%]", "at torque limit [% of ticks]",
         "top speed [% of limit]", "target too fast [% of ticks]"),
        rows,
    )  # fmt: skip


def key_numbers(analysis: Analysis) -> list[tuple[str, str, str]]:
    """(name, value, unit) of the numbers at the top; those that are known."""
    found: list[tuple[str, float | None, int, str]] = []
    metrics, paths = analysis.walking, analysis.paths
    found.append(("recorded", analysis.walk.duration, 1, "s"))
    if paths is not None:
        found.append(("walked", paths.length, 1, "m"))
    if analysis.steps:
        found.append(("steps", len(analysis.steps), 0, ""))
        durations = [step.duration for step in analysis.steps]
        found.append(("step duration", float(np.median(durations)), 2, "s"))
    forward = [s.metrics.speed_x for s in analysis.stretches if np.isfinite(s.metrics.speed_x)]
    if forward:
        fastest = max(forward, key=abs)
        found.append(("fastest along x", 100 * fastest, 1, "cm/s"))
    if metrics is not None:
        found.append(("CoM error y", 1e3 * metrics.com_error_y_measured, 1, "mm"))
        found.append(("CoM error x", 1e3 * metrics.com_error_x_measured, 1, "mm"))
        found.append(("flight", 100 * metrics.flight_share, 1, "%"))
    if analysis.motors is not None:
        found.append(("at a torque limit", 100 * analysis.motors.saturated_share, 1, "%"))
    if analysis.timing is not None:
        found.append(("sensor age", 1e3 * analysis.timing.age, 0, "ms"))
        found.append(("missing sensors", analysis.timing.missed, 0, ""))
    return [
        (name, number(value, digits), unit)
        for name, value, digits, unit in found
        if value is not None and math.isfinite(value)
    ]
