"""The suite `robust`: a fast walk on plants that are changed in one way each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gait_lab.bench.options import BenchOptions, option
from gait_lab.bench.result import Column, Measurement, SuiteResult, Table, loop_name
from gait_lab.bench.score import RULES, LoopDetection, Score, Variant, labelled_tasks, walk_all
from gait_lab.bench.suite import Suite

ZERO_STD = math.radians(1.0)
PLANTS: Mapping[str, Variant] = {
    "unchanged": Variant(),
    # Every robot on the same floor.
    "stiff_floor": Variant((("contact.stiffness", 4e4), ("variation.stiffness_scale", None))),
    # As other authors simulate it: the URDF's effort is the limit at any speed. At high speed these
    # motors are no weaker than the plant's, which have the torque-speed line.
    "urdf_effort": Variant(
        (("motor.torque_fraction", 1.0), ("motor.torque_speed_line", False),
         ("variation.motor_strength", None)),
        urdf_effort=True,
    ),
    "weak_motors": Variant((("motor.torque_fraction", 1.0),), urdf_effort=True),
    "joint_zeros": Variant(
        (("variation.joint_zero_std", ZERO_STD), ("variation.joint_zero_cut", 2.0 * ZERO_STD)),
    ),
}  # fmt: skip
MEANING = {
    "unchanged": "the plant as it is",
    "stiff_floor": "4e4 N/m per corner of a sole",
    "urdf_effort": "motors with the URDF's effort at any speed",
    "weak_motors": "motors that stall at the URDF's effort: worn, and weaker at speed",
    "joint_zeros": "joint zero errors N(0, 1 deg), cut at 2 deg",
}


@dataclass(frozen=True)
class Options(BenchOptions):
    """What the suite `robust` runs on."""

    robots: int = 20
    tasks: tuple[str, ...] = ("forward=30",)
    only: tuple[str, ...] = option(
        tuple(PLANTS), "only this change of the plant", "NAME", choices=tuple(PLANTS)
    )  # fmt: skip


def robust(options: Options) -> SuiteResult:
    """The same robots on each of the plants."""
    tasks = labelled_tasks(options)
    plants = {name: PLANTS[name] for name in options.only}
    found = dict(zip(plants, walk_all(options, list(plants.values()), tasks), strict=True))
    rows = [
        replace(row, plant=PLANTS[plant].plant_title(options))
        for plant, scores in found.items() for score in scores for row in plant_rows(plant, score)
    ]  # fmt: skip
    detection = LoopDetection(score for scores in found.values() for score in scores)
    notes = (
        "; ".join(f"{plant.replace('_', ' ')}: {MEANING[plant]}" for plant in plants) + ".",
        f"Speeds of the robots that stayed upright. {RULES}",
        *detection.notes,
    )
    title = f"Changed in one way each, {options.window:g} s at speed, {options.title}"
    return SuiteResult((*rows, *detection.rows), title, (_table(found),), notes)


def plant_rows(plant: str, score: Score) -> list[Measurement]:
    """The measurements of one task on one plant."""
    name = f"{plant}_{score.name}"
    share = 100.0 * score.upright / len(score.results)
    rows = [
        Measurement(f"{name}_upright", "robots", score.upright),
        Measurement(f"{name}_upright_share", "%", share),
        Measurement(f"{name}_counts", "bool", float(not score.faults)),
    ]
    return [*rows, *score.speed_rows(name)] if score.task.axis else rows


def _table(found: Mapping[str, Sequence[Score]]) -> Table:
    columns = (
        Column("plant"), Column("task"), Column("loop"), Column("upright"), Column("commanded"),
        Column("worst"), Column("median"), Column("unit"), Column(""),
    )  # fmt: skip
    rows = [
        (
            plant.replace("_", " "), score.task.name.replace("_", " "),
            loop_name(score.closed_loop), score.upright_text, score.asked_cell, score.worst,
            score.median, score.unit, score.mark,
        )
        for plant, scores in found.items() for score in scores
    ]  # fmt: skip
    return Table(columns, rows)


SUITE = Suite(
    name="robust",
    title="Harder plants",
    summary="a fast walk on a stiff floor, with weak motors, with large joint zero errors",
    measure=robust,
    options=Options,
    takes=("robots", "tasks", "window", "open_loop"),
    quick=({"robots": 3, "window": 5.0},),
)
