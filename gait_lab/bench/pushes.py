"""Pushes in any gait phase: which are survived, and the search for the largest one.

A push is a force on the torso for 0.1 s; its direction is relative to the robot's heading at that
moment. The phases are spread evenly over one cycle of two steps, which a rollout without a push
gives for each robot. Every push has a rollout of its own, equal to that one up to the push.

A robot survives if it does not fall within `WATCH` s of the push, and over the last `WINDOW` s of
them moves as commanded again: still stepping, its mean velocity within `SPEED_BOUND` and its turn
rate within `TURN_BOUND` of the reference, both scaled with its size. While walking, the reference
is the robot's own motion without a push; on the spot and standing, it is zero.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gait_lab.bench.options import Options
from gait_lab.bench.rows import Row
from gait_lab.bench.walks import FallDetection, Variant
from nao_lipm_gait.whole_body.body_model import BodyModel
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL
from sim_bridge.trials.metrics import Metrics
from sim_bridge.trials.rollout import RolloutResult, RolloutSpec, rollout, run_all
from sim_bridge.trials.tasks import STAND_TIME, Task, find_task
from sim_bridge.trials.trace import LEFT, Trace
from sim_bridge.trials.trial import Push, loaded_robot

DIRECTIONS: Mapping[str, float] = {
    "forward": 0.0, "forward_left": 45.0, "left": 90.0, "back_left": 135.0,
    "back": 180.0, "back_right": 225.0, "right": 270.0, "forward_right": 315.0,
}  # fmt: skip
"""Where the force points [deg], counter-clockwise from the heading."""
SURVIVAL = 0.95
"""Share of the pushes that has to be survived."""
LADDER = range(3, 15)
"""Impulses in steps of `impulse_step`, among which the largest survived one is searched."""
STEP = 0.0512
"""[N s/kg] Of the robot, rounded to two digits: 0.25 N s for a NAO V3.3."""
RAMP_TIME = 1.0
"""[s] from stepping to the commanded speed."""
WARM_UP = 2.5
"""[s] of walking before the cycle with the push."""
LATEST = 1.2
"""[s] after the warm-up up to which, and `WATCH`, a walk without a push goes on."""
CYCLE_MAX = 2.5
"""[s] in which a cycle has to begin and end; one of a T1 takes 0.8."""
STAND_CYCLE = 0.5
"""[s] over which the pushes are spread where there is no cycle."""
WATCH, WINDOW = 5.0, 2.0
"""[s] after a push, and of these at the end, in which survival is decided."""
SPEED_BOUND = 0.06
"""[m/s] of a robot of the NAO's size."""
TURN_BOUND = math.radians(20.0)
"""[rad/s] of a robot of the NAO's size."""


@dataclass(frozen=True, slots=True)
class Unpushed:
    """A rollout of one robot without a push.

    Attributes:
        times: [s since the start] when the pushes begin; None if it falls, does not step or was not
            calibrated as it should be.
        metrics: Over the time in which the survival of a push is decided.
    """

    times: tuple[float, ...] | None
    metrics: Metrics


@dataclass(slots=True)
class Cell:
    """All robots and phases of one impulse in one direction.

    Attributes:
        given_up: The first robots failed so often that the others were not pushed.
    """

    survived: int = 0
    pushed: int = 0
    fell: int = 0
    given_up: bool = False

    @property
    def share(self) -> float:
        """Of the pushes that were survived."""
        return self.survived / self.pushed

    @property
    def passes(self) -> bool:
        """Whether enough pushes were survived."""
        return self.share >= SURVIVAL and not self.given_up


