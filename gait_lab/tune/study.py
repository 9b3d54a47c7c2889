"""A tuning study, read from one YAML file: what is varied, tried, scored and confirmed.

The file is checked completely before a robot walks.
"""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import attrs

from gait_lab.tune.protocols import Measures, Protocol, find_protocol
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from nao_lipm_gait.presets import preset_for
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.robot import load_robot
from robot_core.schema import (
    Anything,
    Interval,
    Number,
    Settings,
    Table,
    choice,
    group,
    number,
    switch,
)
from sim_bridge.engines.registry import ENGINES
from sim_bridge.plant import load_plant

METHODS = ("surrogate", "pso", "cma", "tpe", "random")
"""Search methods; `samplers.make_sampler` makes them."""


def _seeds(minimum: int, default: Any = schema.REQUIRED) -> Any:
    """A field of robot seeds; -1 is the nominal robot."""
    seed = Number(-1, 1_000_000, whole=True)
    return schema.field(schema.Sequence(seed, minimum=minimum, unique=True), default)


@attrs.frozen
class Penalty(Settings):
    """What is subtracted from the score of a robot, in the unit of the score."""

    fall: float = number(3.0, minimum=0.0)
    dishonest: float = number(
        1.0,
        minimum=0.0,
        meaning="Penalty per unit of excess over the flight, slip and leg-contact limits.",
    )


@attrs.frozen
class Finals(Settings):
    """How many of the best trials walk again, and on which further robots, to choose the winner."""

    candidates: int = number(
        0, 0, 100, whole=True, meaning="0 = no finals; the best trial of the search wins."
    )
    robots: tuple[int, ...] = _seeds(0, ())


@attrs.frozen
class Confirmation(Settings):
    """How the winner is confirmed on unseen robots."""

    options: dict[str, Any] = schema.field(Table(Anything()), attrs.Factory(dict))
    places: tuple[str, ...] = schema.field(schema.Sequence(schema.Text()), ())


@attrs.frozen
class StudyFile(Settings):
    """A study as the file has it."""

    parameters: dict[str, tuple[float, float]] = schema.field(
        Table(Interval(Number(), strict=True), minimum=1), meaning="Varied: [low, high] by name."
    )
    protocol: dict[str, Any] = schema.field(
        Table(Anything()), meaning="Name and options of the protocol."
    )
    objective: dict[str, float] = schema.field(
        Table(Number(), minimum=1), meaning="Weight by measure; the weighted sum is the score."
    )
    robots: tuple[int, ...] = _seeds(1)
    name: str = schema.text("")
    about: str = schema.text("")
    preset: str = schema.text("default")
    method: str = choice(METHODS)
    start: dict[str, Any] = schema.field(
        Table(Anything()), attrs.Factory(dict), "What differs from the preset at the start."
    )
    penalty: Penalty = group(Penalty, Penalty())
    finals: Finals = group(Finals, Finals())
    unseen: tuple[int, ...] = _seeds(0, ())
    engine: str = choice(ENGINES, default="mujoco")
    plant: str = schema.text("reference")
    urdf: str = schema.text("nao_h21_v33")
    calibrated: bool = switch(False, "The robots have been calibrated by their own sensors.")
    trials: int = number(74, 1, 100_000, whole=True)
    confirm: Confirmation = group(Confirmation, Confirmation())


class Place(NamedTuple):
    """An engine and a plant."""

    engine: str
    plant: str

    def __str__(self) -> str:
        return f"{self.engine}/{self.plant}"


@dataclass(frozen=True, slots=True)
class Study:
    """A checked study.

    Attributes:
        start: Parameters at the start of the search; those that are not varied keep their value.
        confirm_options: Its options in finals and confirmation.
    """

    name: str
    file: StudyFile
    start: GaitParameters
    protocol: Protocol
    options: Settings
    confirm_options: Settings
    place: Place
    confirm_places: tuple[Place, ...]

    @property
    def start_values(self) -> dict[str, float]:
        """The varied parameters at the start, in SI units."""
        return {name: float(getattr(self.start, name)) for name in self.file.parameters}

    def score(self, measures: Sequence[Measures]) -> float:
        """The mean over the robots of their weighted measures minus the penalties."""
        return sum(map(self.robot_score, measures)) / len(measures)

    def robot_score(self, measures: Measures) -> float:
        """The score of one robot; larger is better."""
        score = sum(w * measures.values[name] for name, w in self.file.objective.items())
        score -= self.file.penalty.fall * measures.fell
        return score - self.file.penalty.dishonest * measures.excess

    def digest(self) -> str:
        """A hash of everything on which the score of a trial depends, file contents included."""
        file = self.file
        # Neither where the files lie nor their names matter, only what they say.
        robot = replace(load_robot(file.urdf), urdf_path=Path())
        relevant = (
            sorted(file.parameters.items()), self.start, self.protocol.name, self.options,
            sorted(file.objective.items()), file.penalty, file.robots, file.calibrated,
            file.engine, attrs.evolve(load_plant(file.plant), name="-"), robot,
        )  # fmt: skip
        return hashlib.sha256(repr(relevant).encode()).hexdigest()[:16]


