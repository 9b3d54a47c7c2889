"""Pushes from one side with one impulse, in any gait phase: who survives them.

A push is a force on the torso for 0.1 s; its direction is relative to the robot's heading at that
moment. The phases are spread evenly over one cycle of two steps, found for each robot in a rollout
without a push. Every push has a rollout of its own, the same as that one up to the push.

A robot survives if it does not fall within `WATCH` s of the push, and over the last `WINDOW` s of
them moves as asked again: still stepping, its mean velocity within `SPEED_BOUND` and its turning
within `TURN_BOUND` of what it was to be. While walking that is its own motion without a push; on
the spot and standing, it is none.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gait_lab.analysis.metrics import Metrics
from gait_lab.analysis.trace import LEFT, Trace
from gait_lab.bench.falls import FallDetection
from gait_lab.bench.options import BenchOptions
from gait_lab.trials.parallel import parallel_map
from gait_lab.trials.rollout import RolloutResult, RolloutSpec, rollout, run_all
from gait_lab.trials.tasks import STAND_TIME, Task, find_task
from gait_lab.trials.trial import Push, Walker
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import STANDSTILL

DIRECTIONS: Mapping[str, float] = {
    "forward": 0.0, "forward_left": 45.0, "left": 90.0, "back_left": 135.0,
    "back": 180.0, "back_right": 225.0, "right": 270.0, "forward_right": 315.0,
}  # fmt: skip
"""Where the force points [deg], counter-clockwise from the heading."""
SURVIVAL = 0.95
"""Share of the pushes that has to be survived."""
RAMP_TIME = 1.0
"""From stepping to the asked speed [s]."""
WARM_UP = 2.5
"""The robot walks this long before the cycle in which it is pushed [s]."""
CYCLE_MAX = 1.2
"""Time in which a cycle has to begin and end [s]."""
STAND_CYCLE = 0.5
"""The pushes are spread over this time where there is no cycle [s]."""
WATCH, WINDOW = 5.0, 2.0
SPEED_BOUND = 0.06
"""[m/s]"""
TURN_BOUND = math.radians(20.0)
"""[rad/s]"""


@dataclass(frozen=True, slots=True)
class Unpushed:
    """One robot that nobody pushes."""

    times: tuple[float, ...] | None
    """When the pushes begin [s since the start]; None if it falls or does not step."""
    metrics: Metrics
    """Over the time in which a pushed robot is judged."""


@dataclass(slots=True)
class Cell:
    """All robots and phases of one impulse from one side."""

    survived: int = 0
    pushed: int = 0
    fell: int = 0
    given_up: bool = False
    """Too many of the first robots were lost for the rest to matter."""

    @property
    def share(self) -> float:
        return self.survived / self.pushed

    @property
    def passes(self) -> bool:
        return self.share >= SURVIVAL and not self.given_up


@dataclass(slots=True)
class Kind:
    """One task in closed or open loop: what was pushed, and what came of it."""

    text: str
    task: Task
    closed_loop: bool
    unpushed: list[Unpushed] = field(default_factory=list)
    cells: dict[tuple[str, float], Cell] = field(default_factory=dict)
    detection: FallDetection = field(default_factory=FallDetection)
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None
    """What walks in the gait's place."""

    @property
    def name(self) -> str:
        name = self.text.replace("=", "_")
        return name if self.closed_loop else f"{name}_open_loop"

    def of(self, direction: str) -> dict[float, Cell]:
        """Cells of a direction by rising impulse [N s]."""
        found = {key[1]: cell for key, cell in self.cells.items() if key[0] == direction}
        return dict(sorted(found.items()))

    def largest(self, direction: str) -> float | None:
        """The largest impulse that is survived, with every tried one below it; None if none is."""
        best = None
        for impulse, cell in self.of(direction).items():
            if not cell.passes:
                break
            best = impulse
        return best


def push_cells(
    options: BenchOptions,
    text: str,
    wanted: Sequence[tuple[str, float]],
    *,
    label: str,
    walker: Callable[[RobotDescription, Task, float], Walker] | None = None,
) -> Kind:
    """What came of these directions and impulses [N s], for one task in closed loop."""
    kind = Kind(text, push_task(text), True, walker=walker)
    walk_unpushed([kind], options)
    push_all([(kind, direction, impulse) for direction, impulse in wanted], options, label=label)
    return kind


