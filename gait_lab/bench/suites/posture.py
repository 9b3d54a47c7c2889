"""The suite `posture`: the second paper's three experiments, with and without posture control.

Starts from standing, a long straight walk at speed, and a soccer player's sequence of walk, turn,
stand and kick. Without posture control means eq. (7) with gains of 0; whatever else a walk does
about its sensors it does in both, and so does a kick on its standing leg.
"""

import math
import statistics
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, number, table
from gait_lab.bench.score import Score, Variant, walk_all
from gait_lab.trials.motions import MotionOutcome
from gait_lab.trials.tasks import STAND_TIME, AskedMotion, Task, find_task
from gait_lab.trials.trial import loaded_robot
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.motion.library import shipped_library
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

SUITE = "posture"
TASKS = ("forward=41",)
"""What Bruno is asked so that it walks 40 cm/s."""
JUMP = 0.01
"""[s] in which a command changes."""
START_END = STAND_TIME + 5.0
"""[s] until which a start is watched."""
GAINS = ("gyro_pitch_gain", "gyro_pitch_rate_gain", "gyro_roll_gain", "gyro_roll_rate_gain")
PAPER: Mapping[str, float] = {"start_on": 0.0, "start_off": 65.0, "straight_on": 0.0}
"""Published share of falls [%]: several dozen starts; 5 minutes and more of walking."""
PAPER_TIME_TO_FALL = 60.0
"""[s] within which nearly all walks without posture control ended."""


class Piece(NamedTuple):
    """A part of the soccer sequence."""

    seconds: float
    forward: float
    """Share of the asked speed."""
    side: float = 0.0
    """[m/s]"""
    turn: float = 0.0
    """[rad/s]"""
    kick: str = ""
    """Asked for at its beginning."""


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
    Piece(1.5, -0.4),  # back to the own half
    Piece(2.5, 1.0, turn=0.3),
    Piece(2.0, 0.0),
)
LAPS = 2


class Experiment(NamedTuple):
    """One experiment in both forms."""

    name: str
    on: Score
    off: Score


def experiments_of(options: BenchOptions) -> list[Task]:
    """What is walked; NaoGaitError for what cannot be."""
    if len(options.tasks) != 1 or find_task(options.tasks[0]).axis != "x":
        raise NaoGaitError("task", ", ".join(options.tasks), "one forward task, as forward=40")
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


def posture(options: BenchOptions) -> Report:
    """All three experiments on all robots, with and without posture control."""
    tasks = experiments_of(options)
    speed = find_task(options.tasks[0]).asked
    off = Variant(parameters=dict.fromkeys(GAINS, 0.0))
    with_control, without = walk_all(
        replace(options, open_loop="off"), (Variant(), off), tasks, label="posture"
    )
    experiments = [
        Experiment(task.name, one, other)
        for task, one, other in zip(tasks, with_control, without, strict=True)
    ]
    rows = [row for experiment in experiments for row in _rows(experiment)]
    return Report(tuple(rows), _text(experiments, speed, options))


def start_task(speed: float) -> Task:
    """From standing: the whole speed [m/s] is asked for at once."""
    knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + JUMP, VelocityCommand(speed)))
    return Task("start", knots, START_END - 1.0, START_END, "x")


def straight_task(speed: float, seconds: float) -> Task:
    return replace(find_task(f"forward={100.0 * speed:.10g}").lasting(seconds), name="straight")


def soccer_task(speed: float) -> Task:
    """Each piece at once after the other, whatever the robot is doing."""
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


def _fall_times(score: Score) -> list[float]:
    """[s] of walking until each fall."""
    times = [result.metrics.fall_time for result in score.results]
    return [time - STAND_TIME for time in times if time is not None]


def _fall_share(score: Score) -> float:
    """[%]"""
    return 100.0 * len(_fall_times(score)) / len(score.results)


def _done(motions: Iterable[MotionOutcome]) -> list[MotionOutcome]:
    """Those after which the robot walked on."""
    return [motion for motion in motions if motion.walked is not None]


def _wait(motion: MotionOutcome) -> float:
    """[s] from the request to the begin."""
    return math.nan if motion.began is None else motion.began - motion.asked.time


def _median(values: Iterable[float | None]) -> float | None:
    found = [value for value in values if value is not None]
    return statistics.median(found) if found else None


