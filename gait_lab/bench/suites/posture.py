"""The suite `posture`: the second paper's three experiments, with and without posture control.

Starts from standing, a long straight walk at speed, and a soccer player's sequence of walk, turn,
stand and kick. Without posture control the gains of eq. (7) are 0. All other uses of the sensors by
a walk stay on in both forms, and so does the posture control of a kick on its standing leg.
"""

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, shown
from gait_lab.bench.score import RULES, Score, Variant, walk_all
from gait_lab.bench.suite import Suite
from robot_core.errors import NaoGaitError
from robot_core.motion.library import shipped_library
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.motions import MotionOutcome
from sim_bridge.trials.tasks import STAND_TIME, AskedMotion, Task, find_task
from sim_bridge.trials.trial import loaded_robot

JUMP = 0.01
"""[s] in which a command changes."""
START_END = STAND_TIME + 5.0
"""[s since the start] until which a start is watched."""
GAINS = ("gyro_pitch_gain", "gyro_pitch_rate_gain", "gyro_roll_gain", "gyro_roll_rate_gain")
PAPER: Mapping[str, float] = {"start_on": 0.0, "start_off": 65.0, "straight_on": 0.0}
"""Published share of falls [%]: several dozen starts; 5 minutes and more of walking."""
PAPER_TIME_TO_FALL = 60.0
"""[s] within which nearly all walks without posture control ended."""
PAPER_SPEED = 40.0
"""[cm/s]"""


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `posture` runs on; commanded 41 cm/s, Bruno walks 40."""

    robots: int = 20
    urdf: str = "bruno"
    tasks: tuple[str, ...] = ("forward=41",)
    window: float = 300.0
    experiments: tuple[str, ...] = option(
        (), "only this one: start, straight or soccer", "NAME", flags=("--experiment",)
    )


class Piece(NamedTuple):
    """A part of the soccer sequence.

    Attributes:
        seconds: Duration [s].
        forward: Share of the commanded speed.
        side: [m/s].
        turn: [rad/s].
        kick: Motion that is requested at the beginning of the piece.
    """

    seconds: float
    forward: float
    side: float = 0.0
    turn: float = 0.0
    kick: str = ""


SOCCER = (
    Piece(3.0, 1.0),  # to the ball
    Piece(2.0, 0.0, turn=0.9),
    Piece(2.0, 0.6, turn=-0.5),
    Piece(1.5, 0.0, side=0.1),  # beside it
    Piece(2.0, 0.0),
    Piece(3.0, 0.0, kick="kick_front_right"),  # from the stand
    Piece(3.0, 1.0),  # after it
    Piece(1.0, 0.0),
    Piece(2.0, 0.0, turn=-0.9),
    Piece(1.5, 0.0, side=-0.1),
    Piece(8.0, 1.0, kick="kick_front_left"),  # while it walks; it walks on by itself
    Piece(2.0, 0.0),
    Piece(1.5, -0.4),  # back to its own half
    Piece(2.5, 1.0, turn=0.3),
    Piece(2.0, 0.0),
)
LAPS = 2


@dataclass(frozen=True, slots=True)
class Half:
    """One experiment with or without posture control.

    Attributes:
        experiment: Its name.
        form: `on` or `off`.
        score: All robots.
    """

    experiment: str
    form: str
    score: Score

    @property
    def name(self) -> str:
        """As it begins the name of a metric."""
        return f"{self.experiment}_{self.form}"

    @property
    def fall_times(self) -> list[float]:
        """[s] of walking until each fall."""
        times = [result.metrics.fall_time for result in self.score.results]
        return [time - STAND_TIME for time in times if time is not None]

    @property
    def fall_share(self) -> float:
        """[%] of the robots."""
        return 100.0 * len(self.fall_times) / len(self.score.results)

    @property
    def saturated(self) -> float:
        """[%] mean share of ticks with a motor at its limit."""
        return self.score.mean_of("saturated_share", 100.0)

    @property
    def kicks(self) -> int:
        """Number of kicks that were requested."""
        return len(self.score.results) * len(self.score.task.motions)

    @property
    def done(self) -> list[MotionOutcome]:
        """The kicks after which the robot walked on."""
        motions = (motion for result in self.score.results for motion in result.motions)
        return [motion for motion in motions if motion.walked is not None]

    @property
    def ball_distances(self) -> list[float]:
        """[m] of the ball at the end of each kick that was done."""
        return [motion.ball for motion in self.done if motion.ball is not None]

    @property
    def longest_wait(self) -> float | None:
        """[s] from the request of a kick to its beginning."""
        waits = [math.nan if motion.began is None else motion.began - motion.asked.time
                 for motion in self.done]  # fmt: skip
        return max(waits, default=None)

    @property
    def rows(self) -> list[Measurement]:
        """The measurements."""
        name, times, score = self.name, self.fall_times, self.score
        rows = [
            Measurement(f"{name}_runs", "runs", len(score.results)),
            Measurement(f"{name}_falls", "runs", len(times)),
            Measurement(f"{name}_fall_share", "%", self.fall_share, PAPER.get(name)),
        ]
        if self.experiment == "straight":
            median = _median(times)
            paper = PAPER_TIME_TO_FALL if self.form == "off" else None
            counts = bool(score.speeds) and not score.faults
            worst, middle = (score.worst, score.median) if counts else (None, None)
            rows += [
                Measurement(f"{name}_time_to_fall_median", "s", median, paper),
                Measurement(f"{name}_worst", "cm/s", worst, PAPER_SPEED),
                Measurement(f"{name}_median", "cm/s", middle, PAPER_SPEED),
                Measurement(f"{name}_counts", "bool", float(counts)),
                Measurement(f"{name}_saturated_share_mean", "%", self.saturated),
            ]
        if self.experiment == "soccer":
            balls = self.ball_distances
            rows += [
                Measurement(f"{name}_kicks", "kicks", self.kicks),
                Measurement(f"{name}_kicks_done", "kicks", len(self.done)),
                Measurement(f"{name}_ball_median", "m", _median(balls)),
                Measurement(f"{name}_ball_least", "m", min(balls, default=None)),
                Measurement(f"{name}_kick_wait_longest", "s", self.longest_wait),
            ]
        return rows

    @property
    def note(self) -> str:
        """A sentence about the kicks."""
        return (
            f"soccer {self.form}: {len(self.done)} of {self.kicks} kicks after which the robot "
            f"walked on; ball at the end of the kick: median "
            f"{shown(_median(self.ball_distances), 2)} m; longest stop before a kick: "
            f"{shown(self.longest_wait)} s."
        )


def experiments_of(options: Options) -> list[Task]:
    """The walks of the experiments; raises NaoGaitError for what cannot be walked."""
    if len(options.tasks) != 1 or find_task(options.tasks[0]).axis != "x":
        raise NaoGaitError("task", ", ".join(options.tasks), "one forward task, e.g. forward=40")
    speed = find_task(options.tasks[0]).asked
    every = [start_task(speed), straight_task(speed, options.window), soccer_task(speed)]
    names = {task.name for task in every}
    for name in options.experiments:
        if name not in names:
            raise NaoGaitError("experiment", name, f"one of {', '.join(sorted(names))}")
    tasks = [task for task in every if task.name in (options.experiments or names)]
    motions = shipped_library(loaded_robot(options.urdf))
    for each in {motion.name for task in tasks for motion in task.motions}:
        motions.find(each)
    return tasks


def posture(options: Options) -> SuiteResult:
    """The experiments on all robots, with and without posture control."""
    tasks = experiments_of(options)
    speed = find_task(options.tasks[0]).asked
    off = Variant(parameters=dict.fromkeys(GAINS, 0.0))
    with_control, without = walk_all(
        replace(options, open_loop="off"), (Variant(), off), tasks, label="posture"
    )
    halves = [
        Half(task.name, form, score)
        for task, *scores in zip(tasks, with_control, without, strict=True)
        for form, score in zip(("on", "off"), scores, strict=True)
    ]
    notes = (
        *(half.note for half in halves if half.experiment == "soccer"),
        f"start: the speed at once from standing, {START_END - STAND_TIME:g} s. straight: "
        f"{options.window:g} s at speed. soccer: {sum(p.seconds for p in SOCCER) * LAPS:g} s of "
        "walk, turn, side step, stand, kick, each at once. Without posture control all gains of "
        "eq. (7) of the walk are 0; a kick keeps those in its file.",
        f"Speeds of the robots that stayed upright. {RULES}",
        "Paper: one robot, several dozen starts, 5 minutes straight; without posture control it "
        "fell within a minute.",
    )
    return SuiteResult(
        tuple(row for half in halves for row in half.rows),
        f"Posture control, eq. (7), commanded {100.0 * speed:.3g} cm/s; {options.title}",
        (_table(halves),), notes,
    )  # fmt: skip


def start_task(speed: float) -> Task:
    """From standing: the full speed [m/s] is commanded at once."""
    knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + JUMP, VelocityCommand(speed)))
    return Task("start", knots, START_END - 1.0, START_END, "x")


def straight_task(speed: float, seconds: float) -> Task:
    """Straight ahead at a speed [m/s] for some seconds."""
    return replace(find_task(f"forward={100.0 * speed:.10g}").lasting(seconds), name="straight")


def soccer_task(speed: float) -> Task:
    """Each piece at once after the other, whatever the robot is doing; speed in m/s."""
    kicks: list[AskedMotion] = []
    knots: list[tuple[float, VelocityCommand]] = [(STAND_TIME, STANDSTILL)]
    time = STAND_TIME
    for piece in SOCCER * LAPS:
        command = VelocityCommand(piece.forward * speed, piece.side, piece.turn)
        knots += [(time + JUMP, command), (time + piece.seconds, command)]
        if piece.kick:
            kicks.append(AskedMotion(time, piece.kick))
        time += piece.seconds
    return Task("soccer", tuple(knots), STAND_TIME, time, motions=tuple(kicks))


def _median(values: Iterable[float]) -> float | None:
    found = list(values)
    return statistics.median(found) if found else None


def _table(halves: Sequence[Half]) -> Table:
    columns = (
        Column("experiment"), Column("posture", "control"), Column("runs"), Column("falls"),
        Column("share", "%"), Column("paper", "%", 0), Column("first fall", "s"),
        Column("speed, cm/s", "worst"), Column("", "median"),
        Column("motors at", "the limit, %", 0), Column(""),
    )  # fmt: skip
    rows = [
        (
            half.experiment, half.form, len(half.score.results), len(half.fall_times),
            half.fall_share, PAPER.get(half.name), min(half.fall_times, default=None),
            half.score.worst, half.score.median, half.saturated,
            half.score.mark if half.score.speeds else "",
        )
        for half in halves
    ]  # fmt: skip
    return Table(columns, rows)


SUITE = Suite(
    name="posture",
    title="Posture control",
    summary="the second paper's three experiments, with and without posture control",
    measure=posture,
    options=Options,
    takes=("robots", "tasks", "window"),
    quick=({"robots": 2, "window": 5.0},),
    check=experiments_of,
)
