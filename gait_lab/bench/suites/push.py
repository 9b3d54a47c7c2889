"""The suite `push`: the largest push that is survived, in eight directions and in any phase."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.published import PLACO_PUSH
from gait_lab.bench.pushes import (
    SPEED_BOUND,
    SURVIVAL,
    TURN_BOUND,
    WATCH,
    WINDOW,
    Cell,
    PushSeries,
    directions_of,
    push_all,
    push_task,
    search_largest,
    walk_unpushed,
)
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.suite import Suite
from robot_core.errors import NaoGaitError
from sim_bridge.trials.trial import PUSH_DURATION


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `push` runs on."""

    robots: int = 5
    tasks: tuple[str, ...] = ("spot", "stand", "forward=20")
    impulses: tuple[float, ...] = option(
        (), "this impulse in N s instead of a search for the largest that is survived", "NS",
        flags=("--impulse",), parse=float, minimum=0.0, maximum=100.0,
    )  # fmt: skip
    directions: tuple[str, ...] = option(
        (), "only in this direction, e.g. left, back_right", "NAME", flags=("--direction",)
    )


def push(options: Options) -> SuiteResult:
    """Push with the given impulses, or search the ladder for the largest survived one."""
    directions = directions_of(options.directions)
    series = [
        PushSeries(text, push_task(text), closed)
        for text in options.tasks for closed in options.loops
    ]  # fmt: skip
    walk_unpushed(series, options)
    if options.impulses:
        impulses = sorted(set(options.impulses))
        push_all(
            [(each, direction, impulse)
             for each in series for direction in directions for impulse in impulses],
            options,
        )  # fmt: skip
    else:
        search_largest(series, directions, options)
    pushes = options.robots * options.phases
    notes = (
        f"Survived: no fall within {WATCH:g} s, and in the last {WINDOW:g} s of them still "
        f"stepping, within {100 * SPEED_BOUND:g} cm/s and {math.degrees(TURN_BOUND):g} deg/s of "
        "the robot's motion without a push (spot, stand: of none). Force for "
        f"{PUSH_DURATION:g} s at the torso.",
        f"largest: survived by at least {SURVIVAL:.0%}, as is every smaller one that was tried; "
        "< and >=: the end of what was tried; an empty cell was not tried.",
        "placo: one robot on a plant of its own, six phases, all survived; not measured here.",
        "x: the first quarter of the robots failed so often that the others were left out.",
        *(each.detection.note(f"{each.text}, {loop_name(each.closed_loop)}") for each in series),
    )
    return SuiteResult(
        tuple(row for each in series for row in series_rows(each, directions)),
        f"{pushes} pushes a cell ({options.phases} gait phases x robots); {options.title}",
        (_table(series, directions),), notes,
    )  # fmt: skip


def check(options: Options) -> None:
    """Raise NaoGaitError for an unknown direction, or a task that is named twice."""
    directions_of(options.directions)
    if len(set(options.tasks)) < len(options.tasks):
        raise NaoGaitError("task", ", ".join(options.tasks), "each task at most once")


def series_rows(series: PushSeries, directions: Sequence[str]) -> list[Measurement]:
    """The measurements of one series."""
    base, rows = f"push_{series.name}", []
    for direction in directions:
        name = f"{base}_{direction}"
        rows.append(Measurement(f"{name}_max", "N s", series.largest(direction)))
        for impulse, cell in series.of(direction).items():
            if not cell.given_up:
                share = 100.0 * cell.share
                rows.append(Measurement(f"{name}_{impulse:g}_survival", "%", share))
                rows.append(Measurement(f"{name}_{impulse:g}_fell", "pushes", cell.fell))
    tried = len({impulse for _, impulse in series.cells})
    walking = sum(alone.times is not None for alone in series.unpushed)
    rows.append(Measurement(f"{base}_tried", "impulses", tried))
    rows.append(Measurement(f"{base}_unpushed_upright", "robots", walking))
    return rows + series.detection.rows(base)


def _table(series: Sequence[PushSeries], directions: Sequence[str]) -> Table:
    impulses = sorted({impulse for each in series for _, impulse in each.cells})
    columns = [
        Column("task"), Column("loop"), Column("direction"), Column("largest", "N s"),
        Column("placo", "N s"), *(Column(f"{impulse:g} N s", "%", 0) for impulse in impulses),
    ]  # fmt: skip
    rows = []
    for each in series:
        for direction in directions:
            cells = each.of(direction)
            known = each.text == "spot" and direction in PLACO_PUSH
            rows.append((
                each.text, loop_name(each.closed_loop), direction, largest_text(each, direction),
                f"{PLACO_PUSH[direction]:g}" if known else "",
                *(_survival(cells.get(impulse)) for impulse in impulses),
            ))  # fmt: skip
    return Table(columns, rows)


def _survival(cell: Cell | None) -> TableCell:
    if cell is None:
        return ""
    return "x" if cell.given_up else 100.0 * cell.share


def largest_text(series: PushSeries, direction: str) -> str:
    """The largest survived impulse; with < or >= at an end of what was tried."""
    cells, largest = series.of(direction), series.largest(direction)
    if largest is None:
        return f"< {min(cells):g}"
    return f">= {largest:g}" if largest == max(cells) else f"{largest:g}"


SUITE = Suite(
    name="push",
    title="Pushes",
    summary="largest push that is survived, in eight directions and in any gait phase",
    measure=push,
    options=Options,
    takes=("robots", "tasks", "open_loop", "phases"),
    quick=(
        {"robots": 2, "phases": 4, "tasks": ("spot",)},
        {"robots": 2, "phases": 4, "tasks": ("forward=20",), "impulses": (1.25,)},
    ),
    check=check,
)
