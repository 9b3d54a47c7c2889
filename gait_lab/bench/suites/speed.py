"""The suite `speed`: 20 s at speed in every task, closed and open loop on the same robots."""

import math
import statistics
from collections.abc import Sequence

from gait_lab.bench.anchors import NAO_SPEED, PAPER_COM_ERROR, PAPER_SPEED, placo_speed
from gait_lab.bench.falls import by_loop, rows_by_loop, text_by_loop
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, finite, loop_name, number, table
from gait_lab.bench.score import RULES, Pick, Score, tasks_of, walk_all
from gait_lab.trials.tasks import AXES

SUITE = "speed"
HALF_WINDOW = 10.0
"""Longest measured window at half speed [s]."""


def speed(options: BenchOptions) -> Report:
    """At speed and at half of it, on the same robots."""
    full = tasks_of(options)
    halves = [
        task.scaled(0.5, f"{task.name}_half").lasting(min(options.window, HALF_WINDOW))
        for task in full if task.axis and options.half_speed
    ]  # fmt: skip
    (scores,) = walk_all(options, tasks=[*full, *halves])
    names = {task.name for task in halves}
    at_half = [score for score in scores if score.task.name in names]
    at_speed = [score for score in scores if score.task.name not in names]
    rows = [row for score in at_speed for row in _rows(score)]
    rows += [row for score in at_half for row in _half_rows(score)]
    found = by_loop(scores)
    rows += rows_by_loop(SUITE, found)
    parts = [_text(at_speed, options)]
    if at_half:
        parts.append(_half_text(at_half, options))
    parts.append(text_by_loop(found))
    return Report(tuple(rows), "\n\n".join(parts))


def deviations(score: Score) -> list[float]:
    """|achieved - commanded| of each robot that stayed upright, in percent of the commanded."""
    asked = abs(score.task.asked) * AXES[score.task.axis][1] if score.task.axis else math.nan
    return [100.0 * abs(achieved / asked - 1.0) for achieved in score.speeds]


def _half_rows(score: Score) -> list[Row]:
    off, counts = deviations(score), not score.faults
    rows = [Row(SUITE, f"{score.name}_upright", "robots", score.upright)]
    for statistic, summary in (("worst", max), ("median", statistics.median)):
        value = float(summary(off)) if off else None
        rows.append(Row(SUITE, f"{score.name}_error_{statistic}", "%", value if counts else None))
    rows.append(Row(SUITE, f"{score.name}_median", score.unit, score.median if counts else None))
    return rows


def _half_text(scores: Sequence[Score], options: BenchOptions) -> str:
    lines: list[tuple[str, ...]] = [
        ("half speed", "loop", "upright", "asked", "median", "unit", "off, median", "off, worst",
         ""),
        ("", "", "", "", "", "", "%", "%", ""),
    ]
    for score in scores:
        off = deviations(score)
        lines.append(
            (
                score.task.name.removesuffix("_half"),
                loop_name(score.closed_loop),
                score.upright_text,
                number(abs(score.task.asked) * AXES[score.task.axis or "x"][1]),
                number(score.median),
                score.unit,
                number(statistics.median(off)) if off else "-",
                number(max(off)) if off else "-",
                score.mark,
            )
        )
    note = "off: |achieved - asked| in percent of the asked, of the robots that stayed upright."
    return f"{table(lines)}\n\n{note}"


def _rows(score: Score) -> list[Row]:
    name, suite = score.name, SUITE
    counts = not score.faults
    paper = PAPER_SPEED.get(score.task.name)
    rows = []
    if score.task.axis:
        for statistic, value in (("worst", score.worst), ("median", score.median)):
            rows.append(
                Row(suite, f"{name}_{statistic}", score.unit, value if counts else None, paper)
            )
            rows.append(Row(suite, f"{name}_{statistic}_of_upright", score.unit, value, paper))
    rows.append(Row(suite, f"{name}_upright", "robots", score.upright))
    rows.append(Row(suite, f"{name}_counts", "bool", float(counts)))
    error = PAPER_COM_ERROR.get(score.task.name)
    average: Pick = statistics.fmean
    highest: Pick = max
    quantities: tuple[tuple[str, str, Pick, str, float, float | None], ...] = (
        ("yaw_drift_worst", "deg/s", highest, "turn_rate", math.degrees(1.0), None),
        ("flight_worst", "%", highest, "flight_share", 100.0, None),
        ("slip_worst", "cm/s", highest, "slip_speed", 100.0, None),
        ("contact_ticks_worst", "ticks", highest, "contact_ticks", 1.0, None),
        ("com_y_error_mean", "mm", average, "com_error_y", 1000.0, error),
        ("com_y_error_measured_mean", "mm", average, "com_error_y_measured", 1000.0, error),
        ("com_x_error_mean", "mm", average, "com_error_x", 1000.0, None),
        ("saturated_worst", "%", highest, "saturated_share", 100.0, None),
    )  # fmt: skip
    for metric, unit, pick, attribute, factor, reference in quantities:
        if metric == "yaw_drift_worst" and score.task.axis == "yaw":
            continue
        value = finite(score.over(pick, attribute, factor))
        rows.append(Row(suite, f"{name}_{metric}", unit, value, reference))
    return rows


def _text(scores: Sequence[Score], options: BenchOptions) -> str:
    header = (
        "task", "loop", "upright", "asked", "worst", "median", "unit", "paper", "placo", "NAO",
        "drift", "flight", "slip", "contact", "CoM y", "(meas)", "sat.", "",
    )  # fmt: skip
    units = (
        "", "", "", "", "", "", "", "", "", "", "deg/s", "%", "cm/s", "ticks", "mm", "mm", "%", "",
    )  # fmt: skip
    lines: list[tuple[str, ...]] = [header, units]
    for score in scores:
        turn, anchor = score.task.axis == "yaw", score.task.name
        lines.append(
            (
                score.task.name,
                loop_name(score.closed_loop),
                score.upright_text,
                score.asked_text,
                number(score.worst),
                number(score.median),
                score.unit,
                _cell(PAPER_SPEED.get(anchor)),
                placo_speed(anchor),
                _cell(NAO_SPEED.get(anchor)),
                "" if turn else number(score.over(max, "turn_rate", math.degrees(1.0))),
                number(score.over(max, "flight_share", 100.0)),
                number(score.over(max, "slip_speed", 100.0)),
                number(score.over(max, "contact_ticks"), 0),
                number(score.over(statistics.fmean, "com_error_y", 1000.0)),
                number(score.over(statistics.fmean, "com_error_y_measured", 1000.0)),
                number(score.over(max, "saturated_share", 100.0), 0),
                score.mark,
            )
        )
    title = f"{options.window:g} s at speed, {options.title}"
    notes = (
        "Speeds in the torso's own heading, of the robots that stayed upright. Drift, flight,",
        "slip, contact and saturation: the worst robot. CoM y: mean |expected - true| (meas:",
        "- measured). paper, placo, NAO: what others reach, on robots and plants of their own.",
        f"{RULES} Slip is that of the centre of pressure: a",
        "sole that pivots about it does not slip, but shows as drift, or as a turn that is lost.",
    )
    return "\n".join((title, "", table(lines), "", *notes))


def _cell(speed: float | None) -> str:
    return "" if speed is None else f"{speed:.0f}"
