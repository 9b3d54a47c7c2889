"""The suite `loss`: a long walk on which messages are lost in both directions."""

import math
import statistics
from collections.abc import Sequence

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, finite, number, table
from gait_lab.bench.score import tasks_of
from gait_lab.bench.suites.faults import fault_run
from gait_lab.faults.long_walks import LossResult, LossWalk, walk_with_loss
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.tasks import Task
from nao_lipm_gait.errors import NaoGaitError

SUITE = "loss"
TASKS = ("forward=20",)
NOTE = "Speeds of the robots that stayed upright; flight and slip are not looked at."


def check(options: BenchOptions) -> None:
    """NaoGaitError for a way that is not straight ahead: the suite knows no other."""
    for task in tasks_of(options):
        if task.command.y != 0.0 or task.command.yaw != 0.0 or task.command.x <= 0.0:
            raise NaoGaitError("task", task.name, "forward walks for the suite loss, as forward=20")


def loss(options: BenchOptions) -> Report:
    """Every robot walks for the window of the options."""
    rows: list[Row] = []
    lines: list[tuple[str, ...]] = [
        ("task", "lost", "upright", "asked", "worst", "median", "violations"),
        ("", "%", "", "cm/s", "cm/s", "cm/s", ""),
    ]
    told: list[str] = []
    for task in tasks_of(options):
        found = parallel_map(
            walk_with_loss, _walks(options, task), jobs=options.jobs, show=options.show,
            label=task.name, note=_note,
        )  # fmt: skip
        speeds = [100.0 * each.speed for each in found if math.isfinite(each.speed)]
        worst = min(speeds, default=math.nan)
        median = statistics.median(speeds) if speeds else math.nan
        upright = sum(each.fell_at is None for each in found)
        violations = sum(bool(each.violations) for each in found)
        told += _evidence(found)
        name = f"{task.name}_{options.loss:g}"
        rows += [
            Row(SUITE, f"{name}_upright", "robots", upright),
            Row(SUITE, f"{name}_violations", "robots", violations),
            Row(SUITE, f"{name}_worst", "cm/s", finite(worst)),
            Row(SUITE, f"{name}_median", "cm/s", finite(median)),
        ]
        lines.append(
            (task.name, f"{options.loss:g}", f"{upright}/{len(found)}",
             number(100.0 * task.asked), number(worst), number(median), str(violations))
        )  # fmt: skip
    title = (
        f"Sensor messages, velocity and joint commands are lost all the time; {options.window:g} s,"
        f" {options.title}"
    )
    return Report(tuple(rows), "\n".join((title, "", table(lines), "", NOTE, *told)))


def _walks(options: BenchOptions, task: Task) -> list[LossWalk]:
    share, speed = options.loss / 100.0, task.command.x
    return [
        LossWalk(fault_run(options, "loss", seed), share, speed, options.window)
        for seed in options.seeds
    ]


def _evidence(found: Sequence[LossResult]) -> list[str]:
    falls = [
        f"robot {each.walk.run.seed} fell at {each.fell_at:.1f} s"
        for each in found if each.fell_at is not None
    ]  # fmt: skip
    broken = [
        f"VIOLATED robot {each.walk.run.seed}: {'; '.join(each.violations)}"
        for each in found if each.violations
    ]  # fmt: skip
    return falls + broken


def _note(verdict: LossResult) -> str:
    fate = "upright" if verdict.fell_at is None else f"fell at {verdict.fell_at:.1f} s"
    return f"robot {verdict.walk.run.seed}: {fate}"
