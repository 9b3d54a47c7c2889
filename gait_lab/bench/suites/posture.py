"""The suite `posture`: the second paper's three experiments, with and without posture control.

Starts from standing, a long straight walk at speed, and a soccer player's sequence of walk, turn,
stand and kick. Without posture control the gains of eq. (7) are 0. All other uses of the sensors by
a walk stay on in both forms, and so does the posture control of a kick on its standing leg.
"""

import math
import statistics
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import RULES, Score, Variant, median, walk_all
from robot_core.errors import NaoGaitError
from robot_core.motion.library import shipped_library
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.tasks import STAND_TIME, AskedMotion, Task, find_task
from sim_bridge.trials.trial import loaded_robot

JUMP = 0.01
"""[s] in which a command changes."""
START_END = STAND_TIME + 5.0
"""[s since the start] until which a start is watched."""
GAINS = ("gyro_pitch_gain", "gyro_roll_gain")
PAPER: Mapping[str, float] = {"start_on": 0.0, "start_off": 65.0, "straight_on": 0.0}
"""Published share of falls [%]: several dozen starts; 5 minutes and more of walking."""
PAPER_TIME_TO_FALL = 60.0
"""[s] within which nearly all walks without posture control ended."""
PAPER_SPEED = 40.0
"""[cm/s]"""
EXPERIMENTS = ("start", "straight", "soccer")


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


def experiments_of(options: Options) -> list[Task]:
    """The walks of the experiments; raises NaoGaitError for what cannot be walked."""
    if len(options.tasks) != 1 or find_task(options.tasks[0]).axis != "x":
        raise NaoGaitError("task", ", ".join(options.tasks), "one forward task, e.g. forward=40")
    speed = find_task(options.tasks[0]).asked
    knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + JUMP, VelocityCommand(speed)))
    straight = find_task(f"forward={100.0 * speed:.10g}").lasting(options.window)
    every = [
        Task("start", knots, START_END - 1.0, START_END, "x"),
        replace(straight, name="straight"),
        soccer_task(speed),
    ]
    tasks = [task for task in every if task.name in options.experiments]
    motions = shipped_library(loaded_robot(options.urdf))
    for each in {motion.name for task in tasks for motion in task.motions}:
        motions.find(each)
    return tasks


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


def experiment_rows(name: str, score: Score) -> Iterator[Row]:
    """The measurements of one experiment with or without posture control."""
    times = [each.fall_time - STAND_TIME for each in score.metrics if each.fall_time is not None]
    yield Row(name, "runs", "runs", len(score.results))
    yield Row(name, "falls", "runs", len(times))
    yield Row(name, "fall_share", "%", 100.0 * len(times) / len(score.results), PAPER.get(name))
    if score.task.name == "straight":
        counts = bool(score.speeds) and not score.faults
        paper = PAPER_TIME_TO_FALL if name.endswith("off") else None
        yield Row(name, "time_to_fall_median", "s", median(times), paper)
        for row in score.rows("worst", "median"):
            yield row._replace(subject=name, paper=PAPER_SPEED,
                               value=row.value if counts else None)  # fmt: skip
        yield Row(name, "counts", "bool", float(counts))
        saturated = score.over(statistics.fmean, "saturated_share", 100.0)
        yield Row(name, "saturated_share_mean", "%", saturated)
    if score.task.name == "soccer":
        done = [motion for each in score.results for motion in each.motions
                if motion.walked is not None]  # fmt: skip
        balls = [motion.ball for motion in done if motion.ball is not None]
        waits = [math.nan if motion.began is None else motion.began - motion.asked.time
                 for motion in done]  # fmt: skip
        yield Row(name, "kicks", "kicks", len(score.results) * len(score.task.motions))
        yield Row(name, "kicks_done", "kicks", len(done))
        yield Row(name, "ball_median", "m", median(balls))
        yield Row(name, "ball_least", "m", min(balls, default=None))
        yield Row(name, "kick_wait_longest", "s", max(waits, default=None))


@suite(
    "posture", "Posture control",
    "the second paper's three experiments, with and without posture control",
    options={
        "robots": 20, "urdf": "bruno", "tasks": ("forward=41",), "window": 300.0,
        "experiments": Option(
            EXPERIMENTS, "only this one", "NAME", ("--experiment",), choices=EXPERIMENTS
        ),
    },
    quick=({"robots": 2, "window": 5.0},), check=experiments_of,
)  # fmt: skip
def posture(options: Options) -> Iterator[Row | str]:
    """The experiments on all robots, with and without posture control; Bruno walks 40 cm/s."""
    tasks = experiments_of(options)
    off = Variant(parameters=dict.fromkeys(GAINS, 0.0))
    found = walk_all(options.but(open_loop="off"), tasks, (Variant(), off))
    for scores in zip(*found, strict=True):
        for form, score in zip(("on", "off"), scores, strict=True):
            yield from experiment_rows(f"{score.task.name}_{form}", score)
    yield (
        f"start: the speed at once from standing, {START_END - STAND_TIME:g} s. straight: "
        f"{options.window:g} s at speed. soccer: {sum(p.seconds for p in SOCCER) * LAPS:g} s of "
        "walk, turn, side step, stand, kick, each at once. Without posture control all gains of "
        f"eq. (7) of the walk are 0; a kick keeps those in its file. {RULES} Paper: one robot."
    )