def _rows(experiment: Experiment) -> list[Row]:
    rows = []
    for form, score in (("on", experiment.on), ("off", experiment.off)):
        name, times = f"{experiment.name}_{form}", _fall_times(score)
        rows += [
            Row(SUITE, f"{name}_runs", "runs", len(score.results)),
            Row(SUITE, f"{name}_falls", "runs", len(times)),
            Row(SUITE, f"{name}_fall_share", "%", _fall_share(score), PAPER.get(name)),
        ]
        if experiment.name == "straight":
            median = statistics.median(times) if times else None
            paper = PAPER_TIME_TO_FALL if form == "off" else None
            speeds = score.speeds
            counts = bool(speeds) and not score.faults
            rows += [
                Row(SUITE, f"{name}_time_to_fall_median", "s", median, paper),
                Row(SUITE, f"{name}_worst", "cm/s", min(speeds) if counts else None, 40.0),
                Row(SUITE, f"{name}_median", "cm/s", statistics.median(speeds) if counts else None,
                    40.0),
                Row(SUITE, f"{name}_counts", "bool", float(counts)),
                Row(SUITE, f"{name}_saturated_share_mean", "%",
                    score.over(statistics.mean, "saturated_share", 100.0)),
            ]  # fmt: skip
        kicks = [kick for result in score.results for kick in result.motions]
        if experiment.name == "soccer":
            done = _done(kicks)
            rows += [
                Row(SUITE, f"{name}_kicks", "kicks", len(score.results) * len(score.task.motions)),
                Row(SUITE, f"{name}_kicks_done", "kicks", len(done)),
                Row(SUITE, f"{name}_ball_median", "m", _median(kick.ball for kick in done)),
                Row(SUITE, f"{name}_ball_least", "m",
                    min((kick.ball for kick in done if kick.ball is not None), default=None)),
                Row(SUITE, f"{name}_kick_wait_longest", "s",
                    max((_wait(kick) for kick in done), default=None)),
            ]  # fmt: skip
    return rows


def _text(experiments: list[Experiment], speed: float, options: BenchOptions) -> str:
    lines: list[tuple[str, ...]] = [
        ("experiment", "posture", "runs", "falls", "share", "paper", "first", "speed, cm/s", "",
         "motors at", ""),
        ("", "control", "", "", "%", "%", "fall, s", "worst", "median", "the limit, %", ""),
    ]  # fmt: skip
    for experiment in experiments:
        for form, score in (("on", experiment.on), ("off", experiment.off)):
            times, speeds = _fall_times(score), score.speeds
            lines.append(
                (
                    experiment.name,
                    form,
                    str(len(score.results)),
                    str(len(times)),
                    number(_fall_share(score)),
                    number(PAPER.get(f"{experiment.name}_{form}"), 0),
                    number(min(times) if times else None),
                    number(min(speeds)) if speeds else "-",
                    number(statistics.median(speeds)) if speeds else "-",
                    number(score.over(statistics.mean, "saturated_share", 100.0), 0),
                    f"x {', '.join(score.faults)}" if score.faults and speeds else "",
                )
            )
    kicks = [line for each in experiments if each.name == "soccer" for line in _kick_lines(each)]
    title = f"Posture control, eq. (7), asked {100.0 * speed:.3g} cm/s; {options.title}"
    notes = (
        f"start: the speed at once from standing, {START_END - STAND_TIME:g} s. straight: "
        f"{options.window:g} s at speed. soccer: {sum(p.seconds for p in SOCCER) * LAPS:g} s of",
        "walk, turn, side step, stand, kick, each at once. Without control: all gains of eq. (7)",
        "of the walk are 0; a kick keeps those in its file.",
        "Speeds of the robots that stayed upright; x = does not count as walking. Paper: a robot,",
        "several dozen starts, 5 minutes straight; without control it fell within a minute.",
    )
    return "\n".join((title, "", table(lines), "", *kicks, *notes))


def _kick_lines(experiment: Experiment) -> list[str]:
    lines = []
    for form, score in (("on", experiment.on), ("off", experiment.off)):
        asked = len(score.results) * len(score.task.motions)
        done = _done(kick for result in score.results for kick in result.motions)
        waits = [_wait(kick) for kick in done]
        lines.append(
            f"soccer {form}: {len(done)} of {asked} kicks after which the robot walked on; ball at "
            f"the end of the kick: median {number(_median(kick.ball for kick in done), 2)} m; "
            f"longest stop before a kick: {number(max(waits, default=None), 1)} s."
        )
    return [*lines, ""]
