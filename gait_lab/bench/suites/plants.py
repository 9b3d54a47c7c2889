"""What each ingredient of a plant does to the walk, alone: one option changed at a time.

The same robots walk the same tasks on the plant as it is and with one option at each of several
values. A value breaks the walk if a robot falls; it slows it if the median speed of those that
stayed upright is below `SLOW` times the one on the unchanged plant.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gait_lab.bench.falls import by_loop, rows_by_loop, text_by_loop
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, table
from gait_lab.bench.score import Score, Variant, walk_all
from gait_lab.trials.tasks import AXES
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from sim_bridge.plant import PlantOption, PlantValue, load_plant, with_options
from sim_bridge.world import World

SUITE = "plant"
SLOW = 0.8
"""Share of the unchanged plant's speed below which a walk is slow."""


@dataclass(frozen=True, slots=True)
class Ingredient:
    """One option of the plant and the values it is given, the hardest to walk with last."""

    name: str
    option: str
    unit: str
    values: tuple[float | bool, ...]
    """In `unit`."""
    factor: float = 1.0
    """From `unit` to the unit of the option."""
    along: tuple[PlantOption, ...] = ()
    """What else has to change for the option to count."""

    def change(self, value: float | bool) -> tuple[PlantOption, ...]:
        """The options of the plant with this value."""
        held: PlantValue = value if isinstance(value, bool) else value * self.factor
        return (*self.along, (self.option, held))


_DEGREE = math.radians(1.0)

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
    """The plant with one ingredient at one value, and how the robots walked on it."""

    ingredient: Ingredient
    value: float | bool
    scores: tuple[Score, ...]

    @property
    def name(self) -> str:
        return f"{self.ingredient.name}_{value_text(self.value)}"


def value_text(value: float | bool) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{value:g}" if abs(value) < 1e5 else f"{value:.0f}"


def chosen(names: Sequence[str]) -> tuple[Ingredient, ...]:
    """The ingredients of these names; all if there are none."""
    for name in names:
        if name not in INGREDIENTS:
            raise NaoGaitError("ingredient", name, f"one of {', '.join(INGREDIENTS)}")
    return tuple(INGREDIENTS[name] for name in dict.fromkeys(names or INGREDIENTS))


def check(options: BenchOptions) -> None:
    """NaoGaitError for an ingredient that there is not, or another engine."""
    chosen(options.ingredients)
    if options.engine != "mujoco":
        raise NaoGaitError(
            "engine", options.engine, "mujoco for the suite plant: others lack most ingredients"
        )


def sweep(options: BenchOptions) -> Report:
    """All walks on the plant as it is, and with each ingredient at each of its values."""
    check(options)
    ingredients = chosen(options.ingredients)
    steps = [(ingredient, value) for ingredient in ingredients for value in ingredient.values]
    changes = [(), *(ingredient.change(value) for ingredient, value in steps)]
    _require_accepted(changes, options)
    unchanged, *changed = walk_all(options, [Variant(change) for change in changes])
    levels = [
        Level(ingredient, value, tuple(scores))
        for (ingredient, value), scores in zip(steps, changed, strict=True)
    ]
    return report(unchanged, levels, options)


def _require_accepted(changes: Sequence[tuple[PlantOption, ...]], options: BenchOptions) -> None:
    """NaoGaitError for what the engine refuses: before the first walk, not at the hundredth."""
    robot, plant = load_robot(options.urdf), load_plant(options.plant)
    for change in changes:
        made = with_options(plant, (*options.plant_options, *change))
        World.single(robot, made, options.seed, engine=options.engine).close()


def report(unchanged: Sequence[Score], levels: Sequence[Level], options: BenchOptions) -> Report:
    rows = [row for score in unchanged for row in _rows("unchanged", score)]
    rows += [row for level in levels for score in level.scores for row in _rows(level.name, score)]
    for ingredient, of_it in _by_ingredient(levels):
        for index, score in enumerate(unchanged):
            value = next((lv.value for lv in of_it if _fallen(lv.scores[index])), None)
            if isinstance(value, bool):
                value = float(value)
            metric = f"{ingredient.name}_{score.name}_breaks_at"
            rows.append(Row(SUITE, metric, ingredient.unit, value))
    found = by_loop([*unchanged, *(score for level in levels for score in level.scores)])
    rows += rows_by_loop(SUITE, found)
    text = f"{_text(unchanged, levels, options)}\n\n{text_by_loop(found)}"
    return Report(tuple(rows), text)


