"""The suite `paper`: the results section of the first paper, measured on simulated robots.

The preset `paper` in closed and open loop, and the gait of the command beside it, walk at the
paper's speeds: on calibrated robots, as the paper's was, and on robots as they are drawn. Only for
the NAO: the preset is made for it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gait_lab.bench.comparison import Contender, Outcome, compare
from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.paper_figures import paper_figures
from gait_lab.bench.published import PAPER_COM_ERROR, PAPER_SPEED
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, finite
from gait_lab.bench.score import RULES, Score
from gait_lab.bench.suite import Suite
from gait_lab.bench.suites.peers import is_nao
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.robot import NAO, load_robot
from sim_bridge.trials.tasks import Task, find_task

NAMES = {"forward=10": "slow", "forward=20": "medium"}
"""Names of the slower walks; the others are named after their direction."""
ERRORS = {"spot": "spot", "slow": "slow", "forward": "full"}
"""Task -> its name among the CoM errors; the paper gives the error of these."""
PAPER_ERROR = {"spot": "spot", "slow": "forward_10", "full": "forward"}
"""The names of these errors in `PAPER_COM_ERROR`."""
PUSHES = (("left", 1.0), ("right", 1.0), ("forward", 2.0), ("back", 1.75))
"""Directions and impulses [N s] of the pushes on the spot."""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `paper` runs on."""

    robots: int = 20
    phases: int = 4
    tasks: tuple[str, ...] = (
        "spot", "forward=10", "forward=20", "forward=31.5", "back=23", "side=12.5", "turn=98",
    )  # fmt: skip
    drawn: str = option(
        "beside", "robots as drawn beside calibrated ones, off, or only", "MODE",
        flags=("--as-drawn",), choices=("beside", "off", "only"),
    )  # fmt: skip
    push: bool = option(True, "without pushes", flags=("--no-push",))
    out: Path | None = option(
        None, "write the paper's figures 4, 6 and 7 as PNG to this folder", "DIR", parse=Path
    )

    @property
    def conditions(self) -> dict[str, BenchOptions]:
        """Prefix of the metrics -> the robots: calibrated ones, and robots as drawn."""
        robots: dict[str, BenchOptions] = {}
        if self.drawn != "only":
            robots[""] = replace(self, calibrated=True)
        if self.drawn != "off":
            robots["drawn_"] = self
        return robots


def tasks_of(options: BenchOptions) -> list[Task]:
    """The walks over their window, each at most once."""
    tasks = [replace(find_task(text), name=NAMES.get(text, find_task(text).name))
             for text in options.tasks]  # fmt: skip
    names = [task.name for task in tasks]
    if len(set(names)) < len(names):
        raise NaoGaitError("task", ", ".join(options.tasks), "each direction at most once")
    return [task.lasting(options.window) for task in tasks]


def contenders(options: BenchOptions) -> list[Contender]:
    """The preset, its open loop, and the gait of the command."""
    paper = load_preset("paper")
    found = [Contender("paper", paper), Contender("paper_open_loop", paper.replace(feedback=False))]
    if options.open_loop == "off":
        del found[1]
    return [*found, Contender("default", options.parameters)]


def paper(options: Options) -> SuiteResult:
    """Walk and push the same robots with every gait."""
    tasks = tasks_of(options)
    found = {
        prefix: compare(robots, contenders(options), tasks, PUSHES if options.push else ())
        for prefix, robots in options.conditions.items()
    }
    rows, tables = [], []
    for prefix, outcomes in found.items():
        rows += [row for outcome in outcomes for row in outcome_rows(outcome, prefix)]
        tables += [
            _speeds(outcomes, prefix), _accuracy(outcomes, prefix), _errors(outcomes, prefix)
        ]
        tables += [_pushes(outcomes, prefix)] if options.push else []
    notes = [
        "published: the paper's figure of a real NAO; paper, paper open loop, default: presets on "
        "the simulated robots. Speeds in the torso's own heading, of the robots that stayed "
        "upright. Speed error: mean over them of |speed - commanded speed|; "
        "slip: of the worst robot. CoM y: mean over the robots of the mean |expected - measured| "
        "as in the paper, and of |expected - true|. Pushes: survivors of "
        f"{options.robots * options.phases} while stepping on the spot.",
        "as drawn: robots with joint zero errors, IMU mounting and sensor biases of the plant. "
        "calibrated: the same robots after they have measured, standing and stepping on the spot, "
        "the relative tilt of their soles, the IMU against them and the gyro's bias.",
        RULES,
    ]
    if options.out is not None:
        robots = next(iter(options.conditions.values()))
        written = paper_figures(replace(robots, parameters=load_preset("paper")), options.out)
        notes.append(f"Figures: {', '.join(map(str, written))}.")
    return SuiteResult(
        tuple(rows), f"The first paper's results, {options.window:g} s at speed, {options.title}",
        tuple(tables), tuple(notes),
    )  # fmt: skip


