"""The suite `peers`: other walks beside ours, with the same commands on the same robots.

Our walk in open loop, the second paper's ZMP walk and ZMP preview control, each with and without
posture control by the gyro, the preset `paper`, the gait as it is, and, where its environment is
given, placo's walk. Only for the NAO: the presets of the others are made for it.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from gait_lab.bench.comparison import Contender, Outcome, compare
from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, finite
from gait_lab.bench.score import Score, tasks_of
from gait_lab.bench.suite import Suite
from gait_lab.peers.placo_walk import HOW_TO_GET_IT, Placo
from nao_lipm_gait.parameters import load_preset
from robot_core.errors import NaoGaitError
from robot_core.robot import NAO, load_robot
from sim_bridge.trials.metrics import Metrics

PUSHES = (("left", 1.5), ("forward", 2.0))
"""Directions and impulses [N s] of the pushes on the spot."""
WITHOUT_GYRO = {
    "gyro_pitch_gain": 0.0, "gyro_pitch_rate_gain": 0.0,
    "gyro_roll_gain": 0.0, "gyro_roll_rate_gain": 0.0,
}  # fmt: skip


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `peers` runs on; its speeds are within reach of each walk."""

    window: float = 8.0
    phases: int = 4
    tasks: tuple[str, ...] = ("forward=25", "back=20", "side=10", "turn=50")
    placo_python: str | None = option(
        None, "Python of an environment that has placo, to measure its walk too", "PATH", parse=str
    )


def peers_of(options: Options) -> list[Contender]:
    """The walks to compare."""
    ours = options.parameters
    zmp, preview = load_preset("zmp"), load_preset("preview")
    found = [
        Contender("open_loop", ours.replace(feedback=False)),
        Contender("zmp", zmp.replace(**WITHOUT_GYRO)),
        Contender("zmp_gyro", zmp),
        Contender("preview", preview.replace(**WITHOUT_GYRO)),
        Contender("preview_gyro", preview),
        Contender("paper", load_preset("paper")),
        Contender("default", ours),
    ]
    if options.placo_python is not None:
        found.append(Contender("placo", ours, Placo(options.placo_python)))
    return found


def is_nao(options: BenchOptions) -> bool:
    """Whether the walks are made for this robot."""
    return load_robot(options.urdf).name == NAO


def check(options: Options) -> None:
    """Raise NaoGaitError for a robot that is no NAO, or a Python without placo."""
    if not is_nao(options):
        raise NaoGaitError("robot", load_robot(options.urdf).name, f"{NAO} for the suite peers")
    if options.placo_python is not None:
        Placo(options.placo_python).check()


def peers(options: Options) -> SuiteResult:
    """All tasks with every walk, then pushes on the spot."""
    outcomes = compare(options, peers_of(options), tasks_of(options), PUSHES)
    notes = [
        "Speeds [cm/s, deg/s] of the robots that stayed upright; farthest: the one farthest from "
        "what is commanded. x: a robot fell; !: upright, but does not count (flight, slip, contact "
        "of the legs).",
        "off: difference to the commanded velocity over ground; yaw: turn rate where none is "
        "commanded; both of the upright robots. Off, yaw, flight, slip: the worst of all robots "
        "and tasks. CoM y: mean |expected - true| over the tasks. Pushes while stepping on the "
        f"spot: share of {options.robots * options.phases} after which the robot steps on the spot "
        "again.",
        "open loop: the gait without feedback. zmp, preview: ZMP walk and ZMP preview control with "
        "heading hold, without posture control by the gyro; gyro: with it. paper: the preset with "
        "the first paper's method. default: the preset of that name, or what the command sets.",
        "placo: joint trajectories of placo's walk, open loop, without heading hold."
        if options.placo_python is not None else
        "placo's walk is left out: give a Python that has it by --placo-python. To make one: "
        f"{HOW_TO_GET_IT}, then --placo-python placo-env/bin/python.",
    ]  # fmt: skip
    return SuiteResult(
        tuple(row for outcome in outcomes for row in outcome_rows(outcome)),
        f"Peers, {options.window:g} s at speed, {options.title}",
        (_table(outcomes),), tuple(notes),
    )  # fmt: skip