def _by_ingredient(levels: Sequence[Level]) -> list[tuple[Ingredient, list[Level]]]:
    groups: dict[str, list[Level]] = {}
    for level in levels:
        groups.setdefault(level.ingredient.name, []).append(level)
    return [(group[0].ingredient, group) for group in groups.values()]


def _fallen(score: Score) -> int:
    return len(score.results) - score.upright


def _slow(score: Score, unchanged: Score) -> bool:
    speed, before = score.median, unchanged.median
    return speed is not None and before is not None and speed < SLOW * before


def _rows(name: str, score: Score) -> list[Row]:
    base, median, counts = f"{name}_{score.name}", score.median, not score.faults
    rows = [
        Row(SUITE, f"{base}_upright", "robots", score.upright),
        Row(SUITE, f"{base}_counts", "bool", float(counts)),
    ]
    if score.task.axis:
        rows.append(Row(SUITE, f"{base}_median", score.unit, median if counts else None))
        rows.append(Row(SUITE, f"{base}_median_of_upright", score.unit, median))
    return rows


def _text(unchanged: Sequence[Score], levels: Sequence[Level], options: BenchOptions) -> str:
    header, units = ["changed", ""], ["", ""]
    loops = list(dict.fromkeys(score.closed_loop for score in unchanged))
    header.append("loop")
    units.append("")
    for score in unchanged:
        if score.closed_loop == loops[0]:
            axis = score.task.axis
            factor = AXES[axis][1] if axis else 0.0
            header += [score.task.name, f"{abs(score.task.asked) * factor:g}" if axis else ""]
            units += ["upright", score.unit]
    lines = [header, units]
    for loop in loops:
        base = [score for score in unchanged if score.closed_loop == loop]
        lines.append(["nothing", "", loop_name(loop), *_cells(base, base)])
    for level in levels:
        for loop in loops:
            picked = [pair for pair in zip(level.scores, unchanged, strict=True)
                      if pair[0].closed_loop == loop]  # fmt: skip
            cells = _cells([score for score, _ in picked], [before for _, before in picked])
            value = f"{value_text(level.value)} {level.ingredient.unit}".rstrip()
            lines.append([level.ingredient.option, value, loop_name(loop), *cells])
    count = options.robots
    last = options.seed + count - 1
    robots = f"robots {options.seed}-{last}" if count > 1 else f"robot {last}"
    title = (
        f"{options.window:g} s at speed, {robots}, plant {options.plant_title} with one option "
        f"changed, {options.engine}, {options.urdf}"
    )
    notes = (
        "Median speed of the robots that stayed upright, under the asked one. x: a robot fell; "
        f"~: slower than {SLOW:.0%}",
        "of the unchanged plant; !: upright, but does not count (flight, slip, leg against leg).",
    )
    return "\n".join(
        (title, "", table(lines), "", *notes, "", "What breaks the walk (upright; first fall)",
         *_breaks(unchanged, levels))
    )  # fmt: skip


def _cells(scores: Sequence[Score], unchanged: Sequence[Score]) -> list[str]:
    cells = []
    for score, before in zip(scores, unchanged, strict=True):
        mark = "x" if _fallen(score) else "!" if score.faults else ""
        median = score.median
        slow = "~" if _slow(score, before) else ""
        cells.append(f"{mark}{score.upright}/{len(score.results)}")
        cells.append("-" if median is None else f"{slow}{median:.1f}")
    return cells


def _breaks(unchanged: Sequence[Score], levels: Sequence[Level]) -> list[str]:
    """Per ingredient and loop: the first value that fells a robot, per task."""
    lines = []
    for ingredient, of_it in _by_ingredient(levels):
        for loop in dict.fromkeys(score.closed_loop for score in unchanged):
            found = []
            for index, before in enumerate(unchanged):
                if before.closed_loop != loop:
                    continue
                for level in of_it:
                    score = level.scores[index]
                    if not _fallen(score):
                        continue
                    times = [result.metrics.fall_time for result in score.results]
                    first = min(time for time in times if time is not None)
                    found.append(
                        f"{score.task.name} at {value_text(level.value)} "
                        f"({score.upright}/{len(score.results)}; {first:.1f} s)"
                    )
                    break
            unit = f" [{ingredient.unit}]" if ingredient.unit else ""
            tried = ", ".join(value_text(level.value) for level in of_it)
            lines.append(
                f"  {ingredient.option}{unit}, {loop_name(loop)}: "
                + (", ".join(found) or f"nothing at {tried}")
            )
    return lines
