"""The suite `push`: the largest push that is survived, in eight directions and in any phase."""

import math
from collections.abc import Iterator

from gait_lab.bench.options import Option, Options
from gait_lab.bench.pushes import (
    LADDER,
    SPEED_BOUND,
    SURVIVAL,
    TURN_BOUND,
    WATCH,
    WINDOW,
    PushSeries,
    directions_of,
    impulse_step,
    push_all,
    search_largest,
    walk_unpushed,
)
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from robot_core.errors import NaoGaitError
from sim_bridge.trials.trial import PUSH_DURATION


def check(options: Options) -> None:
    """Raise NaoGaitError for an unknown direction, or a task that is named twice."""
    directions_of(options.directions)
    if len(set(options.tasks)) < len(options.tasks):
        raise NaoGaitError("task", ", ".join(options.tasks), "each task at most once")


@suite(
    "push", "Pushes", "largest push that is survived, in eight directions and in any gait phase",
    options={
        "robots": 5, "tasks": ("spot", "stand", "forward=20"), "open_loop": ..., "phases": ...,
        "impulses": Option(
            (), "this impulse in N s instead of a search for the largest that is survived", "NS",
            ("--impulse",), float, minimum=0.0, maximum=100.0,
        ),
        "directions": Option(
            (), "only pushes towards this side of the robot, e.g. left, back_right", "NAME",
            ("--direction",),
        ),
    },
    quick=(
        {"robots": 2, "phases": 4, "tasks": ("spot",)},
        {"robots": 2, "phases": 4, "tasks": ("forward=20",), "impulses": (1.25,)},
    ),
    check=check,
)  # fmt: skip
def push(options: Options) -> Iterator[Row | str]:
    """Push with the given impulses, or search the ladder for the largest survived one."""
    directions, step = directions_of(options.directions), impulse_step(options.urdf)
    series = [PushSeries(text, closed) for text in options.tasks for closed in options.loops]
    walk_unpushed(series, options)
    if options.impulses:
        wanted = [(each, direction, impulse) for each in series for direction in directions
                  for impulse in sorted(set(options.impulses))]  # fmt: skip
        push_all(wanted, options)
    else:
        search_largest(series, directions, options, [step * each for each in LADDER])
    for each in series:
        base = f"push_{each.name}"
        for direction in directions:
            name = f"{base}_{direction}"
            yield Row(name, "max", "N s", each.largest(direction))
            for impulse, cell in each.of(direction).items():
                if not cell.given_up:
                    yield Row(name, f"{impulse:g}_survival", "%", 100.0 * cell.share)
                    yield Row(name, f"{impulse:g}_fell", "pushes", cell.fell)
    for each in series:
        walking = sum(alone.times is not None for alone in each.unpushed)
        tried = len({impulse for _, impulse in each.cells})
        yield from rows_of(f"push_{each.name}", ("tried", "impulses", tried),
                           ("unpushed_upright", "robots", walking))  # fmt: skip
        yield from each.detection.rows(f"push_{each.name}")
    yield (
        f"Survived: no fall within {WATCH:g} s, and in the last {WINDOW:g} s of them still "
        f"stepping, within {100 * SPEED_BOUND:g} cm/s and {math.degrees(TURN_BOUND):g} deg/s (of a "
        "robot as large as a NAO) of its motion without a push (spot, stand: of none). Force for "
        f"{PUSH_DURATION:g} s at the torso. Max: survived by at least {SURVIVAL:.0%} of the pushes "
        "(phases x robots), as is every smaller one that was tried; tried in steps of "
        f"{step:g} N s, --impulse tries others."
    )
