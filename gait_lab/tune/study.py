"""A tuning study: what is varied, tried, scored and confirmed, read from one YAML file.

Everything is checked before anything walks; what is wrong is said in one line (NaoGaitError).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from gait_lab.tune.protocols import find_protocol
from nao_lipm_gait.errors import NaoGaitError, is_number
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from nao_lipm_gait.presets import preset_for
from nao_lipm_gait.resources import share
from nao_lipm_gait.robot import load_robot
from sim_bridge.engines.registry import ENGINES
from sim_bridge.plant import load_plant

KEYS = (
    "name", "about", "parameters", "preset", "start", "protocol", "objective", "penalty", "robots",
    "finals", "unseen", "engine", "plant", "urdf", "trials", "confirm",
)  # fmt: skip
SEED_MAX = 1_000_000
TRIALS_MAX = 100_000


@dataclass(frozen=True, slots=True)
class Range:
    """A parameter of the gait that is varied, from `low` to `high` in its own unit."""

    name: str
    low: float
    high: float

    def value_at(self, share: float) -> float:
        """The value at a share of the range, 0..1; never past its ends."""
        return min(self.high, max(self.low, self.low + share * (self.high - self.low)))

    def share_of(self, value: float) -> float:
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True, slots=True)
class Penalty:
    """Taken off the score of a robot, in the unit of the score."""

    fall: float = 3.0
    dishonest: float = 1.0
    """Times the excess over the limits of walking (flight, slip, leg contact)."""


@dataclass(frozen=True, slots=True)
class Finals:
    """Which trials walk again on which further robots before one is called the best."""

    candidates: int = 0
    """0: the search's best is the winner."""
    robots: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Place:
    """Where the winner is confirmed."""

    engine: str
    plant: str

    def __str__(self) -> str:
        return f"{self.engine}/{self.plant}"


@dataclass(frozen=True, slots=True)
class Study:
    """A checked study. Points of the search are shares of the ranges, in the order of them."""

    name: str
    ranges: tuple[Range, ...]
    start: GaitParameters
    """What is not varied stays as it is here."""
    protocol: str
    options: Mapping[str, float]
    objective: Mapping[str, float]
    """Weight by name of a measure; the score is the weighted sum, larger is better."""
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
    about: str = ""
    source: str = field(default="", compare=False)
    """The text of the file."""

    @property
    def start_point(self) -> tuple[float, ...]:
        return tuple(r.share_of(float(getattr(self.start, r.name))) for r in self.ranges)

    def values_at(self, point: Sequence[float]) -> dict[str, float]:
        """The varied parameters at a point, SI."""
        return {r.name: r.value_at(share) for r, share in zip(self.ranges, point, strict=True)}

    def parameters_at(self, point: Sequence[float]) -> GaitParameters:
        return self.start.replace(**self.values_at(point))


def find_study(name_or_path: str) -> Path:
    """The file of a shipped study (`speed`) or of a path."""
    folder = share("config", "studies")
    shipped = sorted(path.stem for path in folder.glob("*.yaml"))
    if name_or_path in shipped:
        return folder / f"{name_or_path}.yaml"
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
    """A study from its file; `engine`, `trials` and `places` replace what the file says."""
    path = find_study(name_or_path)
    try:
        text = path.read_text(encoding="utf-8")
        values = yaml.safe_load(text)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise NaoGaitError(f"study {path}", reason, "a readable YAML file") from error
    values = _mapping("study", values)
    if engine is not None:
        values = {**values, "engine": engine}
    if trials is not None:
        values = {**values, "trials": trials}
    if places:
        confirm = _mapping("confirm", values.get("confirm", {}))
        values = {**values, "confirm": {**confirm, "places": list(places)}}
    return parse_study(values, path.stem, text)


def parse_study(values: Mapping[str, Any], name: str = "study", source: str = "") -> Study:
    """A study from a mapping as it stands in the file."""
    _known("study", values, KEYS)
    for key in ("parameters", "protocol", "objective", "robots"):
        if key not in values:
            raise NaoGaitError(f"study.{key}", "nothing", "must be given")
    ranges = _ranges(values["parameters"])
    preset = str(values.get("preset", "default"))
    urdf = str(values.get("urdf", "nao_h21_v33"))
    start = preset_for(load_robot(urdf), preset).replace(
        **_mapping("start", values.get("start", {}))
    )
    for r in ranges:
        at = float(getattr(start, r.name))
        if not r.low <= at <= r.high:
            raise NaoGaitError(f"start.{r.name}", at, f"inside its range {r.low:g} to {r.high:g}")

    settings = dict(_mapping("protocol", values["protocol"]))
    protocol = find_protocol(settings.pop("name", None))
    options = protocol.checked("protocol", settings)
    confirm = _mapping("confirm", values.get("confirm", {}))
    _known("confirm", confirm, ("options", "places"))
    confirm_options = _mapping("confirm.options", confirm.get("options", {}))
    robots = _robots("robots", values["robots"])
    unseen = _robots("unseen", values.get("unseen", []), empty=True)
    finals = _finals(values.get("finals", {}))
    both = sorted({*robots, *finals.robots} & set(unseen))
    if both:
        raise NaoGaitError("unseen", both, "robots that are not used for tuning")
    place = _place("engine and plant", f"{values.get('engine', 'mujoco')}/"
                   f"{values.get('plant', 'reference')}")  # fmt: skip
    places = _sequence("confirm.places", confirm.get("places", [str(place)]))
    return Study(
        name=str(values.get("name", name)),
        ranges=ranges,
        start=start,
        protocol=protocol.name,
        options=options,
        objective=_objective(values["objective"], protocol.measures),
        penalty=_penalty(values.get("penalty", {})),
        robots=robots,
        finals=finals,
        unseen=unseen,
        engine=place.engine,
        plant=place.plant,
        urdf=urdf,
        trials=_whole("trials", values.get("trials", 74), 1, TRIALS_MAX),
        confirm_options={**options, **protocol.checked("confirm.options", {
            **options, **confirm_options})},
        confirm_places=tuple(_place("confirm.places", each) for each in places),
        preset=preset,
        about=" ".join(str(values.get("about", "")).split()),
        source=source,
    )  # fmt: skip


