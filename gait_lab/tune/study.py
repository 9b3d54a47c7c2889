"""A tuning study, read from one YAML file: what is varied, tried, scored and confirmed.

The file is checked completely before a robot walks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import attrs

from gait_lab.tune.methods import METHODS
from gait_lab.tune.protocols import find_protocol
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from nao_lipm_gait.presets import preset_for
from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import share
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
    method: str = choice(METHODS, default=METHODS[0])
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


@dataclass(frozen=True, slots=True)
class Range:
    """A parameter of the gait that is varied, from `low` to `high` in its own unit."""

    name: str
    low: float
    high: float

    def value_at(self, share: float) -> float:
        """The value at a share (0..1) of the range, never beyond its ends."""
        return min(self.high, max(self.low, self.low + share * (self.high - self.low)))

    def share_of(self, value: float) -> float:
        """The share (0..1) of the range at a value."""
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Place:
    """An engine and a plant."""

    engine: str
    plant: str

    def __str__(self) -> str:
        return f"{self.engine}/{self.plant}"


@dataclass(frozen=True, slots=True)
class Study:
    """A checked study. A point of the search holds a share (0..1) of each range, in their order.

    Attributes:
        name: Its name.
        ranges: The varied parameters.
        start: Parameters at the start of the search; those that are not varied keep their value.
        protocol: Name of the protocol.
        options: Options of the protocol.
        objective: Weight by measure; the score is the weighted sum, larger is better.
        penalty: What is subtracted from the score.
        robots: Seeds of the robots of the search.
        finals: How the winner is chosen.
        unseen: Seeds of the robots on which the winner is confirmed.
        engine: Physics engine of the search.
        plant: Plant of the search.
        urdf: Robot model.
        trials: Number of trials.
        confirm_options: Options of the protocol for the confirmation.
        confirm_places: Where the winner is confirmed.
        preset: Preset on which `start` is based.
        method: Search method.
        calibrated: The robots have been calibrated by their own sensors.
        about: One sentence about the study.
        source: Text of the file.
    """

    name: str
    ranges: tuple[Range, ...]
    start: GaitParameters
    protocol: str
    options: Mapping[str, float]
    objective: Mapping[str, float]
    penalty: Penalty
    robots: tuple[int, ...]
    finals: Finals
    unseen: tuple[int, ...]
    engine: str
    plant: str
    urdf: str
    trials: int
    confirm_options: Mapping[str, float]
    confirm_places: tuple[Place, ...]
    preset: str = "default"
    method: str = METHODS[0]
    calibrated: bool = False
    about: str = ""
    source: str = field(default="", compare=False)

    @property
    def start_point(self) -> tuple[float, ...]:
        """The point of the start parameters."""
        return tuple(r.share_of(float(getattr(self.start, r.name))) for r in self.ranges)

    def values_at(self, point: Sequence[float]) -> dict[str, float]:
        """The varied parameters at a point, in SI units."""
        return {r.name: r.value_at(share) for r, share in zip(self.ranges, point, strict=True)}

    def parameters_at(self, point: Sequence[float]) -> GaitParameters:
        """All parameters at a point."""
        return self.start.replace(**self.values_at(point))


def shipped_studies() -> list[str]:
    """Names of the shipped studies."""
    return sorted(path.stem for path in share("config", "studies").glob("*.yaml"))


def find_study(name_or_path: str) -> Path:
    """The file of a shipped study (`speed`) or of a path.

    Raises:
        NaoGaitError: There is none.
    """
    shipped = shipped_studies()
    if name_or_path in shipped:
        return share("config", "studies", f"{name_or_path}.yaml")
    path = Path(name_or_path)
    if not path.is_file():
        allowed = f"a shipped study ({', '.join(shipped)}) or the path of a YAML file"
        raise NaoGaitError("study", name_or_path, allowed)
    return path


def load_study(
    name_or_path: str,
    engine: str | None = None,
    trials: int | None = None,
    places: Sequence[str] = (),
) -> Study:
    """Load a study.

    Args:
        name_or_path: A shipped name or a YAML file.
        engine: Replaces the engine of the file.
        trials: Replaces the number of trials of the file.
        places: Replaces the places of the confirmation; ENGINE/PLANT each.

    Returns:
        The study.

    Raises:
        NaoGaitError: The file cannot be read, or a key or value is not allowed.
    """
    path = find_study(name_or_path)
    source = schema.read_text(path, "study")
    values = schema.parse_yaml(source, f"study {path}")
    if isinstance(values, dict):
        if engine is not None:
            values["engine"] = engine
        if trials is not None:
            values["trials"] = trials
        if places:
            confirm = values.get("confirm") or {}
            if isinstance(confirm, dict):
                values["confirm"] = {**confirm, "places": list(places)}
    return parse_study(values, path.stem, source)


def parse_study(values: Any, name: str = "study", source: str = "") -> Study:
    """Check the content of a study file.

    Args:
        values: The content.
        name: Name of the study if the content has none.
        source: Text of the file.

    Returns:
        The study.

    Raises:
        NaoGaitError: A key or value is not allowed.
    """
    file = StudyFile.from_mapping(values, "study")
    ranges = tuple(_range(name, ends) for name, ends in file.parameters.items())
    changes = GaitParameters.checked(file.start, "study.start", partial=True)
    start = preset_for(load_robot(file.urdf), file.preset).replace(**changes)
    for r in ranges:
        at = float(getattr(start, r.name))
        if not r.low <= at <= r.high:
            allowed = f"inside its range {r.low:g} to {r.high:g}"
            raise NaoGaitError(f"study.start.{r.name}", at, allowed)
    protocol = find_protocol(file.protocol.get("name"))
    options = protocol.checked(
        "protocol", {key: value for key, value in file.protocol.items() if key != "name"}
    )
    for measure, weight in file.objective.items():
        if measure not in protocol.measures:
            allowed = f"one of {', '.join(protocol.measures)}"
            raise NaoGaitError(f"study.objective.{measure}", weight, allowed)
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
        ranges=ranges,
        start=start,
        protocol=protocol.name,
        options=options,
        objective=file.objective,
        penalty=file.penalty,
        robots=file.robots,
        finals=file.finals,
        unseen=file.unseen,
        engine=file.engine,
        plant=file.plant,
        urdf=file.urdf,
        trials=file.trials,
        confirm_options=protocol.checked("confirm.options", {**options, **file.confirm.options}),
        confirm_places=tuple(_place("study.confirm.places", each) for each in places),
        preset=file.preset,
        method=file.method,
        calibrated=file.calibrated,
        about=" ".join(file.about.split()),
        source=source,
    )


def _range(name: str, ends: tuple[float, float]) -> Range:
    """A varied parameter, inside the limits of the gait's own table."""
    where = f"study.parameters.{name}"
    parameter = BY_NAME.get(name)
    if parameter is None or not isinstance(parameter.kind, Number):
        numbers = ", ".join(each for each, known in BY_NAME.items() if known.is_number)
        raise NaoGaitError(where, list(ends), f"one of the parameters {numbers}")
    return Range(name, *Interval(parameter.kind, strict=True).check(where, ends))


def _place(where: str, text: str) -> Place:
    engine, slash, plant = text.partition("/")
    if not slash or engine not in ENGINES:
        raise NaoGaitError(where, text, f"ENGINE/PLANT, engine one of {', '.join(ENGINES)}")
    load_plant(plant)
    return Place(engine, plant)
