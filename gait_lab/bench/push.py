"""The suite `push`: the largest push that the robots survive, from eight sides, in any gait phase.

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

from gait_lab.bench.anchors import PLACO_PUSH
from gait_lab.bench.falls import FallDetection
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, number, table
from gait_lab.metrics import LEFT, Metrics, Trace
from gait_lab.rollout import (
    PUSH_DURATION,
    Push,
    RolloutResult,
    RolloutSpec,
    Walker,
    parallel_map,
    rollout,
    run_all,
)
from gait_lab.tasks import STAND_TIME, Task, find_task
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription
from nao_lipm_gait.signals import STANDSTILL

SUITE = "push"
TASKS = ("spot", "stand", "forward=20")
DIRECTIONS: Mapping[str, float] = {
    "forward": 0.0, "forward_left": 45.0, "left": 90.0, "back_left": 135.0,
    "back": 180.0, "back_right": 225.0, "right": 270.0, "forward_right": 315.0,
}  # fmt: skip
"""Where the force points [deg], counter-clockwise from the heading."""
LADDER = tuple(0.25 * step for step in range(3, 15))
"""Impulses among which the largest survived one is looked for [N s]."""
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


def push(options: BenchOptions) -> Report:
    """Push the robots at the asked impulses, or search the ladder for the largest survived one."""
    directions = directions_of(options.directions)
    kinds = [
        Kind(text, push_task(text), closed) for text in options.tasks for closed in options.loops
    ]
    if len({kind.name for kind in kinds}) < len(kinds):
        raise NaoGaitError("task", ", ".join(options.tasks), "each task at most once")
    _walk_unpushed(kinds, options)
    if options.impulses:
        impulses = sorted(set(options.impulses))
        everything = [
            (kind, direction, impulse)
            for kind in kinds for direction in directions for impulse in impulses
        ]  # fmt: skip
        _push_all(everything, options)
    else:
        _search(kinds, directions, options)
    rows = [row for kind in kinds for row in _rows(kind, directions)]
    return Report(tuple(rows), _text(kinds, directions, options))


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
    _walk_unpushed([kind], options)
    _push_all([(kind, direction, impulse) for direction, impulse in wanted], options, label=label)
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


# -- without a push --------------------------------------------------------------------------------


def _walk_unpushed(kinds: Sequence[Kind], options: BenchOptions) -> None:
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


# -- with pushes -----------------------------------------------------------------------------------


def _push_all(
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


def _push_until_lost(wanted: Sequence[tuple[Kind, str, float]], options: BenchOptions) -> None:
    """`_push_all`, but the later robots only where the first ones leave a chance to pass."""
    first = max(1, options.robots // 4)
    bearable = int((1.0 - SURVIVAL) * options.robots * options.phases + 1e-9)
    _push_all(wanted, options, slice(first))
    left = []
    for kind, direction, impulse in wanted:
        cell = kind.cells[direction, impulse]
        if cell.pushed - cell.survived <= bearable:
            left.append((kind, direction, impulse))
        else:
            cell.given_up = first < options.robots
    if left and first < options.robots:
        _push_all(left, options, slice(first, None))


def _search(kinds: Sequence[Kind], directions: Sequence[str], options: BenchOptions) -> None:
    """Bisect the ladder in every direction, all of them in the same rounds."""
    # Index of the largest impulse that passes and of the smallest that does not.
    spans = {(index, direction): (-1, len(LADDER)) for index in range(len(kinds))
             for direction in directions}  # fmt: skip
    while True:
        asked = {key: (low + high) // 2 for key, (low, high) in spans.items() if high - low > 1}
        if not asked:
            return
        _push_until_lost(
            [(kinds[index], direction, LADDER[step])
             for (index, direction), step in asked.items()],
            options,
        )  # fmt: skip
        for key, step in asked.items():
            index, direction = key
            low, high = spans[key]
            passes = kinds[index].cells[direction, LADDER[step]].passes
            spans[key] = (step, high) if passes else (low, step)


# -- report ----------------------------------------------------------------------------------------


def _rows(kind: Kind, directions: Sequence[str]) -> list[Row]:
    rows = []
    for direction in directions:
        base = f"push_{kind.name}_{direction}"
        rows.append(Row(SUITE, f"{base}_max", "N s", kind.largest(direction)))
        for impulse, cell in kind.of(direction).items():
            name = f"{base}_{impulse:g}"
            if cell.given_up:
                continue
            rows.append(Row(SUITE, f"{name}_survival", "%", 100.0 * cell.share))
            rows.append(Row(SUITE, f"{name}_fell", "pushes", cell.fell))
    tried = len({impulse for _, impulse in kind.cells})
    rows.append(Row(SUITE, f"push_{kind.name}_tried", "impulses", tried))
    walking = sum(alone.times is not None for alone in kind.unpushed)
    rows.append(Row(SUITE, f"push_{kind.name}_unpushed_upright", "robots", walking))
    rows += kind.detection.rows(SUITE, f"push_{kind.name}")
    return rows


def _text(kinds: Sequence[Kind], directions: Sequence[str], options: BenchOptions) -> str:
    impulses = sorted({impulse for kind in kinds for _, impulse in kind.cells})
    lines: list[tuple[str, ...]] = [
        ("task", "loop", "direction", "largest", "placo",
         *(f"{impulse:g}" for impulse in impulses)),
        ("", "", "", "N s", "N s", *("%" for _ in impulses)),
    ]  # fmt: skip
    for kind in kinds:
        for direction in directions:
            cells = kind.of(direction)
            lines.append(
                (
                    kind.text,
                    loop_name(kind.closed_loop),
                    direction,
                    _largest_text(kind, direction),
                    f"{PLACO_PUSH[direction]:g}"
                    if kind.text == "spot" and direction in PLACO_PUSH
                    else "",
                    *(_cell_text(cells.get(impulse)) for impulse in impulses),
                )
            )
    pushes = options.robots * options.phases
    title = f"{pushes} pushes a cell ({options.phases} gait phases x robots); {options.title}"
    notes = (
        f"Survived: no fall within {WATCH:g} s, and in the last {WINDOW:g} s of them still "
        f"stepping, within {100 * SPEED_BOUND:g} cm/s and",
        f"{math.degrees(TURN_BOUND):g} deg/s of the robot's motion without a push (spot, stand: "
        f"of none). Force for {PUSH_DURATION:g} s at the torso.",
        f"largest: survived by at least {SURVIVAL:.0%}, as every smaller one that was tried; "
        "< and >=: the end of what was tried.",
        "placo: one robot on a plant of its own, six phases, all survived.",
        "x: too many of the first quarter of the robots were lost; the others were not pushed.",
    )
    detection = [
        f"{kind.text}, {loop_name(kind.closed_loop)}: {kind.detection.text}" for kind in kinds
    ]
    return "\n".join((title, "", table(lines), "", *notes, "", "Fall detection", *detection))


def _cell_text(cell: Cell | None) -> str:
    if cell is None:
        return ""
    return "x" if cell.given_up else number(100.0 * cell.share, 0)


def _largest_text(kind: Kind, direction: str) -> str:
    cells, largest = kind.of(direction), kind.largest(direction)
    if largest is None:
        return f"< {min(cells):g}"
    return f">= {largest:g}" if largest == max(cells) else f"{largest:g}"
