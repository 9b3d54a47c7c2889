"""The suite `plant`: what each ingredient of a plant does to the walk, one option at a time.

The same robots walk the same tasks on the plant as it is, and with one option at each of several
values. A value breaks the walk if a robot falls. It slows the walk if the median speed of the
robots that stayed upright is below `SLOW` times the one on the unchanged plant.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Cell as TableCell
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.score import LoopDetection, Score, Variant, walk_all
from gait_lab.bench.suite import Suite
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot
from sim_bridge.plant import PlantOption, PlantValue, load_plant, with_options
from sim_bridge.world import World

SLOW = 0.8
"""Share of the unchanged plant's speed below which a walk is slow."""
_DEGREE = math.radians(1.0)


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `plant` runs on."""

    robots: int = 2
    window: float = 5.0
    engine: str = "mujoco"
    ingredients: tuple[str, ...] = option(
        (), "vary only this, e.g. stiffness", "NAME", flags=("--ingredient",)
    )


@dataclass(frozen=True, slots=True)
class Ingredient:
    """One option of the plant and its values, the hardest to walk with last.

    Attributes:
        name: Name in metrics.
        option: Option of the plant.
        unit: Unit of the values.
        values: The values, in `unit`.
        factor: Factor from `unit` to the unit of the option.
        along: Other options that have to change for this one to count.
    """

    name: str
    option: str
    unit: str
    values: tuple[float | bool, ...]
    factor: float = 1.0
    along: tuple[PlantOption, ...] = ()

    def change(self, value: float | bool) -> tuple[PlantOption, ...]:
        """The options of the plant with this value."""
        held: PlantValue = value if isinstance(value, bool) else value * self.factor
        return (*self.along, (self.option, held))


INGREDIENTS: Mapping[str, Ingredient] = {
    ingredient.name: ingredient
    for ingredient in (
        Ingredient("dc_line", "motor.torque_speed_line", "", (False,)),
        Ingredient("torque_fraction", "motor.torque_fraction", "", (0.6, 0.5, 0.4, 0.3)),
        Ingredient("stiffness", "motor.stiffness", "N m/rad", (300.0, 150.0, 100.0, 75.0, 50.0)),
        Ingredient("play_deg", "motor.play", "deg", (1.2, 2.0, 3.0, 5.0), _DEGREE),
        Ingredient("encoder_feedback", "motor.encoder_feedback", "", (True,)),
        Ingredient("friction", "motor.friction", "N m", (0.3, 1.0, 2.0, 3.0)),
        Ingredient("armature", "motor.armature", "", (2.0, 3.0, 4.0)),
        Ingredient("delay_ms", "sensors.delay", "ms", (60.0, 80.0, 100.0, 120.0), 1e-3),
        # Otherwise every robot has its own coefficient.
        Ingredient("floor_friction", "contact.friction", "", (0.4, 0.3, 0.2, 0.15),
                   along=(("variation.friction", None),)),
        Ingredient("floor_stiffness", "contact.stiffness", "N/m", (1e5, 5e3, 2e3, 1e3)),
    )
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Level:
    """The plant with one ingredient at one value, and how the robots walked on it.

    Attributes:
        ingredient: The ingredient.
        value: Value in the unit of the ingredient.
        scores: One per task and loop.
    """

    ingredient: Ingredient
    value: float | bool
    scores: tuple[Score, ...]

    @property
    def name(self) -> str:
        """As it begins the name of a metric."""
        return f"{self.ingredient.name}_{_value_text(self.value)}"


def _value_text(value: float | bool) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if abs(value) < 1e5 else f"{value:.0f}"


def ingredients_of(names: Sequence[str]) -> tuple[Ingredient, ...]:
    """The ingredients of these names, all if none is named; raises NaoGaitError."""
    for name in names:
        if name not in INGREDIENTS:
            raise NaoGaitError("ingredient", name, f"one of {', '.join(INGREDIENTS)}")
    return tuple(INGREDIENTS[name] for name in dict.fromkeys(names or INGREDIENTS))


def check(options: Options) -> None:
    """Raise NaoGaitError for an unknown ingredient or another engine than MuJoCo."""
    ingredients_of(options.ingredients)
    if options.engine != "mujoco":
        raise NaoGaitError(
            "engine", options.engine, "mujoco for the suite plant: others lack most ingredients"
        )


def sweep(options: Options) -> SuiteResult:
    """Walk on the plant as it is, and with each ingredient at each of its values."""
    check(options)
    steps = [(ingredient, value) for ingredient in ingredients_of(options.ingredients)
             for value in ingredient.values]  # fmt: skip
    changes = [(), *(ingredient.change(value) for ingredient, value in steps)]
    require_accepted(changes, options)
    unchanged, *changed = walk_all(options, [Variant(change) for change in changes])
    levels = [
        Level(ingredient, value, tuple(scores))
        for (ingredient, value), scores in zip(steps, changed, strict=True)
    ]
    return sweep_result(unchanged, levels, options)


def require_accepted(changes: Sequence[tuple[PlantOption, ...]], options: Options) -> None:
    """Raise NaoGaitError for what the engine refuses, before the first walk."""
    robot, plant = load_robot(options.urdf), load_plant(options.plant)
    for change in changes:
        made = with_options(plant, (*options.plant_options, *change))
        World.single(robot, made, options.seed, engine=options.engine).close()


def sweep_result(
    unchanged: Sequence[Score], levels: Sequence[Level], options: Options
) -> SuiteResult:
    """The result of all walks.

    Args:
        unchanged: Scores on the plant as it is, one per task and loop.
        levels: The changed plants, values of one ingredient one after the other.
        options: What was run.

    Returns:
        Speeds on each plant, and the first value of each ingredient that breaks the walk.
    """
    rows = [row for score in unchanged for row in _rows("unchanged", score)]
    rows += [row for level in levels for score in level.scores for row in _rows(level.name, score)]
    for ingredient, of_it in _by_ingredient(levels):
        for index, score in enumerate(unchanged):
            broken = next((level.value for level in of_it if level.scores[index].fallen), None)
            value = float(broken) if isinstance(broken, bool) else broken
            metric = f"{ingredient.name}_{score.name}_breaks_at"
            rows.append(Measurement(metric, ingredient.unit, value))
    detection = LoopDetection([*unchanged, *(score for level in levels for score in level.scores)])
    notes = (
        "Median speed of the robots that stayed upright. x: a robot fell; ~: slower than "
        f"{SLOW:.0%} of the unchanged plant; !: upright, but does not count (flight, slip, contact "
        "of the legs).",
        "breaks at: the first value that fells a robot (robots upright; time of the first fall).",
        *detection.notes,
    )
    title = (
        f"{options.window:g} s at speed, {options.robots_title}, plant {options.plant_title} with "
        f"one option changed, {options.engine}, {options.urdf}"
    )
    tables = (_speed_table(unchanged, levels), _break_table(unchanged, levels))
    return SuiteResult((*rows, *detection.rows), title, tables, notes)


def _by_ingredient(levels: Sequence[Level]) -> Iterator[tuple[Ingredient, list[Level]]]:
    for _, group in groupby(levels, key=lambda level: level.ingredient.name):
        found = list(group)
        yield found[0].ingredient, found


def _rows(name: str, score: Score) -> list[Measurement]:
    base, counts = f"{name}_{score.name}", not score.faults
    rows = [
        Measurement(f"{base}_upright", "robots", score.upright),
        Measurement(f"{base}_counts", "bool", float(counts)),
    ]
    if score.task.axis:
        median = score.median
        rows.append(Measurement(f"{base}_median", score.unit, median if counts else None))
        rows.append(Measurement(f"{base}_median_of_upright", score.unit, median))
    return rows


def _speed_table(unchanged: Sequence[Score], levels: Sequence[Level]) -> Table:
    loops = list(dict.fromkeys(score.closed_loop for score in unchanged))
    columns = [Column("changed"), Column("value"), Column("loop")]
    for score in unchanged:
        if score.closed_loop == loops[0]:
            asked = "" if score.asked is None else f" {score.asked:g}"
            columns += [Column(f"{score.task.name}{asked}", "upright"), Column("", score.unit)]
    rows = [["nothing", "", loop_name(loop), *_cells(unchanged, unchanged, loop)] for loop in loops]
    for level in levels:
        value = f"{_value_text(level.value)} {level.ingredient.unit}".rstrip()
        for loop in loops:
            cells = _cells(level.scores, unchanged, loop)
            rows.append([level.ingredient.option, value, loop_name(loop), *cells])
    return Table(columns, rows)


def _cells(scores: Sequence[Score], unchanged: Sequence[Score], loop: bool) -> list[TableCell]:
    cells: list[TableCell] = []
    for score, before in zip(scores, unchanged, strict=True):
        if score.closed_loop == loop:
            speed, usual = score.median, before.median
            slow = speed is not None and usual is not None and speed < SLOW * usual
            cells.append(f"{score.short_mark}{score.upright_text}")
            cells.append(f"~{speed:.1f}" if slow else speed)
    return cells


def _break_table(unchanged: Sequence[Score], levels: Sequence[Level]) -> Table:
    rows = []
    for ingredient, of_it in _by_ingredient(levels):
        tried = ", ".join(_value_text(level.value) for level in of_it)
        for loop in dict.fromkeys(score.closed_loop for score in unchanged):
            found = [_break_text(of_it, index) for index, score in enumerate(unchanged)
                     if score.closed_loop == loop]  # fmt: skip
            text = ", ".join(filter(None, found)) or "nothing"
            rows.append((ingredient.option, ingredient.unit, loop_name(loop), tried, text))
    names = ("changed", "unit", "loop", "tried", "breaks at")
    return Table([Column(name) for name in names], rows)


def _break_text(levels: Sequence[Level], index: int) -> str:
    """The first level that fells a robot in this task and loop; empty if none does."""
    for level in levels:
        score = level.scores[index]
        if score.fallen:
            times = [result.metrics.fall_time for result in score.results]
            first = min(time for time in times if time is not None)
            return (
                f"{score.task.name} at {_value_text(level.value)} "
                f"({score.upright_text}; {first:.1f} s)"
            )
    return ""


SUITE = Suite(
    name="plant",
    title="One ingredient of the plant at a time",
    summary="the plant with one option changed at a time, until the walk breaks",
    measure=sweep,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop"),
    quick=({"robots": 1, "window": 3.0, "tasks": ("forward",), "open_loop": "off"},),
    check=check,
    applies=lambda options: options.engine == "mujoco",
)
