"""The suite `ablation`: the gait with one extension changed at a time, in speed and under pushes.

What is changed is a list in YAML: `config/bench/ablation.yaml`, or a file of the same kind.
"""

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gait_lab.bench.changes import UNCHANGED, load_changes
from gait_lab.bench.falls import FallDetection
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.push_cells import Cell, push_cells
from gait_lab.bench.report import Report, Row, number, table
from gait_lab.bench.score import Score, Variant, tasks_of, walk_all
from gait_lab.trials.tasks import AXES, find_task

SUITE = "ablation"
PUSHES = (("left", 1.75), ("right", 1.75), ("forward", 2.5), ("back", 2.0))
"""Directions and impulses [N s] of the pushes on the spot."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How the robots walked and withstood pushes with one change."""

    name: str
    scores: tuple[Score, ...]
    cells: Mapping[tuple[str, float], Cell]
    detection: FallDetection
    """Over walks and pushes."""


def ablation(options: BenchOptions) -> Report:
    """The gait as it is and with every change, on the same robots."""
    changes = load_changes(options.changes)
    gaits = {UNCHANGED: options.parameters}
    gaits.update((change.name, change.parameters(options.parameters)) for change in changes)
    closed = replace(options, open_loop="off")
    tasks = [*tasks_of(options), find_task("spot").lasting(options.window)]
    variants = [Variant(parameters=gait.as_dict()) for gait in gaits.values()]
    walked = walk_all(closed, variants, tasks)
    outcomes = []
    for (name, gait), scores in zip(gaits.items(), walked, strict=True):
        pushed = push_cells(replace(closed, parameters=gait), "spot", PUSHES, label=name)
        for result in (result for score in scores for result in score.results):
            pushed.detection.add(result.metrics)
        outcomes.append(Outcome(name, tuple(scores), pushed.cells, pushed.detection))
    rows = [row for outcome in outcomes for row in _rows(outcome)]
    return Report(tuple(rows), _text(outcomes, options))


def _rows(outcome: Outcome) -> list[Row]:
    rows = []
    for score in outcome.scores:
        name = f"{outcome.name}_{score.task.name}"
        rows.append(Row(SUITE, f"{name}_upright", "robots", score.upright))
        rows.append(Row(SUITE, f"{name}_counts", "bool", float(not score.faults)))
        if score.task.axis:
            rows += score.speed_rows(SUITE, name, not score.faults)
        else:
            error = score.over(statistics.fmean, "com_error_y", 1000.0)
            rows.append(Row(SUITE, f"{name}_com_y_error_mean", "mm", error))
    for (direction, impulse), cell in outcome.cells.items():
        metric = f"{outcome.name}_push_{direction}_{impulse:g}_survival"
        rows.append(Row(SUITE, metric, "%", 100.0 * cell.share))
    return rows + outcome.detection.rows(SUITE, outcome.name)


def _text(outcomes: Sequence[Outcome], options: BenchOptions) -> str:
    header, units = ["gait"], [""]
    for score in outcomes[0].scores:
        if axis := score.task.axis:
            asked = abs(score.task.asked) * AXES[axis][1]
            header += [score.task.name, ""]
            units += ["upright", f"of {asked:.0f}"]
    header += ["spot", ""]
    units += ["upright", "mm"]
    for direction, impulse in PUSHES:
        header.append(direction)
        units.append(f"{impulse:g} N s")
    lines = [header, units]
    for outcome in outcomes:
        line = [outcome.name.replace("_", " ")]
        for score in outcome.scores:
            mark = "x" if score.upright < len(score.results) else "!" if score.faults else ""
            shown = score.median
            if not score.task.axis:
                shown = score.over(statistics.fmean, "com_error_y", 1000.0)
            line += [f"{mark}{score.upright_text}", number(shown)]
        line += [f"{100.0 * cell.share:.0f}%" for cell in outcome.cells.values()]
        lines.append(line)
    pushes = options.robots * options.phases
    title = f"One change at a time, {options.window:g} s at speed, {options.title}"
    notes = (
        "Median speed [cm/s, deg/s] of the robots that stayed upright, beside the asked one; spot:",
        "mean |expected - true| CoM y. x: a robot fell; !: upright, but does not count (flight,",
        f"slip, leg against leg). Pushes on the spot: survivors of {pushes} per direction.",
    )
    detection = [
        f"{outcome.name.replace('_', ' ')}: {outcome.detection.text}" for outcome in outcomes
    ]
    return "\n".join((title, "", table(lines), "", *notes, "", "Fall detection", *detection))
