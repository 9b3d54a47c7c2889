"""The suite `speed`: every task at full and at half speed, closed and open loop."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.published import (
    NAO_SPEED,
    PAPER_COM_ERROR,
    PAPER_SPEED,
    PUBLISHED_NOTE,
    placo_speed,
    speed_cell,
)
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, finite, loop_name
from gait_lab.bench.score import RULES, LoopDetection, Score, tasks_of, walk_all
from gait_lab.bench.suite import Suite

HALF_WINDOW = 10.0
"""[s] longest measured window at half speed."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `speed` runs on."""

    half_speed: bool = option(True, "not also at half of each speed", flags=("--no-half",))


def speed(options: Options) -> SuiteResult:
    """Walk at the commanded speeds and at half of them, on the same robots."""
    full = tasks_of(options)
    halves = [
        task.scaled(0.5, f"{task.name}_half").lasting(min(options.window, HALF_WINDOW))
        for task in full if task.axis and options.half_speed
    ]  # fmt: skip
    (scores,) = walk_all(options, tasks=[*full, *halves])
    names = {task.name for task in halves}
    at_half = [score for score in scores if score.task.name in names]
    at_speed = [score for score in scores if score.task.name not in names]
    detection = LoopDetection(scores)
    rows = [row for score in at_speed for row in full_speed_rows(score)]
    rows += [row for score in at_half for row in half_speed_rows(score)]
    notes = [
        "Speeds in the torso's own heading, of the robots that stayed upright. Drift, flight, "
        "slip, contact and saturation: of the worst robot. Drift: mean yaw rate where none is "
        "commanded; contact: ticks of 10 ms in which the legs touch; sat.: share of ticks in which "
        "a motor is at its torque limit. CoM y: mean |expected - true| (meas: "
        "|expected - measured|).",
        PUBLISHED_NOTE,
        f"{RULES} Slip is that of the centre of pressure: a sole that pivots about it does not "
        "slip, but shows as drift, or as a turn that is lost.",
    ]
    tables = [_full_table(at_speed)]
    if at_half:
        tables.append(_half_table(at_half))
        notes.append(
            "Off, at half speed: |achieved - commanded| in percent of the commanded speed, of the "
            "robots that stayed upright."
        )
    return SuiteResult(
        (*rows, *detection.rows), f"{options.window:g} s at speed, {options.title}",
        tuple(tables), (*notes, *detection.notes),
    )  # fmt: skip


def deviations(score: Score) -> list[float]:
    """|achieved - commanded| [%] of the commanded speed, of each robot that stayed upright."""
    return [100.0 * abs(achieved / (score.asked or math.nan) - 1.0) for achieved in score.speeds]


def half_speed_rows(score: Score) -> list[Measurement]:
    """The measurements of one task at half speed."""
    off, counts = deviations(score), not score.faults
    rows = [Measurement(f"{score.name}_upright", "robots", score.upright)]
    for statistic, summary in (("worst", max), ("median", statistics.median)):
        value = float(summary(off)) if off and counts else None
        rows.append(Measurement(f"{score.name}_error_{statistic}", "%", value))
    median = score.median if counts else None
    return [*rows, Measurement(f"{score.name}_median", score.unit, median)]


def full_speed_rows(score: Score) -> list[Measurement]:
    """The measurements of one task at full speed."""
    name, counts = score.name, not score.faults
    paper, error = PAPER_SPEED.get(score.task.name), PAPER_COM_ERROR.get(score.task.name)
    rows = []
    if score.task.axis:
        for statistic, value in (("worst", score.worst), ("median", score.median)):
            metric = f"{name}_{statistic}"
            rows.append(Measurement(metric, score.unit, value if counts else None, paper))
            rows.append(Measurement(f"{metric}_of_upright", score.unit, value, paper))
    rows.append(Measurement(f"{name}_upright", "robots", score.upright))
    rows.append(Measurement(f"{name}_counts", "bool", float(counts)))
    drift = score.worst_of("turn_rate", math.degrees(1.0))
    if score.task.axis != "yaw":
        rows.append(Measurement(f"{name}_yaw_drift_worst", "deg/s", finite(drift)))
    quantities = (
        ("flight_worst", "%", score.worst_of("flight_share", 100.0), None),
        ("slip_worst", "cm/s", score.worst_of("slip_speed", 100.0), None),
        ("contact_ticks_worst", "ticks", score.worst_of("contact_ticks"), None),
        ("com_y_error_mean", "mm", score.mean_of("com_error_y", 1000.0), error),
        ("com_y_error_measured_mean", "mm", score.mean_of("com_error_y_measured", 1000.0), error),
        ("com_x_error_mean", "mm", score.mean_of("com_error_x", 1000.0), None),
        ("saturated_worst", "%", score.worst_of("saturated_share", 100.0), None),
    )
    rows += [Measurement(f"{name}_{metric}", unit, finite(value), reference)
             for metric, unit, value, reference in quantities]  # fmt: skip
    return rows


def _full_table(scores: Sequence[Score]) -> Table:
    columns = (
        Column("task"), Column("loop"), Column("upright"), Column("commanded"), Column("worst"),
        Column("median"), Column("unit"), Column("paper"), Column("placo"), Column("NAO"),
        Column("drift", "deg/s"), Column("flight", "%"), Column("slip", "cm/s"),
        Column("contact", "ticks", 0), Column("CoM y", "mm"), Column("meas.", "mm"),
        Column("sat.", "%", 0), Column(""),
    )  # fmt: skip
    rows = []
    for score in scores:
        name = score.task.name
        rows.append((
            name, loop_name(score.closed_loop), score.upright_text, score.asked_cell, score.worst,
            score.median, score.unit, speed_cell(PAPER_SPEED, name), placo_speed(name),
            speed_cell(NAO_SPEED, name),
            "" if score.task.axis == "yaw" else score.worst_of("turn_rate", math.degrees(1.0)),
            score.worst_of("flight_share", 100.0), score.worst_of("slip_speed", 100.0),
            score.worst_of("contact_ticks"), score.mean_of("com_error_y", 1000.0),
            score.mean_of("com_error_y_measured", 1000.0),
            score.worst_of("saturated_share", 100.0), score.mark,
        ))  # fmt: skip
    return Table(columns, rows)


def _half_table(scores: Sequence[Score]) -> Table:
    columns = (
        Column("half speed"), Column("loop"), Column("upright"), Column("commanded"),
        Column("median"), Column("unit"), Column("off, median", "%"), Column("off, worst", "%"),
        Column(""),
    )  # fmt: skip
    rows = []
    for score in scores:
        off = deviations(score)
        rows.append((
            score.task.name.removesuffix("_half"), loop_name(score.closed_loop), score.upright_text,
            score.asked_cell, score.median, score.unit,
            statistics.median(off) if off else None, max(off, default=None), score.mark,
        ))  # fmt: skip
    return Table(columns, rows)


SUITE = Suite(
    name="speed",
    title="Speed",
    summary="forward, back, side and turn at full and at half speed",
    measure=speed,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop", "control_period"),
    quick=({"robots": 3, "window": 5.0},),
)
