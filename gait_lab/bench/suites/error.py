"""The suite `error`: how far the CoM is from where the model has it, and the speed of the same run.

Two errors: expected against ground truth, and the paper's own, expected against measured. A gait
that trusts its sensors more lowers the second alone.
"""

import math
import statistics
from collections.abc import Sequence

from gait_lab.bench.anchors import PAPER_COM_ERROR
from gait_lab.bench.falls import by_loop, rows_by_loop, text_by_loop
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, finite, loop_name, number, table
from gait_lab.bench.score import RULES, Score, labelled_tasks, walk_all

SUITE = "error"
TASKS = ("spot", "forward=10", "forward")
ERRORS = {
    "com_y_error": "com_error_y",
    "com_y_error_measured": "com_error_y_measured",
    "com_x_error": "com_error_x",
    "com_x_error_measured": "com_error_x_measured",
}
"""Metric -> attribute of `Metrics`."""


def error(options: BenchOptions) -> Report:
    """Walk each task and compare the CoM."""
    tasks = labelled_tasks(options)
    (scores,) = walk_all(options, tasks=tasks)
    found = by_loop(scores)
    rows = [row for score in scores for row in _rows(score)] + rows_by_loop(SUITE, found)
    return Report(tuple(rows), f"{_text(scores, options)}\n{text_by_loop(found)}")


def _rows(score: Score) -> list[Row]:
    paper = PAPER_COM_ERROR.get(score.task.name)
    rows = [Row(SUITE, f"{score.name}_upright", "robots", score.upright)]
    for metric, attribute in ERRORS.items():
        beside = paper if metric.startswith("com_y") else None
        for statistic, pick in (("mean", statistics.fmean), ("worst", max)):
            value = finite(score.over(pick, attribute, 1000.0))
            rows.append(Row(SUITE, f"{score.name}_{metric}_{statistic}", "mm", value, beside))
    if score.task.axis:
        rows += score.speed_rows(SUITE, f"{score.name}_speed", not score.faults)
    return rows


def _text(scores: Sequence[Score], options: BenchOptions) -> str:
    lines: list[tuple[str, ...]] = [
        ("task", "loop", "upright", "asked", "speed", "worst", "y, true", "worst", "y, meas.",
         "paper", "x, true", "x, meas.", ""),
        ("", "", "", "cm/s", "median", "", "mm", "", "mm", "mm", "mm", "mm", ""),
    ]  # fmt: skip
    for score in scores:
        lines.append(
            (
                score.task.name.replace("_", " "),
                loop_name(score.closed_loop),
                score.upright_text,
                score.asked_text,
                number(score.median) if score.speeds else "",
                number(score.worst) if score.speeds else "",
                number(score.over(statistics.fmean, "com_error_y", 1000.0), 2),
                number(score.over(max, "com_error_y", 1000.0), 2),
                number(score.over(statistics.fmean, "com_error_y_measured", 1000.0), 2),
                number(PAPER_COM_ERROR.get(score.task.name, math.nan), 2),
                number(score.over(statistics.fmean, "com_error_x", 1000.0), 2),
                number(score.over(statistics.fmean, "com_error_x_measured", 1000.0), 2),
                score.mark,
            )
        )
    title = f"CoM error over {options.window:g} s at speed, {options.title}"
    notes = (
        "Mean over the robots of the mean |expected - true| CoM in Q, and |expected - measured| as",
        "the paper has it; the paper's at its own speeds (0, 10 and 31 cm/s).",
        RULES,
    )
    return "\n".join((title, "", table(lines), "", *notes))
