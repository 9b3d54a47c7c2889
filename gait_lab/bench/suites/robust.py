"""The suite `robust`: a fast walk on plants that are changed in one way each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from gait_lab.bench.falls import by_loop, rows_by_loop, text_by_loop
from gait_lab.bench.options import BenchOptions
from gait_lab.bench.report import Report, Row, loop_name, number, table
from gait_lab.bench.score import Score, Variant, labelled_tasks, walk_all

SUITE = "robust"
TASKS = ("forward=30",)
ZERO_STD = math.radians(1.0)
PLANTS: Mapping[str, Variant] = {
    "unchanged": Variant(),
    # Every robot on the same floor.
    "stiff_floor": Variant((("contact.stiffness", 4e4), ("variation.stiffness_scale", None))),
    # As others measure it; at speed these are no weaker than the plant's, which have the line.
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
    "weak_motors": "motors that stall at the URDF's effort; worn, and weaker at speed as all are",
    "joint_zeros": "joint zero errors N(0, 1 deg), cut at 2 deg",
}


def robust(options: BenchOptions) -> Report:
    """The same robots on each of the plants."""
    tasks = labelled_tasks(options)
    found = dict(zip(PLANTS, walk_all(options, list(PLANTS.values()), tasks), strict=True))
    rows = [
        replace(row, plant=PLANTS[plant].plant_title(options))
        for plant, scores in found.items() for score in scores for row in _rows(plant, score)
    ]  # fmt: skip
    detection = by_loop(score for scores in found.values() for score in scores)
    rows += rows_by_loop(SUITE, detection)
    return Report(tuple(rows), f"{_text(found, options)}\n{text_by_loop(detection)}")


def _rows(plant: str, score: Score) -> list[Row]:
    name, total = f"{plant}_{score.name}", len(score.results)
    rows = [
        Row(SUITE, f"{name}_upright", "robots", score.upright),
        Row(SUITE, f"{name}_upright_share", "%", 100.0 * score.upright / total),
        Row(SUITE, f"{name}_counts", "bool", float(not score.faults)),
    ]
    if score.task.axis:
        rows += score.speed_rows(SUITE, name, not score.faults)
    return rows


def _text(found: Mapping[str, Sequence[Score]], options: BenchOptions) -> str:
    lines: list[tuple[str, ...]] = [
        ("plant", "task", "loop", "upright", "asked", "worst", "median", "unit", ""),
        ("",) * 9,
    ]
    for plant, scores in found.items():
        for score in scores:
            lines.append(
                (
                    plant.replace("_", " "),
                    score.task.name.replace("_", " "),
                    loop_name(score.closed_loop),
                    score.upright_text,
                    score.asked_text,
                    number(score.worst),
                    number(score.median),
                    score.unit,
                    score.mark,
                )
            )
    title = f"Changed in one way each, {options.window:g} s at speed, {options.title}"
    notes = [f"{plant.replace('_', ' ')}: {text}." for plant, text in MEANING.items()]
    notes.append("Speeds of the robots that stayed upright. x = does not count as walking.")
    return "\n".join((title, "", table(lines), "", *notes))
