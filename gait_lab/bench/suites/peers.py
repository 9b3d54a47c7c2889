"""The suite `peers`: other ways to walk beside ours, asked for the same on the same robots.

Our walk in open loop, the second paper's ZMP walk and ZMP preview control, each with and without
posture control by the gyro, the first paper's method alone, the gait as it is, and, where its
environment is named, placo's walk. Only NAOs: the presets of the others are for them.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from gait_lab.analysis.metrics import Metrics
from gait_lab.bench.falls import FallDetection
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.push_cells import Cell, push_cells
from gait_lab.bench.report import Report, Row, finite, number, table
from gait_lab.bench.score import Score, Variant, tasks_of, walk_all
from gait_lab.peers.placo_walk import HOW_TO_GET_IT, Placo
from gait_lab.trials.tasks import AXES, Task
from gait_lab.trials.trial import Walker
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.parameters import GaitParameters, load_preset
from nao_lipm_gait.robot import NAO, RobotDescription, load_robot

SUITE = "peers"
TASKS = ("forward=25", "back=20", "side=10", "turn=50")
"""What every one of these walks can be asked for."""
PUSHES = (("left", 1.5), ("forward", 2.0))
"""Directions and impulses [N s] of the pushes on the spot."""
WITHOUT_GYRO = {
    "gyro_pitch_gain": 0.0, "gyro_pitch_rate_gain": 0.0,
    "gyro_roll_gain": 0.0, "gyro_roll_rate_gain": 0.0,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Peer:
    """One way to walk."""

    name: str
    parameters: GaitParameters
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None
    """What walks in the gait's place; None = the gait with these parameters."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How the robots walked and withstood pushes with one peer."""

    name: str
    scores: tuple[Score, ...]
    cells: Mapping[tuple[str, float], Cell]
    detection: FallDetection
    """Over walks and pushes."""


def peers_of(options: BenchOptions) -> tuple[Peer, ...]:
    """The peers; those of our package are the parameter sets that they are."""
    ours = options.parameters
    zmp, preview = load_preset("zmp"), load_preset("preview")
    found = [
        Peer("open_loop", ours.replace(feedback=False)),
        Peer("zmp", zmp.replace(**WITHOUT_GYRO)),
        Peer("zmp_gyro", zmp),
        Peer("preview", preview.replace(**WITHOUT_GYRO)),
        Peer("preview_gyro", preview),
        Peer("paper", load_preset("paper")),
        Peer("default", ours),
    ]
    if options.placo_python is not None:
        found.append(Peer("placo", ours, Placo(options.placo_python)))
    return tuple(found)


def walks_here(urdf: str) -> bool:
    """Whether all the peers are made for this robot."""
    return load_robot(urdf).name == NAO


def require_possible(options: BenchOptions) -> None:
    """NaoGaitError for a robot that is no NAO, or a Python without placo."""
    if not walks_here(options.urdf):
        robot = load_robot(options.urdf).name
        raise NaoGaitError("robot", robot, f"{NAO} for the suite {SUITE}")
    if options.placo_python is not None:
        Placo(options.placo_python).check()


def peers(options: BenchOptions) -> Report:
    """All tasks with every peer, then pushes on the spot."""
    closed = replace(options, open_loop="off")
    found, tasks = peers_of(options), tasks_of(options)
    variants = [Variant(parameters=peer.parameters.as_dict(), walker=peer.walker) for peer in found]
    walked = walk_all(closed, variants, tasks)
    outcomes = []
    for peer, scores in zip(found, walked, strict=True):
        pushed = push_cells(
            replace(closed, parameters=peer.parameters), "spot", PUSHES,
            label=peer.name, walker=peer.walker,
        )  # fmt: skip
        for result in (result for score in scores for result in score.results):
            pushed.detection.add(result.metrics)
        outcomes.append(Outcome(peer.name, tuple(scores), pushed.cells, pushed.detection))
    rows = [row for outcome in outcomes for row in rows_of(outcome)]
    return Report(tuple(rows), _text(outcomes, options))


def rows_of(outcome: Outcome) -> list[Row]:
    """One row per figure, speeds twice: as they count, and of whoever stayed upright."""
    rows = []
    for score in outcome.scores:
        name = f"{outcome.name}_{score.task.name}"
        counts = not score.faults
        rows.append(Row(SUITE, f"{name}_upright", "robots", score.upright))
        rows.append(Row(SUITE, f"{name}_counts", "bool", float(counts)))
        if score.task.axis:
            for statistic, value in (("worst", _worst(score)), ("median", _median(score))):
                metric, counted = f"{name}_{statistic}", value if counts else None
                rows.append(Row(SUITE, metric, score.unit, counted))
                rows.append(Row(SUITE, f"{metric}_of_upright", score.unit, value))
        rows += [
            Row(SUITE, f"{name}_off_worst", "cm/s", finite(_off(score))),
            Row(SUITE, f"{name}_yaw_off_worst", "deg/s", finite(_yaw_off(score))),
            Row(SUITE, f"{name}_flight_worst", "%", finite(_flight(score))),
            Row(SUITE, f"{name}_slip_worst", "cm/s", finite(_slip(score))),
            Row(SUITE, f"{name}_com_y_error_mean", "mm", finite(_com_error(score))),
        ]
    for (direction, impulse), cell in outcome.cells.items():
        metric = f"{outcome.name}_push_{direction}_{impulse:g}_survival"
        rows.append(Row(SUITE, metric, "%", 100.0 * cell.share))
    if outcome.name != "placo":  # it reports no falls
        rows += outcome.detection.rows(SUITE, outcome.name)
    return rows