def outcome_rows(outcome: Outcome) -> list[Measurement]:
    """The measurements of one walk; speeds as they count, and of all upright robots."""
    rows = []
    for score in outcome.scores:
        name, counts = f"{outcome.name}_{score.task.name}", not score.faults
        rows.append(Measurement(f"{name}_upright", "robots", score.upright))
        rows.append(Measurement(f"{name}_counts", "bool", float(counts)))
        if score.task.axis:
            for statistic, value in (("worst", _farthest(score)), ("median", score.median)):
                metric, counted = f"{name}_{statistic}", value if counts else None
                rows.append(Measurement(metric, score.unit, counted))
                rows.append(Measurement(f"{metric}_of_upright", score.unit, value))
        rows += [
            Measurement(f"{name}_off_worst", "cm/s", finite(_off(score))),
            Measurement(f"{name}_yaw_off_worst", "deg/s", finite(_yaw_off(score))),
            Measurement(f"{name}_flight_worst", "%", finite(_flight(score))),
            Measurement(f"{name}_slip_worst", "cm/s", finite(_slip(score))),
            Measurement(f"{name}_com_y_error_mean", "mm", finite(_com_error(score))),
        ]
    rows += outcome.push_rows
    if outcome.name != "placo":  # it detects no falls
        rows += outcome.detection.rows(outcome.name)
    return rows


def _farthest(score: Score) -> float | None:
    """The speed farthest from the commanded one: running away is not walking fast."""
    asked = score.asked
    if asked is None:
        return None
    return max(score.speeds, key=lambda speed: abs(speed - asked), default=None)


def _upright(score: Score) -> list[Metrics]:
    return [result.metrics for result in score.results if not result.metrics.fell]


def _off(score: Score) -> float:
    """Largest difference to the commanded velocity over ground [cm/s]."""
    asked = score.task.command
    return 100.0 * max(
        (math.hypot(robot.speed_x - asked.x, robot.speed_y - asked.y) for robot in _upright(score)),
        default=math.nan,
    )


def _yaw_off(score: Score) -> float:
    """Largest difference to the commanded turn rate [deg/s]."""
    asked = score.task.command.yaw
    return math.degrees(
        max((abs(robot.turn_rate - asked) for robot in _upright(score)), default=math.nan)
    )


def _flight(score: Score) -> float:
    return score.worst_of("flight_share", 100.0)


def _slip(score: Score) -> float:
    return score.worst_of("slip_speed", 100.0)


def _com_error(score: Score) -> float:
    return score.mean_of("com_error_y", 1000.0)


def _over(
    pick: Callable[[Iterable[float]], float], of: Callable[[Score], float], scores: Iterable[Score]
) -> float:
    """`pick` (max, mean) over the tasks where there is a value; NaN if there is none."""
    values = [value for value in map(of, scores) if math.isfinite(value)]
    return pick(values) if values else math.nan


def _table(outcomes: Sequence[Outcome]) -> Table:
    columns = [Column("walk")]
    for score in outcomes[0].scores:
        asked = "" if score.asked is None else f"of {score.asked:.0f}"
        columns += [Column(score.task.name, "upright"), Column(asked, "farthest")]
        columns.append(Column("", "median"))
    columns += [
        Column("off", "cm/s"), Column("yaw", "deg/s"), Column("flight", "%"),
        Column("slip", "cm/s"), Column("CoM y", "mm"),
        *(Column(direction, f"{impulse:g} N s") for direction, impulse in PUSHES),
    ]  # fmt: skip
    rows = []
    for outcome in outcomes:
        row: list[TableCell] = [outcome.name.replace("_", " ")]
        for score in outcome.scores:
            upright = f"{score.short_mark}{score.upright_text}"
            row += [upright, _farthest(score), score.median]
        straight = [score for score in outcome.scores if score.task.axis != "yaw"]
        rows.append([
            *row, _over(max, _off, outcome.scores), _over(max, _yaw_off, straight),
            _over(max, _flight, outcome.scores), _over(max, _slip, outcome.scores),
            _over(statistics.fmean, _com_error, outcome.scores), *outcome.push_cells,
        ])  # fmt: skip
    return Table(columns, rows)


SUITE = Suite(
    name="peers",
    title="Other walks on the same robots",
    summary="ZMP walk, ZMP preview, the preset paper, open loop and placo's walk beside ours",
    measure=peers,
    options=Options,
    takes=("robots", "tasks", "window", "phases"),
    quick=({"robots": 2, "window": 4.0, "phases": 2},),
    check=check,
    applies=is_nao,
)
