"""The suite `odometry`: the robot's own pose against the truth, after courses of several walks.

Each course begins as over ROS: the robot stands until the bias of its gyro is known. Each robot has
its own sensor noise.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table
from gait_lab.bench.suite import Suite
from gait_lab.demo.tour import FULL_TOUR, phase_at
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.runtime.commands import LONGEST_BIAS_WAIT, BiasWait
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.parallel import parallel_map
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trace import FloatArray, Recorder, Trace
from sim_bridge.trials.trial import CONTROL_PERIOD, Action, Policy, Tick, run

STOP_TIME = 2.0
"""[s] to stop at the end of a course."""
PIECE = round(1.0 / CONTROL_PERIOD)
"""Ticks of the pieces whose lengths are the way, so that the steps' own movement does not count."""
Course = Callable[[float], VelocityCommand | None]
"""The command by the time [s] since the robot may walk; None at the end."""


def _constant(command: VelocityCommand, seconds: float) -> Course:
    def at(time: float) -> VelocityCommand | None:
        if time < seconds:
            return command
        return STANDSTILL if time < seconds + STOP_TIME else None

    return at


def _tour(time: float) -> VelocityCommand | None:
    phase = phase_at(FULL_TOUR, time)
    return None if phase is None else phase.command


COURSES: dict[str, Course] = {
    "tour": _tour,
    "driven": _constant(VelocityCommand(0.25, 0.0, 0.0), 30.0),
    "forward": _constant(TASKS["forward"].command, 20.0),
    "curve": _constant(VelocityCommand(0.15, 0.0, math.radians(20.0)), 12.0),
    "curve_right": _constant(VelocityCommand(0.25, 0.0, -math.radians(30.0)), 12.0),
    "diagonal": _constant(VelocityCommand(0.15, 0.10, 0.0), 12.0),
}


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `odometry` runs on."""

    courses: tuple[str, ...] = option(
        tuple(COURSES), "walk this", "NAME", flags=("--course",), choices=tuple(COURSES)
    )
    bias_wait: float = option(
        LONGEST_BIAS_WAIT, "longest stand [s] until the gyro's bias is known", "T",
        flags=("--bias-wait",), minimum=0.0, maximum=60.0,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class CourseSpec:
    """Everything that a walk of a course depends on.

    Attributes:
        spec: Robot, gait, plant and engine.
        course: Name of the course.
        bias_wait: Longest time [s] to stand first.
    """

    spec: RolloutSpec
    course: str
    bias_wait: float


@dataclass(frozen=True, slots=True)
class CourseResult:
    """What became of one course.

    Attributes:
        fell: The robot fell.
        stood: [s] that it stood before the walk.
        way: [m] that it walked.
        turned: [rad] by which it had turned at the last command, by the truth.
        heading_error: [rad] odometry minus truth at the end.
        place_error: [m] distance of the odometry's place from the truth at the end.
        heading_sigma: [rad] deviation of the heading by the odometry's covariance.
    """

    fell: bool
    stood: float
    way: float
    turned: float
    heading_error: float
    place_error: float
    heading_sigma: float


class _AfterBiasWait(Policy):
    """A course that begins when the gyro's bias is known.

    Attributes:
        began: Time [s] when the robot could walk; None before.
    """

    def __init__(self, gait: Gait, course: Course, longest: float) -> None:
        self.began: float | None = None
        self._gait = gait
        self._course = course
        self._wait = BiasWait(longest)

    def command(self, time: float, tick: Tick | None) -> Action:
        """Standstill, then the command of the course."""
        sigma = None if tick is None or tick.status is None else self._gait.heading_drift_sigma
        if self._wait.update(round(time * 1e9), self._gait.state, sigma):
            return STANDSTILL
        if self.began is None:
            self.began = time
        return self._course(time - self.began)


def walk_course(asked: CourseSpec) -> CourseResult:
    """Walk one course with one robot."""
    world, gait = make_pair(asked.spec)
    policy = _AfterBiasWait(gait, COURSES[asked.course], asked.bias_wait)
    recorder = Recorder()
    fell, variance = False, math.nan
    with world:
        for tick in run(world, gait, policy):
            recorder.add(tick.truth, tick.command, tick.status)
            fell = tick.fallen
            if tick.status is not None:
                variance = tick.status.pose_covariance.yaw
    stood = policy.began or 0.0
    return evaluate(recorder.trace(), stood, fell=fell, heading_sigma=math.sqrt(variance))


def evaluate(trace: Trace, stood: float, *, fell: bool, heading_sigma: float) -> CourseResult:
    """Compare odometry and truth from the beginning of the walk to the end of the trace.

    Args:
        trace: The walk.
        stood: [s] since the first tick when the walk began.
        fell: The robot fell.
        heading_sigma: [rad] deviation of the heading by the odometry's covariance.
    """
    known = np.flatnonzero(trace.status_stamp >= trace.stamp[0])
    begin = known[np.searchsorted(trace.time[known], stood)]
    rows = np.searchsorted(trace.stamp, trace.status_stamp[begin:])
    odometry = trace.odometry[begin:].copy()
    odometry[:, 2] = np.unwrap(odometry[:, 2])
    yaw = np.unwrap(trace.sole_yaw, axis=0).mean(axis=1)
    truth = np.column_stack([trace.sole_position[:, :, :2].mean(axis=1), yaw])[rows]
    walked, seen = _from_start(truth), _from_start(odometry)
    driven = np.flatnonzero(trace.command[rows].any(axis=1))
    error = seen[-1] - walked[-1]
    pieces = np.diff(truth[::PIECE, :2], axis=0)
    return CourseResult(
        fell=fell,
        stood=stood,
        way=float(np.linalg.norm(pieces, axis=1).sum()),
        turned=float(walked[driven[-1], 2]) if len(driven) else 0.0,
        heading_error=float(error[2]),
        place_error=math.hypot(error[0], error[1]),
        heading_sigma=heading_sigma,
    )


def _from_start(pose: FloatArray) -> FloatArray:
    """Poses (t, 3) [m, m, rad] in the frame of the first one."""
    moved = pose - pose[0]
    cos, sin = math.cos(pose[0, 2]), math.sin(pose[0, 2])
    x, y = moved[:, 0], moved[:, 1]
    return np.column_stack([cos * x + sin * y, cos * y - sin * x, moved[:, 2]])


def odometry(options: Options) -> SuiteResult:
    """Every course with every robot."""
    specs = [
        CourseSpec(
            RolloutSpec(TASKS["stand"], robot_seed=seed, noise_seed=max(0, seed), **options.trial),
            course,
            options.bias_wait,
        )
        for course in options.courses
        for seed in options.seeds
    ]
    results = parallel_map(
        walk_course, specs, jobs=options.jobs, show=options.show, label="courses"
    )
    rows: list[Measurement] = []
    lines = []
    for index, course in enumerate(options.courses):
        some = results[index * options.robots : (index + 1) * options.robots]
        rows += course_rows(course, some)
        lines.append(_line(course, some))
    columns = (
        Column("course"), Column("upright"), Column("stood", "s, longest"), Column("way", "m"),
        Column("heading off", "deg, worst"), Column("", "median"), Column("sigma", "deg"),
        Column("place off", "%, worst"), Column("", "median"), Column("turned", "deg, most"),
    )  # fmt: skip
    notes = (
        "Odometry against the truth at the end of each course, of the robots that stayed upright. "
        "Place: in percent of the way. sigma: deviation of the heading by the odometry's own "
        "covariance, median. turned: by the truth before the stop, where no turn is commanded. "
        "Each robot has its own sensor noise. stood: from the start to the first step, until the "
        "gyro's bias is known.",
    )
    return SuiteResult(tuple(rows), f"Odometry, {options.title}", (Table(columns, lines),), notes)


def course_rows(course: str, results: Sequence[CourseResult]) -> list[Measurement]:
    """The measurements of one course."""
    upright = [result for result in results if not result.fell]
    rows = [Measurement(f"{course}_upright", "robots", len(upright))]
    quantities = [
        ("heading_error", "deg", [abs(math.degrees(each.heading_error)) for each in upright]),
        ("place_error", "%", [100.0 * each.place_error / each.way for each in upright if each.way]),
        ("stood", "s", [each.stood for each in upright]),
    ]
    if _is_straight(course):
        turned = [abs(math.degrees(each.turned)) for each in upright]
        quantities.append(("turned", "deg", turned))
    for name, unit, values in quantities:
        for statistic, summary in (("worst", max), ("median", statistics.median)):
            value = float(summary(values)) if values else None
            rows.append(Measurement(f"{course}_{name}_{statistic}", unit, value))
    return rows


def _is_straight(course: str) -> bool:
    return not any(
        command.yaw
        for time in range(100)
        if (command := COURSES[course](float(time))) is not None
    )


def _line(course: str, results: Sequence[CourseResult]) -> tuple[str | float | None, ...]:
    values = {row.metric: row.value for row in course_rows(course, results)}
    upright = [result for result in results if not result.fell]
    sigma = [math.degrees(result.heading_sigma) for result in upright]
    return (
        course.replace("_", " "),
        f"{len(upright)}/{len(results)}",
        values[f"{course}_stood_worst"],
        float(statistics.median([result.way for result in upright])) if upright else None,
        values[f"{course}_heading_error_worst"],
        values[f"{course}_heading_error_median"],
        float(statistics.median(sigma)) if sigma else None,
        values[f"{course}_place_error_worst"],
        values[f"{course}_place_error_median"],
        values.get(f"{course}_turned_worst", ""),
    )


SUITE = Suite(
    name="odometry",
    title="Odometry",
    summary="pose by odometry against the truth, after the demo's tour, in curves, driven at once",
    measure=odometry,
    options=Options,
    takes=("robots",),
    quick=({"robots": 3, "courses": ("curve",)},),
)