def _worst(score: Score) -> float | None:
    """The speed that is farthest from the asked one: who runs away is not good at walking fast."""
    axis = score.task.axis
    if axis is None or not score.speeds:
        return None
    asked = abs(score.task.asked) * AXES[axis][1]
    return max(score.speeds, key=lambda speed: abs(speed - asked))


def _median(score: Score) -> float | None:
    return statistics.median(score.speeds) if score.speeds else None


def _upright(score: Score) -> list[Metrics]:
    return [result.metrics for result in score.results if not result.metrics.fell]


def _off(score: Score) -> float:
    """Largest distance between the asked velocity over ground and a robot's [cm/s]."""
    asked = score.task.command
    return 100.0 * max(
        (math.hypot(robot.speed_x - asked.x, robot.speed_y - asked.y) for robot in _upright(score)),
        default=math.nan,
    )


def _yaw_off(score: Score) -> float:
    """Largest distance between the asked turning and a robot's [deg/s]."""
    asked = score.task.command.yaw
    return math.degrees(
        max((abs(robot.turn_rate - asked) for robot in _upright(score)), default=math.nan)
    )


def _over(
    pick: Callable[[Iterable[float]], float], of: Callable[[Score], float], scores: Iterable[Score]
) -> float:
    """`pick` (max, mean) over the tasks where there is a value; NaN if there is none."""
    values = [value for value in map(of, scores) if math.isfinite(value)]
    return pick(values) if values else math.nan


def _flight(score: Score) -> float:
    return score.over(max, "flight_share", 100.0)


def _slip(score: Score) -> float:
    return score.over(max, "slip_speed", 100.0)


def _com_error(score: Score) -> float:
    return score.over(statistics.fmean, "com_error_y", 1000.0)


def _text(outcomes: Sequence[Outcome], options: BenchOptions) -> str:
    header, units = ["walk"], [""]
    for score in outcomes[0].scores:
        axis = score.task.axis
        asked = f"of {abs(score.task.asked) * AXES[axis][1]:.0f}" if axis else ""
        header += [score.task.name, asked, ""]
        units += ["upright", "worst", "median"]
    header += ["off", "yaw", "flight", "slip", "CoM y", *(direction for direction, _ in PUSHES)]
    units += ["cm/s", "deg/s", "%", "cm/s", "mm", *(f"{impulse:g} N s" for _, impulse in PUSHES)]
    lines = [header, units]
    for outcome in outcomes:
        line = [outcome.name.replace("_", " ")]
        for score in outcome.scores:
            mark = "x" if score.upright < len(score.results) else "!" if score.faults else ""
            line += [
                f"{mark}{score.upright_text}", number(_worst(score)), number(_median(score)),
            ]  # fmt: skip
        straight = [score for score in outcome.scores if score.task.axis != "yaw"]
        line += [
            number(_over(max, _off, outcome.scores)),
            number(_over(max, _yaw_off, straight)),
            number(_over(max, _flight, outcome.scores)),
            number(_over(max, _slip, outcome.scores)),
            number(_over(statistics.fmean, _com_error, outcome.scores)),
            *(f"{100.0 * cell.share:.0f}%" for cell in outcome.cells.values()),
        ]
        lines.append(line)
    title = f"Peers, {options.window:g} s at speed, {options.title}"
    pushes = options.robots * options.phases
    notes = [
        "Speeds [cm/s, deg/s] of the robots that stayed upright, beside the asked one; worst: the",
        "farthest from it. x: a robot fell; !: upright, but does not count (flight, slip, leg",
        "against leg). off: the asked velocity over ground against the robot's; yaw: turning where",
        "none is asked; both of the upright robots. Off, yaw, flight, slip: the worst of all",
        "robots and tasks. CoM y: mean |expected - true| over the tasks. Pushes while stepping on",
        f"the spot: share of {pushes} after which a robot steps on the spot again.",
        "open loop: the gait without feedback; zmp, preview: ZMP walk and ZMP preview control, the",
        "heading held, without posture control by the gyro; gyro: with it. paper: the first",
        "paper's method alone; default: the gait of this command.",
    ]
    if options.placo_python is None:
        notes += [
            "placo's walk is left out: name a Python that has it by --placo-python. To make one:",
            f"{HOW_TO_GET_IT}, then --placo-python placo-env/bin/python.",
        ]
    else:
        notes.append("placo: joint trajectories of placo's walk, open loop, the heading not held.")
    return "\n".join((title, "", table(lines), "", *notes))