def directions_of(names: Sequence[str]) -> tuple[str, ...]:
    """These directions, once each; all eight if there are none."""
    for name in names:
        if name not in DIRECTIONS:
            raise NaoGaitError("direction", name, f"one of {', '.join(DIRECTIONS)}")
    return tuple(dict.fromkeys(names or DIRECTIONS))


def push_task(text: str) -> Task:
    """The task up to the last push and its aftermath, measured where a robot is judged."""
    task = find_task(text)
    knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + RAMP_TIME, task.command))
    begin = STAND_TIME + WARM_UP
    return Task(
        task.name, knots, begin + WATCH - WINDOW, begin + CYCLE_MAX + WATCH, task.axis
    )


def _spec(kind: Kind, options: BenchOptions, seed: int) -> RolloutSpec:
    return RolloutSpec(
        task=kind.task,
        robot_seed=seed,
        parameters=options.loop_parameters(kind.closed_loop),
        plant=options.plant,
        plant_options=options.plant_options,
        urdf=options.urdf,
        engine=options.engine,
        keep_trace=True,
        walker=kind.walker,
    )


def walk_unpushed(kinds: Sequence[Kind], options: BenchOptions) -> None:
    """Fill in each kind's `unpushed`, one per robot."""
    specs = [(_spec(kind, options, seed), options.phases) for kind in kinds
             for seed in options.seeds]  # fmt: skip
    found = parallel_map(
        _unpushed, specs, jobs=options.jobs, show=options.show, label="without a push"
    )
    for index, kind in enumerate(kinds):
        kind.unpushed = found[index * options.robots : (index + 1) * options.robots]


def _unpushed(asked: tuple[RolloutSpec, int]) -> Unpushed:
    spec, phases = asked
    result = rollout(spec)
    trace = result.trace
    if trace is None or result.metrics.fell:
        return Unpushed(None, result.metrics)
    standing = spec.task.command.is_zero
    begin = STAND_TIME + WARM_UP
    cycle = (begin, begin + STAND_CYCLE) if standing else cycle_after(trace, begin)
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
    # What the gait says belongs to the frame that it answers.
    times = (trace.status_stamp[rows] - trace.stamp[0]) * 1e-9
    times = times[(times >= begin) & (times <= begin + CYCLE_MAX)]
    return (float(times[0]), float(times[1])) if len(times) > 1 else None


def push_all(
    wanted: Iterable[tuple[Kind, str, float]],
    options: BenchOptions,
    robots: slice = slice(None),
    *,
    label: str = "pushes",
) -> None:
    """Run every phase of these robots in these cells and count what survives."""
    specs: list[RolloutSpec] = []
    owners: list[tuple[Kind, Cell, Unpushed]] = []
    for kind, direction, impulse in wanted:
        cell = kind.cells.setdefault((direction, impulse), Cell())
        for seed, alone in zip(options.seeds[robots], kind.unpushed[robots], strict=True):
            if alone.times is None:
                # It does not even walk unpushed: lost in all phases.
                cell.pushed += options.phases
                cell.fell += options.phases
                continue
            for time in alone.times:
                specs.append(_pushed(kind, options, seed, time, impulse, direction))
                owners.append((kind, cell, alone))
    results = run_all(specs, jobs=options.jobs, show=options.show, label=label)
    for (kind, cell, alone), result in zip(owners, results, strict=True):
        cell.pushed += 1
        cell.fell += result.metrics.fell
        cell.survived += survives(result, alone.metrics)
        kind.detection.add(result.metrics)


def _pushed(
    kind: Kind, options: BenchOptions, seed: int, time: float, impulse: float, direction: str
) -> RolloutSpec:
    task = kind.task.measured(time + WATCH - WINDOW, time + WATCH)
    act = Push(time, impulse, math.radians(DIRECTIONS[direction]))
    return replace(_spec(kind, options, seed), task=task, push=act, keep_trace=False)


def survives(result: RolloutResult, unpushed: Metrics) -> bool:
    """No fall, and motion as asked again; see the module for the bounds."""
    metrics, task = result.metrics, result.spec.task
    if metrics.fell:
        return False
    if task.command.is_zero:
        stays, x, y, turn = True, 0.0, 0.0, 0.0
    else:
        stays = metrics.support_changes > 0
        x, y, turn = 0.0, 0.0, 0.0
        if task.axis is not None:
            x, y, turn = unpushed.speed_x, unpushed.speed_y, unpushed.turn_rate
    return (
        stays
        and math.hypot(metrics.speed_x - x, metrics.speed_y - y) <= SPEED_BOUND
        and abs(metrics.turn_rate - turn) <= TURN_BOUND
    )
