"""The suite `error`: how far the CoM is from where the model expects it, and the speed of that run.

Two errors: expected against ground truth, and the paper's own, expected against measured. A gait
that trusts its sensors more lowers the second alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.published import PAPER_COM_ERROR
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, finite, loop_name
from gait_lab.bench.score import RULES, LoopDetection, Score, labelled_tasks, walk_all
from gait_lab.bench.suite import Suite

ERRORS = {
    "com_y_error": "com_error_y",
    "com_y_error_measured": "com_error_y_measured",
    "com_x_error": "com_error_x",
    "com_x_error_measured": "com_error_x_measured",
}
"""Metric -> attribute of `Metrics`."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `error` runs on."""

    tasks: tuple[str, ...] = ("spot", "forward=10", "forward")


def error(options: Options) -> SuiteResult:
    """Walk each task and compare the CoM."""
    (scores,) = walk_all(options, tasks=labelled_tasks(options))
    detection = LoopDetection(scores)
    notes = (
        "Mean over the robots of the mean |expected - true| CoM in Q, and of |expected - measured| "
        "as the paper has it; the paper's at its own speeds (0, 10 and 31 cm/s).",
        RULES,
        *detection.notes,
    )
    rows = [row for score in scores for row in _rows(score)] + detection.rows
    title = f"CoM error over {options.window:g} s at speed, {options.title}"
    return SuiteResult(tuple(rows), title, (_table(scores),), notes)


def _rows(score: Score) -> list[Measurement]:
    paper = PAPER_COM_ERROR.get(score.task.name)
    rows = [Measurement(f"{score.name}_upright", "robots", score.upright)]
    for metric, attribute in ERRORS.items():
        beside = paper if metric.startswith("com_y") else None
        name = f"{score.name}_{metric}"
        mean, worst = score.mean_of(attribute, 1000.0), score.worst_of(attribute, 1000.0)
        rows.append(Measurement(f"{name}_mean", "mm", finite(mean), beside))
        rows.append(Measurement(f"{name}_worst", "mm", finite(worst), beside))
    if score.task.axis:
        rows += score.speed_rows(f"{score.name}_speed")
    return rows


def _table(scores: Sequence[Score]) -> Table:
    columns = (
        Column("task"), Column("loop"), Column("upright"), Column("commanded", "cm/s"),
        Column("speed", "median"), Column("", "worst"), Column("y, true", "mm", 2),
        Column("worst", "", 2), Column("y, meas.", "mm", 2), Column("paper", "mm", 2),
        Column("x, true", "mm", 2), Column("x, meas.", "mm", 2), Column(""),
    )  # fmt: skip
    rows = [
        (
            score.task.name.replace("_", " "), loop_name(score.closed_loop), score.upright_text,
            score.asked_cell, score.median if score.speeds else "",
            score.worst if score.speeds else "", score.mean_of("com_error_y", 1000.0),
            score.worst_of("com_error_y", 1000.0), score.mean_of("com_error_y_measured", 1000.0),
            PAPER_COM_ERROR.get(score.task.name, math.nan), score.mean_of("com_error_x", 1000.0),
            score.mean_of("com_error_x_measured", 1000.0), score.mark,
        )
        for score in scores
    ]  # fmt: skip
    return Table(columns, rows)


SUITE = Suite(
    name="error",
    title="Error of the centre of mass",
    summary="CoM as expected against the true and the measured one, with the speed of the same run",
    measure=error,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop", "control_period"),
    quick=({"robots": 3, "window": 5.0},),
)