def load_study(
    name_or_path: str,
    engine: str | None = None,
    trials: int | None = None,
    places: Sequence[str] = (),
    urdf: str | None = None,
) -> Study:
    """Load a study.

    Args:
        name_or_path: A shipped name or a YAML file.
        engine: Replaces the engine of the file.
        trials: Replaces the number of trials of the file.
        places: Replaces the places of the confirmation; ENGINE/PLANT each.
        urdf: Replaces the robot of the file; ranges that do not hold its start are widened.

    Raises:
        NaoGaitError: The file cannot be read, or a key or value is not allowed.
    """
    path = find("studies", name_or_path)
    values = schema.read_yaml(path, "study")
    if isinstance(values, dict):
        given = {"engine": engine, "trials": trials, "urdf": urdf}
        if urdf is None and isinstance(values.get("urdf"), str):
            beside = path.parent / values["urdf"]
            given["urdf"] = str(beside) if os.path.isfile(beside) else values["urdf"]
        values |= {key: value for key, value in given.items() if value is not None}
        confirm = values.get("confirm", {})
        if places and isinstance(confirm, dict):
            values["confirm"] = {**confirm, "places": list(places)}
    return parse_study(values, path.stem, widened=urdf is not None)


def parse_study(values: Any, name: str = "study", *, widened: bool = False) -> Study:
    """Check the content of a study file.

    Args:
        values: What the file holds.
        name: Name of the study where the file has none.
        widened: Ranges grow to where the robot begins; else they must hold it.

    Raises:
        NaoGaitError: A key or value is not allowed.
    """
    file = StudyFile.from_mapping(values, "study")
    for varied, ends in file.parameters.items():
        _check_range(varied, ends)
    changes = GaitParameters.checked(file.start, "study.start", partial=True)
    start = preset_for(load_robot(file.urdf), file.preset).replace(**changes)
    if widened:
        ranges = {
            varied: (min(low, getattr(start, varied)), max(high, getattr(start, varied)))
            for varied, (low, high) in file.parameters.items()
        }
        file = file.replace(parameters=ranges)
    for varied, (low, high) in file.parameters.items():
        at = getattr(start, varied)
        if not low <= at <= high:
            allowed = f"inside its range {low:g} to {high:g}"
            raise NaoGaitError(f"study.start.{varied}", at, allowed)
    protocol = find_protocol(file.protocol.get("name"))
    given = {key: value for key, value in file.protocol.items() if key != "name"}
    options = protocol.options.from_mapping(given, "study.protocol")
    for measure, weight in file.objective.items():
        if measure not in protocol.measures:
            raise NaoGaitError(f"study.objective.{measure}", weight, protocol.measures)
    if not any(file.objective.values()):
        raise NaoGaitError("study.objective", file.objective, "a weight for at least one measure")
    if bool(file.finals.candidates) != bool(file.finals.robots):
        raise NaoGaitError("study.finals.robots", file.finals, "candidates and robots, or neither")
    both = sorted({*file.robots, *file.finals.robots} & set(file.unseen))
    if both:
        raise NaoGaitError("study.unseen", both, "robots that are not used for tuning")
    place = _place("study.engine and plant", f"{file.engine}/{file.plant}")
    places = file.confirm.places or (str(place),)
    return Study(
        name=file.name or name,
        file=file,
        start=start,
        protocol=protocol,
        options=options,
        confirm_options=protocol.options.from_mapping(
            {**options.as_dict(), **file.confirm.options}, "study.confirm.options"
        ),
        place=place,
        confirm_places=tuple(_place("study.confirm.places", each) for each in places),
    )


def _check_range(name: str, ends: tuple[float, float]) -> None:
    """Check that a varied parameter exists and that its range is inside the gait's own table."""
    where = f"study.parameters.{name}"
    parameter = BY_NAME.get(name)
    if parameter is None or not isinstance(parameter.kind, Number):
        numbers = [each for each, known in BY_NAME.items() if known.is_number]
        allowed = f"one of the parameters {', '.join(numbers)}"
        raise NaoGaitError(where, list(ends), allowed, numbers)
    Interval(parameter.kind, strict=True).check(where, ends)


def _place(where: str, text: str) -> Place:
    engine, slash, plant = text.partition("/")
    if not slash or engine not in ENGINES:
        raise NaoGaitError(where, text, f"ENGINE/PLANT, engine one of {', '.join(ENGINES)}")
    load_plant(plant)
    return Place(engine, plant)
