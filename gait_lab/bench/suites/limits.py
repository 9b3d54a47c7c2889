"""The suite `limits`: commands above the limits, held arcs and square waves.

The limit speed of an axis is its largest step size over the measured duration of a step in place.
The cases are those of `config/bench/limits.yaml`.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import attrs

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import Score, median, walk_all, worst
from robot_core import schema
from robot_core.resources import share
from robot_core.schema import Group, Settings, Table
from robot_core.types import STANDSTILL, VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import STAND_TIME, TASKS, Task

JUMP = 0.001
"""[s] in which a command changes."""
SETTLE_TIME = 8.0
"""[s] from the command to the measured window: the first steps are short on purpose."""
STEPS_WINDOW = 5.0
"""[s] of steps in place that tell the duration of a step."""
_DIRECTION = schema.Sequence(schema.Number(-1.0, 1.0), 3, 3)
_FACTORS = schema.Sequence(schema.Number(0.0, 100.0), 1)


@attrs.frozen
class Square(Settings):
    """A command that changes its sign every half period."""

    direction: tuple[float, ...] = schema.field(_DIRECTION)
    factor: float = schema.number(1.0, 0.0, 100.0, "", "Of the limit speeds.")
    period: float = schema.number(1.0, 0.02, 60.0, "s", "Time from one change to the next but one.")


@attrs.frozen(kw_only=True)
class Cases(Settings):
    """What is commanded."""

    right: tuple[float, ...] = schema.field(_FACTORS, meaning="Factors within the limits.")
    above: tuple[float, ...] = schema.field(_FACTORS, meaning="Factors above them.")
    directions: dict[str, tuple[float, ...]] = schema.field(Table(_DIRECTION, 1, schema.NAME))
    squares: dict[str, Square] = schema.field(Table(Group(Square), key=schema.NAME))


CASES = Cases.from_mapping(
    schema.read_yaml(share("config", "bench", "limits.yaml"), "limits"), "limits"
)

NAMES = (*CASES.directions, *CASES.squares)


class Limits(NamedTuple):
    """Limit speeds of a robot [m/s, m/s, m/s, rad/s]."""

    forward: float
    back: float
    side: float
    turn: float

    def command(self, direction: Sequence[float], factor: float) -> VelocityCommand:
        """A direction in units of the limits, times a factor."""
        x, y, yaw = direction
        ahead = self.forward if x >= 0.0 else self.back
        return VelocityCommand(factor * x * ahead, factor * y * self.side, factor * yaw * self.turn)


def limits_of(options: Options) -> Limits:
    """From the step sizes and from steps in place of the first robot."""
    p, task = options.parameters, TASKS["spot"].lasting(STEPS_WINDOW)
    metrics = rollout(RolloutSpec(task, robot_seed=options.seed, **options.trial)).metrics
    step = metrics.duration / max(1, metrics.support_changes)
    return Limits(
        p.step_forward_max / step,
        p.step_backward_max / step,
        0.5 * p.step_side_max / step,
        0.5 * p.step_turn_max / step,
    )


def held(name: str, command: VelocityCommand, window: float) -> Task:
    """A command at once from standing; the axis is that of the speed to compare."""
    axis = "x" if command.x else "y" if command.y else "yaw"
    knots = ((STAND_TIME, STANDSTILL), (STAND_TIME + JUMP, command))
    start = STAND_TIME + SETTLE_TIME
    return Task(name, knots, start, start + window, axis)


def square(name: str, limits: Limits, wave: Square, window: float) -> Task:
    """A command forth and back from standing."""
    end = STAND_TIME + SETTLE_TIME + window
    knots, time, factor = [(STAND_TIME, STANDSTILL)], STAND_TIME, wave.factor
    while time < end:
        command = limits.command(wave.direction, factor)
        knots.append((time + JUMP, command))
        time += 0.5 * wave.period
        knots.append((time, command))
        factor = -factor
    return Task(name, tuple(knots), STAND_TIME + SETTLE_TIME, end)


def falls(scores: Sequence[Score]) -> int:
    """Robots that fell."""
    return sum(len(each.results) - len(each.upright) for each in scores)


def direction_rows(name: str, right: Sequence[Score], above: Sequence[Score]) -> list[Row]:
    """Medians over the robots: the best speed asked rightly, the least one reached above."""
    unit = right[0].unit
    best = max(_medians(right), default=None)
    reached_above = _medians(above)
    least = min(reached_above) if len(reached_above) == len(above) else None
    reached = least / best if best and least is not None else None
    return rows_of(
        name,
        ("runs", "runs", sum(len(each.results) for each in (*right, *above))),
        ("falls", "runs", falls((*right, *above))),
        ("best_within", unit, best),
        ("least_above", unit, least),
        ("speed_share", "", reached),
        ("slip_worst", "cm/s", worst(each.over(max, "slip_speed", 100.0) for each in above)),
    )


@suite(
    "limits", "Commands above the limits",
    "commands of up to five times the limits in all directions, arcs, square waves",
    options={
        "robots": 20, "window": 8.0, "resume": ...,
        "cases": Option(NAMES, "only this one", "NAME", ("--case",), choices=NAMES),
    },
    quick=({"robots": 2, "window": 4.0},),
)  # fmt: skip
def limits(options: Options) -> Iterator[Row | str]:
    """Every direction within and above the limits, then the square waves."""
    options, found = options.but(open_loop="off"), limits_of(options)
    factors = (*CASES.right, *CASES.above)
    directions = {name: each for name, each in CASES.directions.items() if name in options.cases}
    squares = {name: each for name, each in CASES.squares.items() if name in options.cases}
    tasks = [
        held(f"{name}_{factor:g}", found.command(direction, factor), options.window)
        for name, direction in directions.items() for factor in factors
    ]  # fmt: skip
    waves = [
        square(name, found, wave, options.window) for name, wave in squares.items()
    ]
    (scores,) = walk_all(options, [*tasks, *waves])
    shares: list[float | None] = []
    split, each = len(CASES.right), len(factors)
    for index, name in enumerate(directions):
        mine = scores[index * each : (index + 1) * each]
        rows = direction_rows(name, mine[:split], mine[split:])
        shares += [row.value for row in rows if row.quantity == "speed_share"]
        yield from rows
    for score in scores[len(tasks) :]:
        yield from _square_rows(score)
    known = [value for value in shares if value is not None]
    lowest = min(known, default=None) if len(known) == len(shares) else None
    yield Row("limits", "runs", "runs", sum(len(score.results) for score in scores))
    yield Row("limits", "falls", "runs", falls(scores))
    yield Row("limits", "speed_share", "", lowest)
    yield (
        f"Limit speeds: {100 * found.forward:.1f} ahead, {100 * found.back:.1f} back, "
        f"{100 * found.side:.1f} cm/s to the side, {found.turn:.2f} rad/s; commanded at once. "
        f"Speeds of the first axis of a direction, medians over the robots. Within: "
        f"{_listed(CASES.right)} times, above: {_listed(CASES.above)} times the limits."
    )


def _medians(scores: Sequence[Score]) -> list[float]:
    """Median speed over the robots, of each task that a robot walked upright."""
    return [speed for each in scores if (speed := median(each.speeds)) is not None]


def _square_rows(score: Score) -> list[Row]:
    """Falls of a square wave, and how far it drifts although its mean is 0."""
    return rows_of(
        score.name,
        ("runs", "runs", len(score.results)),
        ("falls", "runs", falls([score])),
        *((row.quantity, row.unit, row.value) for row in score.rows("drift_worst")),
        ("yaw_drift_worst", "deg/s", score.over(max, "turn_rate", math.degrees(1.0))),
    )


def _listed(factors: Sequence[float]) -> str:
    return ", ".join(f"{each:g}" for each in factors)
