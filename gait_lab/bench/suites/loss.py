"""The suite `loss`: a long walk during which messages are lost in both directions, or late."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, finite
from gait_lab.bench.score import tasks_of
from gait_lab.bench.suite import Suite
from gait_lab.bench.suites.faults import fault_run
from gait_lab.faults.long_walks import LossResult, LossWalk, walk_with_loss
from robot_core.errors import NaoGaitError
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.tasks import Task


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `loss` runs on."""

    robots: int = 20
    window: float = 60.0
    engine: str = "mujoco"
    tasks: tuple[str, ...] = ("forward=20",)
    loss: float = option(
        10.0, "share of all messages that are lost, in %", "P", minimum=0.0, maximum=100.0
    )
    wander: float = option(
        0.0, "the age of the sensors wanders by up to this, in ms", "MS", minimum=0.0, maximum=200.0
    )
    coast: bool = option(True, "the gait does not walk on without sensors", flags=("--no-coast",))


def check(options: Options) -> None:
    """Raise NaoGaitError for a task that is not straight ahead."""
    for task in tasks_of(options):
        if task.command.y != 0.0 or task.command.yaw != 0.0 or task.command.x <= 0.0:
            raise NaoGaitError("task", task.name, "forward walks for suite loss, e.g. forward=20")


def loss(options: Options) -> SuiteResult:
    """Every robot walks for the window of the options."""
    rows: list[Measurement] = []
    lines = []
    notes = ["Speeds of the robots that stayed upright; flight and slip are not checked."]
    settings = "measures the age of its sensors (`sensor_age`)"
    if options.coast:
        settings += " and walks on while they are missing (`coast`)"
    notes.append(f"The gait {settings}: off by default in the node.")
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
        notes += _evidence(found)
        name = f"{task.name}_{options.loss:g}"
        if options.wander > 0.0:
            name += f"_wander_{options.wander:g}"
        rows += [
            Measurement(f"{name}_upright", "robots", upright),
            Measurement(f"{name}_violations", "robots", violations),
            Measurement(f"{name}_worst", "cm/s", finite(worst)),
            Measurement(f"{name}_median", "cm/s", finite(median)),
        ]
        lines.append(
            (task.name, f"{options.loss:g}", f"{upright}/{len(found)}", 100.0 * task.asked, worst,
             median, violations)
        )  # fmt: skip
    columns = (
        Column("task"), Column("lost", "%"), Column("upright"), Column("commanded", "cm/s"),
        Column("worst", "cm/s"), Column("median", "cm/s"), Column("violations"),
    )  # fmt: skip
    title = (
        ("Sensor messages, velocity commands and joint commands are lost all the time; "
         if options.loss > 0.0 else "")
        + (f"sensors are up to {options.wander:g} ms later; " if options.wander > 0.0 else "")
        + ("" if options.coast else "the gait does not walk on without sensors; ")
        + f"{options.window:g} s, {options.title}"
    )
    return SuiteResult(tuple(rows), title, (Table(columns, lines),), tuple(notes))


def _walks(options: Options, task: Task) -> list[LossWalk]:
    share, speed, wander = options.loss / 100.0, task.command.x, options.wander / 1000.0
    return [
        LossWalk(
            fault_run(options, "loss", seed), share, speed, options.window, wander, options.coast
        )
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


SUITE = Suite(
    name="loss",
    title="Lost messages",
    summary="a long walk during which a share of all messages is lost",
    measure=loss,
    options=Options,
    takes=("robots", "tasks", "window"),
    quick=({"robots": 2, "window": 10.0},),
    check=check,
)
