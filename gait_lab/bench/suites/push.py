"""The suite `push`: the largest push that is survived, from eight sides and in any gait phase."""

import math
from collections.abc import Sequence

from gait_lab.bench.anchors import PLACO_PUSH
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.push_cells import (
    SPEED_BOUND,
    SURVIVAL,
    TURN_BOUND,
    WATCH,
    WINDOW,
    Cell,
    Kind,
    directions_of,
    push_all,
    push_task,
    walk_unpushed,
)
from gait_lab.bench.push_search import search_largest
from gait_lab.bench.report import Report, Row, loop_name, number, table
from gait_lab.trials.trial import PUSH_DURATION
from nao_lipm_gait.errors import NaoGaitError

SUITE = "push"
TASKS = ("spot", "stand", "forward=20")


def push(options: BenchOptions) -> Report:
    """Push the robots at the asked impulses, or search the ladder for the largest survived one."""
    directions = directions_of(options.directions)
    kinds = [
        Kind(text, push_task(text), closed) for text in options.tasks for closed in options.loops
    ]
    if len({kind.name for kind in kinds}) < len(kinds):
        raise NaoGaitError("task", ", ".join(options.tasks), "each task at most once")
    walk_unpushed(kinds, options)
    if options.impulses:
        impulses = sorted(set(options.impulses))
        everything = [
            (kind, direction, impulse)
            for kind in kinds for direction in directions for impulse in impulses
        ]  # fmt: skip
        push_all(everything, options)
    else:
        search_largest(kinds, directions, options)
    rows = [row for kind in kinds for row in _rows(kind, directions)]
    return Report(tuple(rows), _text(kinds, directions, options))


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
