"""The suite `speed`: 20 s at speed in every task, closed and open loop on the same robots."""

import math
import statistics
from collections.abc import Sequence

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, finite, loop_name, number, table
from gait_lab.bench.score import Pick, Score, walk_all
from gait_lab.metrics import FLIGHT_LIMIT, SLIP_LIMIT
from gait_lab.tasks import AXES

SUITE = "speed"
PAPER_SPEED = {"forward": 31.0, "back": 22.0, "side": 12.0, "turn": 92.0}
"""Top speeds of the paper's robot [cm/s, deg/s]."""
PAPER_COM_ERROR = {"spot": 4.26, "forward": 7.76}
"""Mean |CoM y error| of the paper, expected against measured [mm]; forward at its top speed."""


def speed(options: BenchOptions) -> Report:
    """20 s at speed in every task, closed and open loop on the same robots."""
    (scores,) = walk_all(options)
    rows = [row for score in scores for row in _rows(score)]
    return Report(tuple(rows), _text(scores, options))


def _rows(score: Score) -> list[Row]:
    name, suite = score.name, SUITE
    counts = not score.faults
    paper = PAPER_SPEED.get(score.task.name)
    rows = []
    if score.task.axis:
        speeds = score.speeds
        for statistic, summary in (("worst", min), ("median", statistics.median)):
            value = float(summary(speeds)) if speeds else None
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
        "task", "loop", "upright", "asked", "worst", "median", "unit", "paper", "drift", "flight",
        "slip", "contact", "CoM y", "(meas)", "sat.", "",
    )  # fmt: skip
    units = (
        "", "", "", "", "", "", "", "", "deg/s", "%", "cm/s", "ticks", "mm", "mm", "%", "",
    )  # fmt: skip
    lines: list[tuple[str, ...]] = [header, units]
    for score in scores:
        axis, speeds = score.task.axis, score.speeds
        turn = axis == "yaw"
        lines.append(
            (
                score.task.name,
                loop_name(score.closed_loop),
                score.upright_text,
                number(abs(score.task.asked) * AXES[axis][1]) if axis else "",
                number(min(speeds)) if speeds else "-",
                number(statistics.median(speeds)) if speeds else "-",
                score.unit,
                number(PAPER_SPEED.get(score.task.name, math.nan), 0),
                "" if turn else number(score.over(max, "turn_rate", math.degrees(1.0))),
                number(score.over(max, "flight_share", 100.0)),
                number(score.over(max, "slip_speed", 100.0)),
                number(score.over(max, "contact_ticks"), 0),
                number(score.over(statistics.fmean, "com_error_y", 1000.0)),
                number(score.over(statistics.fmean, "com_error_y_measured", 1000.0)),
                number(score.over(max, "saturated_share", 100.0), 0),
                f"x {', '.join(score.faults)}" if score.faults else "",
            )
        )
    title = f"{options.window:g} s at speed, {options.title}"
    notes = (
        "Speeds in the torso's own heading, of the robots that stayed upright. Drift, flight,",
        "slip, contact and saturation: the worst robot. CoM y: mean |expected - true| (meas:",
        "- measured).",
        f"x = does not count: a fall, flight over {FLIGHT_LIMIT:.0%}, slip over "
        f"{SLIP_LIMIT * 100:g} cm/s, or leg against leg.",
    )
    return "\n".join((title, "", table(lines), "", *notes))