@dataclass(slots=True)
class PushSeries:
    """The pushes during one task, of one variant in closed or open loop.

    Attributes:
        text: The task as `name` or `name=speed`.
        only_falls: A push is survived without a fall, however the robot moves then.
        unpushed: The rollouts without a push, one per robot.
        cells: Direction and impulse [N s] -> results.
    """

    text: str
    closed_loop: bool = True
    variant: Variant = field(default_factory=Variant)
    only_falls: bool = False
    unpushed: list[Unpushed] = field(default_factory=list)
    cells: dict[tuple[str, float], Cell] = field(default_factory=dict)
    detection: FallDetection = field(default_factory=FallDetection)

    @property
    def name(self) -> str:
        """The task and the loop, as in the name of a metric."""
        name = self.text.replace("=", "_")
        return name if self.closed_loop else f"{name}_open_loop"

    @property
    def task(self) -> Task:
        """The task without a push, measured where the survival of one is decided."""
        task = find_task(self.text)
        knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + RAMP_TIME, task.command))
        begin = STAND_TIME + WARM_UP
        return Task(
            task.name, knots, begin + WATCH - WINDOW, begin + LATEST + WATCH, task.axis
        )

    def of(self, direction: str) -> dict[float, Cell]:
        """The cells of a direction by increasing impulse [N s]."""
        found = {key[1]: cell for key, cell in self.cells.items() if key[0] == direction}
        return dict(sorted(found.items()))

    def largest(self, direction: str) -> float | None:
        """The largest impulse [N s] that passes with every smaller one tried; None if none does."""
        best = None
        for impulse, cell in self.of(direction).items():
            if not cell.passes:
                break
            best = impulse
        return best

    def survival_rows(self, subject: str) -> list[Row]:
        """The share of survived pushes of each cell."""
        return [
            Row(subject, f"push_{direction}_{impulse:g}_survival", "%", 100.0 * cell.share)
            for (direction, impulse), cell in self.cells.items()
        ]


def push_variants(
    options: Options, variants: Sequence[Variant], wanted: Sequence[tuple[str, float]]
) -> list[PushSeries]:
    """Push each variant on the spot, in closed loop, at directions and impulses [N s]."""
    series = [PushSeries("spot", variant=variant) for variant in variants]
    if wanted:
        walk_unpushed(series, options)
        push_all([(each, *push) for each in series for push in wanted], options)
    return series


def directions_of(names: Sequence[str]) -> tuple[str, ...]:
    """These directions, once each, or all eight if none is named; raises NaoGaitError."""
    for name in names:
        if name not in DIRECTIONS:
            raise NaoGaitError("direction", name, DIRECTIONS)
    return tuple(dict.fromkeys(names or DIRECTIONS))


def _spec(series: PushSeries, options: Options, seed: int) -> RolloutSpec:
    return series.variant.spec(options, series.closed_loop, series.task, seed)


def walk_unpushed(series: Sequence[PushSeries], options: Options) -> None:
    """Fill in `unpushed` of each series, one per robot."""
    specs = [(replace(_spec(each, options, seed), keep_trace=True), options.phases)
             for each in series for seed in options.seeds]  # fmt: skip
    found = options.map(_unpushed, specs, label="without a push")
    for each, mine in zip(series, options.by_robots(found), strict=True):
        each.unpushed = list(mine)


def _unpushed(asked: tuple[RolloutSpec, int]) -> Unpushed:
    spec, phases = asked
    result = rollout(spec)
    if result.trace is None or result.metrics.fell or result.calibration_failed:
        return Unpushed(None, result.metrics)
    standing = spec.task.command.is_zero
    begin = STAND_TIME + WARM_UP
    cycle = (begin, begin + STAND_CYCLE) if standing else cycle_after(result.trace, begin)
    if cycle is None:
        return Unpushed(None, result.metrics)
    start, end = cycle
    times = tuple(start + (end - start) * phase / phases for phase in range(phases))
    return Unpushed(times, result.metrics)


def cycle_after(trace: Trace, begin: float) -> tuple[float, float] | None:
    """The first whole cycle of two steps from `begin` on: two changes to the left support leg [s].

    None if there is none within `CYCLE_MAX`.
    """
    rows = np.flatnonzero((trace.support[1:] == LEFT) & (trace.support[:-1] != LEFT)) + 1
    # The status of the gait belongs to the frame that it answers.
    times = (trace.status_stamp[rows] - trace.stamp[0]) * 1e-9
    times = times[(times >= begin) & (times <= begin + CYCLE_MAX)]
    return (float(times[0]), float(times[1])) if len(times) > 1 else None


