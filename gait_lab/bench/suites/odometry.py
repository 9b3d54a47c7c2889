"""The suite `odometry`: the robot's own pose against the truth, after courses of several walks.

Each course begins as over ROS: the robot stands until the bias of its gyro is known. Each robot has
its own sensor noise.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median, worst
from gait_lab.demo.tour import FULL_TOUR, phase_at
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.runtime.commands import LONGEST_BIAS_WAIT, BiasWait
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trace import Recorder, Trace, from_start
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
STRAIGHT = ("driven", "forward", "diagonal")
"""Courses without a commanded turn."""


@dataclass(frozen=True, slots=True)
class CourseResult:
    """What became of one course.

    Attributes:
        stood: [s] that it stood before the walk.
        way: [m] that it walked.
        turned: [rad] by which it had turned at the last command, by the truth.
        heading_error: [rad] odometry minus truth at the end.
        place_error: [m] distance of the odometry's place from the truth at the end.
    """

    stood: float
    way: float
    turned: float
    heading_error: float
    place_error: float


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


def walk_course(asked: tuple[RolloutSpec, str, float]) -> CourseResult | None:
    """Walk a course after a stand of at most some seconds; None after a fall."""
    spec, course, longest = asked
    world, gait = make_pair(spec)
    policy = _AfterBiasWait(gait, COURSES[course], longest)
    recorder = Recorder()
    with world:
        for tick in run(world, gait, policy):
            recorder.add(tick.truth, tick.command, tick.status)
    return None if tick.fallen else evaluate(recorder.trace(), policy.began or 0.0)


def evaluate(trace: Trace, stood: float) -> CourseResult:
    """Compare odometry and truth from the walk's beginning, `stood` [s] in, to the trace's end."""
    known = np.flatnonzero(trace.status_stamp >= trace.stamp[0])
    begin = known[np.searchsorted(trace.time[known], stood)]
    rows = np.searchsorted(trace.stamp, trace.status_stamp[begin:])
    odometry = trace.odometry[begin:].copy()
    odometry[:, 2] = np.unwrap(odometry[:, 2])
    yaw = np.unwrap(trace.sole_yaw, axis=0).mean(axis=1)
    truth = np.column_stack([trace.sole_position[:, :, :2].mean(axis=1), yaw])[rows]
    walked, seen = from_start(truth), from_start(odometry)
    driven = np.flatnonzero(trace.command[rows].any(axis=1))
    error = seen[-1] - walked[-1]
    pieces = np.diff(truth[::PIECE, :2], axis=0)
    return CourseResult(
        stood=stood,
        way=float(np.linalg.norm(pieces, axis=1).sum()),
        turned=float(walked[driven[-1], 2]) if len(driven) else 0.0,
        heading_error=float(error[2]),
        place_error=math.hypot(error[0], error[1]),
    )


@suite(
    "odometry", "Odometry",
    "pose by odometry against the truth, after the demo's tour, in curves, driven at once",
    options={
        "robots": ...,
        "courses": Option(tuple(COURSES), "walk this", "NAME", ("--course",),
                          choices=tuple(COURSES)),
        "bias_wait": Option(
            LONGEST_BIAS_WAIT, "longest stand [s] until the gyro's bias is known", "T",
            minimum=0.0, maximum=60.0,
        ),
    },
    quick=({"robots": 3, "courses": ("curve",)},),
)  # fmt: skip
def odometry(options: Options) -> Iterator[Row | str]:
    """Every course with every robot."""
    specs = [
        (RolloutSpec(TASKS["stand"], robot_seed=seed, noise_seed=max(0, seed), **options.trial),
         course, options.bias_wait)
        for course in options.courses for seed in options.seeds
    ]  # fmt: skip
    results = options.map(walk_course, specs, label="courses")
    for course, some in zip(options.courses, options.by_robots(results), strict=True):
        upright: list[CourseResult] = [each for each in some if each is not None]
        yield Row(course, "upright", "robots", len(upright))
        quantities = {
            "heading_error": ("deg", [abs(math.degrees(each.heading_error)) for each in upright]),
            "place_error": ("%", [100.0 * each.place_error / each.way
                                  for each in upright if each.way]),
            "stood": ("s", [each.stood for each in upright]),
        }  # fmt: skip
        if course in STRAIGHT:
            turned = [abs(math.degrees(each.turned)) for each in upright]
            quantities["turned"] = ("deg", turned)
        for name, (unit, values) in quantities.items():
            yield Row(course, f"{name}_worst", unit, worst(values))
            yield Row(course, f"{name}_median", unit, median(values))
    yield (
        "Odometry against the truth at the end of each course, of the robots that stayed upright. "
        "Place: of the way. Turned: by the truth before the stop, where no turn is commanded. "
        "Stood: until the gyro's bias is known."
    )