def _ranges(given: Any) -> tuple[Range, ...]:
    given = _mapping("parameters", given)
    if not given:
        raise NaoGaitError("parameters", "none", "at least one parameter: [low, high]")
    ranges = []
    for name, ends in given.items():
        parameter = BY_NAME.get(name)
        if parameter is None:
            raise NaoGaitError(f"parameters.{name}", ends, f"one of {', '.join(BY_NAME)}")
        if not parameter.is_number:
            raise NaoGaitError(f"parameters.{name}", ends, "a parameter that is a number")
        allowed = f"[low, high] inside {parameter.minimum:g} to {parameter.maximum:g}"
        if not isinstance(ends, list) or len(ends) != 2:
            raise NaoGaitError(f"parameters.{name}", ends, allowed)
        try:
            low, high = (float(parameter.check(end)) for end in ends)
        except NaoGaitError as error:
            raise NaoGaitError(f"parameters.{name}", ends, allowed) from error
        if not low < high:
            raise NaoGaitError(f"parameters.{name}", ends, "low below high")
        ranges.append(Range(name, low, high))
    return tuple(ranges)


def _objective(given: Any, measures: Mapping[str, str]) -> dict[str, float]:
    weights: dict[str, float] = {}
    for name, weight in _mapping("objective", given).items():
        if name not in measures:
            raise NaoGaitError(f"objective.{name}", weight, f"one of {', '.join(measures)}")
        weights[name] = _number(f"objective.{name}", weight)
    if not any(weights.values()):
        raise NaoGaitError("objective", weights, "a weight for at least one measure")
    return weights


def _penalty(given: Any) -> Penalty:
    given = _mapping("penalty", given)
    _known("penalty", given, ("fall", "dishonest"))
    values = {name: _number(f"penalty.{name}", value) for name, value in given.items()}
    for name, value in values.items():
        if value < 0.0:
            raise NaoGaitError(f"penalty.{name}", value, "0 or more")
    return Penalty(**values)


def _finals(given: Any) -> Finals:
    given = _mapping("finals", given)
    _known("finals", given, ("candidates", "robots"))
    if not given:
        return Finals()
    return Finals(
        _whole("finals.candidates", given.get("candidates", 0), 1, 100),
        _robots("finals.robots", given.get("robots", [])),
    )


def _robots(field_name: str, given: Any, empty: bool = False) -> tuple[int, ...]:
    seeds = tuple(_whole(field_name, s, -1, SEED_MAX) for s in _sequence(field_name, given))
    if not seeds and not empty:
        raise NaoGaitError(field_name, "none", "at least one robot seed")
    if len(set(seeds)) != len(seeds):
        raise NaoGaitError(field_name, list(seeds), "each robot once")
    return seeds


def _place(field_name: str, text: Any) -> Place:
    engine, slash, plant = str(text).partition("/")
    if not slash or engine not in ENGINES:
        raise NaoGaitError(field_name, text, f"ENGINE/PLANT, engine one of {', '.join(ENGINES)}")
    load_plant(plant)
    return Place(engine, plant)


def _mapping(field_name: str, given: Any) -> Mapping[str, Any]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise NaoGaitError(field_name, given, "a mapping of names to values")
    return {str(key): value for key, value in given.items()}


def _sequence(field_name: str, given: Any) -> list[Any]:
    if given is None:
        return []
    if not isinstance(given, list):
        raise NaoGaitError(field_name, given, "a list")
    return given


def _known(field_name: str, given: Mapping[str, Any], allowed: Sequence[str]) -> None:
    for key in given:
        if key not in allowed:
            raise NaoGaitError(f"{field_name}.{key}", given[key], ", ".join(allowed))


def _number(field_name: str, value: Any) -> float:
    if not is_number(value):
        raise NaoGaitError(field_name, value, "a number")
    return float(value)


def _whole(field_name: str, value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise NaoGaitError(field_name, value, f"a whole number from {low} to {high}")
    return value