def push_all(
    wanted: Iterable[tuple[PushSeries, str, float]],
    options: Options,
    robots: slice = slice(None),
) -> None:
    """Push in every phase and count what is survived.

    Args:
        wanted: Series, direction and impulse [N s] of each cell.
        options: Robots, phases, engine, plant, parameters.
        robots: Only these of the robots.
    """
    specs: list[RolloutSpec] = []
    owners: list[tuple[PushSeries, Cell, Unpushed]] = []
    for series, direction, impulse in wanted:
        cell = series.cells.setdefault((direction, impulse), Cell())
        for seed, alone in zip(options.seeds[robots], series.unpushed[robots], strict=True):
            if alone.times is None:
                # It cannot even be tried: no phase is survived.
                cell.pushed += options.phases
                cell.fell += options.phases
                continue
            for time in alone.times:
                task = series.task.measured(time + WATCH - WINDOW, time + WATCH)
                push = Push(time, impulse, math.radians(DIRECTIONS[direction]))
                specs.append(replace(_spec(series, options, seed), task=task, push=push))
                owners.append((series, cell, alone))
    results = run_all(specs, jobs=options.jobs, label="pushes", show=options.show)
    for (series, cell, alone), result in zip(owners, results, strict=True):
        cell.pushed += 1
        cell.fell += result.metrics.fell
        stood = not result.metrics.fell
        cell.survived += stood if series.only_falls else survives(result, alone.metrics)
        series.detection.add(result.metrics)


def survives(result: RolloutResult, unpushed: Metrics) -> bool:
    """Whether the robot did not fall and moves as commanded again; the module has the bounds."""
    metrics, task = result.metrics, result.spec.task
    if metrics.fell or (not task.command.is_zero and metrics.support_changes == 0):
        return False
    x = y = turn = 0.0
    if task.axis is not None and not task.command.is_zero:
        x, y, turn = unpushed.speed_x, unpushed.speed_y, unpushed.turn_rate
    pace = math.sqrt(loaded_robot(result.spec.urdf).size)
    return (
        math.hypot(metrics.speed_x - x, metrics.speed_y - y) <= pace * SPEED_BOUND
        and abs(metrics.turn_rate - turn) <= TURN_BOUND / pace
    )


def impulse_step(urdf: str) -> float:
    """[N s] of a robot, between two impulses of the search."""
    return float(f"{STEP * BodyModel(loaded_robot(urdf)).total_mass:.2g}")


def search_largest(
    series: Sequence[PushSeries],
    directions: Sequence[str],
    options: Options,
    ladder: Sequence[float],
) -> None:
    """Bisect the ladder [N s] in every direction, all directions in the same rounds."""
    # Index of the largest impulse that passes and of the smallest that does not.
    spans = {(index, direction): (-1, len(ladder)) for index in range(len(series))
             for direction in directions}  # fmt: skip
    while True:
        asked = {key: (low + high) // 2 for key, (low, high) in spans.items() if high - low > 1}
        if not asked:
            return
        push_until_lost(
            [(series[index], direction, ladder[step])
             for (index, direction), step in asked.items()],
            options,
        )  # fmt: skip
        for (index, direction), step in asked.items():
            low, high = spans[index, direction]
            passes = series[index].cells[direction, ladder[step]].passes
            spans[index, direction] = (step, high) if passes else (low, step)


def push_until_lost(wanted: Sequence[tuple[PushSeries, str, float]], options: Options) -> None:
    """`push_all`, but the later robots only where a cell can still pass after the first ones."""
    first = max(1, options.robots // 4)
    bearable = int((1.0 - SURVIVAL) * options.robots * options.phases + 1e-9)
    push_all(wanted, options, slice(first))
    left = []
    for series, direction, impulse in wanted:
        cell = series.cells[direction, impulse]
        if cell.pushed - cell.survived <= bearable:
            left.append((series, direction, impulse))
        else:
            cell.given_up = first < options.robots
    if left and first < options.robots:
        push_all(left, options, slice(first, None))