def outcome_rows(outcome: Outcome, prefix: str) -> list[Measurement]:
    """The measurements of one gait: `paper_forward_median`, `paper_drawn_com_error_spot`, ..."""
    base, rows = f"{outcome.name}_{prefix}", []
    for score in outcome.scores:
        task, counts = score.task.name, not score.faults
        rows.append(Measurement(f"{base}{task}_upright", "robots", score.upright))
        rows.append(Measurement(f"{base}{task}_counts", "bool", float(counts)))
        if score.task.axis:
            for statistic, value in (("worst", score.worst), ("median", score.median)):
                metric, published = f"{base}{task}_{statistic}", PAPER_SPEED.get(task)
                rows.append(Measurement(metric, score.unit, value if counts else None, published))
                rows.append(Measurement(f"{metric}_of_upright", score.unit, value, published))
            rows.append(Measurement(f"{base}{task}_speed_error", score.unit, score.speed_error))
        else:
            drift = finite(_drift(score))
            rows.append(Measurement(f"{base}{task}_drift_worst", "cm/s", drift))
        slip = finite(score.worst_of("slip_speed", 100.0))
        rows.append(Measurement(f"{base}{task}_slip_worst", "cm/s", slip))
        if task in ERRORS:
            name = ERRORS[task]
            for metric, attribute in (("com_error", "com_error_y_measured"),
                                      ("com_error_true", "com_error_y")):  # fmt: skip
                error = finite(score.mean_of(attribute, 1000.0))
                published = PAPER_COM_ERROR[PAPER_ERROR[name]]
                rows.append(Measurement(f"{base}{metric}_{name}", "mm", error, published))
    pushes = replace(outcome, name=base.rstrip("_")).push_rows
    return rows + pushes + outcome.detection.rows(base.rstrip("_"))


def _drift(score: Score) -> float:
    """Largest speed over ground [cm/s], where none is commanded."""
    return max(100.0 * math.hypot(result.metrics.speed_x, result.metrics.speed_y)
               for result in score.results)  # fmt: skip


def _kind(prefix: str) -> str:
    return "as drawn" if prefix else "calibrated"


def _speeds(outcomes: Sequence[Outcome], prefix: str) -> Table:
    columns = [Column(_kind(prefix)), Column("commanded"), Column("published")]
    for outcome in outcomes:
        columns += [Column(outcome.name.replace("_", " "), "upright"), Column("", "worst"),
                    Column("", "median"), Column("")]  # fmt: skip
    rows = []
    for scores in zip(*(outcome.scores for outcome in outcomes), strict=True):
        task = scores[0].task
        row: list[TableCell] = [
            f"{task.name} [{scores[0].unit}]" if task.axis else f"{task.name}, drift [cm/s]",
            scores[0].asked_cell, PAPER_SPEED.get(task.name, ""),
        ]  # fmt: skip
        for score in scores:
            row += [score.upright_text, *_speed_cells(score), score.mark]
        rows.append(row)
    return Table(columns, rows)


def _speed_cells(score: Score) -> tuple[TableCell, TableCell]:
    if score.task.axis:
        return score.worst, score.median
    return _drift(score), ""


def _accuracy(outcomes: Sequence[Outcome], prefix: str) -> Table:
    columns = [Column(_kind(prefix))]
    for outcome in outcomes:
        columns += [Column(outcome.name.replace("_", " "), "speed error", 2),
                    Column("", "slip, cm/s")]  # fmt: skip
    rows = []
    for scores in zip(*(outcome.scores for outcome in outcomes), strict=True):
        row: list[TableCell] = [f"{scores[0].task.name} {scores[0].unit}".rstrip()]
        for score in scores:
            row += [score.speed_error, score.worst_of("slip_speed", 100.0)]
        rows.append(row)
    return Table(columns, rows)


def _errors(outcomes: Sequence[Outcome], prefix: str) -> Table:
    columns = [Column(f"CoM y, {_kind(prefix)}"), Column("published", "mm", 2)]
    for outcome in outcomes:
        columns += [Column(outcome.name.replace("_", " "), "measured, mm", 2),
                    Column("", "true, mm", 2)]  # fmt: skip
    rows = []
    for scores in zip(*(outcome.scores for outcome in outcomes), strict=True):
        name = ERRORS.get(scores[0].task.name)
        if name is not None:
            row: list[TableCell] = [name, PAPER_COM_ERROR[PAPER_ERROR[name]]]
            for score in scores:
                row += [score.mean_of("com_error_y_measured", 1000.0),
                        score.mean_of("com_error_y", 1000.0)]  # fmt: skip
            rows.append(row)
    return Table(columns, rows)


def _pushes(outcomes: Sequence[Outcome], prefix: str) -> Table:
    columns = [Column(f"pushes, {_kind(prefix)}"), Column("", "N s", 2)]
    columns += [Column(outcome.name.replace("_", " ")) for outcome in outcomes]
    cells = zip(*(outcome.push_cells for outcome in outcomes), strict=True)
    rows = [(direction, impulse, *shares)
            for (direction, impulse), shares in zip(PUSHES, cells, strict=True)]  # fmt: skip
    return Table(columns, rows)


def check(options: Options) -> None:
    """Raise NaoGaitError for a robot that is no NAO, or a direction that is walked twice."""
    if not is_nao(options):
        raise NaoGaitError("robot", load_robot(options.urdf).name, f"{NAO} for the suite paper")
    tasks_of(options)


SUITE = Suite(
    name="paper",
    title="The first paper's results",
    summary="speeds, CoM error and pushes of the preset paper beside the paper's own figures",
    measure=paper,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop", "phases"),
    quick=({"robots": 2, "window": 4.0, "phases": 2, "drawn": "off"},),
    check=check,
    applies=is_nao,
)
