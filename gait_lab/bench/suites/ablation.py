"""The suite `ablation`: the gait with one extension changed at a time, in speed and under pushes.

The changes are a list in YAML: `config/bench/ablation.yaml`, or a file of the same kind.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gait_lab.bench.changes import UNCHANGED, load_changes
from gait_lab.bench.comparison import Contender, Outcome, compare
from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.score import tasks_of
from gait_lab.bench.suite import Suite
from sim_bridge.trials.tasks import find_task

PUSHES = (("left", 1.75), ("right", 1.75), ("forward", 2.5), ("back", 2.0))
"""Directions and impulses [N s] of the pushes on the spot."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `ablation` runs on."""

    robots: int = 5
    window: float = 8.0
    open_loop: str = "off"
    changes: Path | None = option(
        None, "YAML list of changes (config/bench/ablation.yaml)", "FILE", parse=Path
    )


def ablation(options: Options) -> SuiteResult:
    """The gait as it is and with every change, on the same robots."""
    gaits = [Contender(UNCHANGED, options.parameters)]
    gaits += [Contender(change.name, change.parameters(options.parameters))
              for change in load_changes(options.changes)]  # fmt: skip
    tasks = [*tasks_of(options), find_task("spot").lasting(options.window)]
    outcomes = compare(replace(options, open_loop="off"), gaits, tasks, PUSHES)
    pushes = options.robots * options.phases
    notes = (
        "Median speed [cm/s, deg/s] of the robots that stayed upright, beside the commanded one; "
        "spot: mean |expected - true| CoM y. x: a robot fell; !: upright, but does not count "
        f"(flight, slip, contact of the legs). Pushes on the spot: survivors of {pushes} per "
        "direction.",
        *(each.detection.note(each.name.replace("_", " ")) for each in outcomes),
    )
    return SuiteResult(
        tuple(row for each in outcomes for row in _rows(each)),
        f"One change at a time, {options.window:g} s at speed, {options.title}",
        (_table(outcomes),), notes,
    )  # fmt: skip


def _rows(outcome: Outcome) -> list[Measurement]:
    rows = []
    for score in outcome.scores:
        name = f"{outcome.name}_{score.task.name}"
        rows.append(Measurement(f"{name}_upright", "robots", score.upright))
        rows.append(Measurement(f"{name}_counts", "bool", float(not score.faults)))
        if score.task.axis:
            rows += score.speed_rows(name)
        else:
            error = score.mean_of("com_error_y", 1000.0)
            rows.append(Measurement(f"{name}_com_y_error_mean", "mm", error))
    return rows + outcome.push_rows + outcome.detection.rows(outcome.name)


def _table(outcomes: Sequence[Outcome]) -> Table:
    columns = [Column("gait")]
    for score in outcomes[0].scores:
        unit = "mm" if score.asked is None else f"of {score.asked:.0f}"
        columns += [Column(score.task.name, "upright"), Column("", unit)]
    columns += [Column(direction, f"{impulse:g} N s") for direction, impulse in PUSHES]
    rows = []
    for outcome in outcomes:
        row: list[TableCell] = [outcome.name.replace("_", " ")]
        for score in outcome.scores:
            value = score.median if score.task.axis else score.mean_of("com_error_y", 1000.0)
            row += [f"{score.short_mark}{score.upright_text}", value]
        rows.append([*row, *outcome.push_cells])
    return Table(columns, rows)


SUITE = Suite(
    name="ablation",
    title="One extension of the gait at a time",
    summary="the gait with one extension switched off at a time",
    measure=ablation,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop", "phases"),
    quick=({"robots": 2, "window": 4.0, "phases": 2},),
    check=lambda options: load_changes(options.changes),
)
