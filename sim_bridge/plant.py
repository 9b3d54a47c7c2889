"""The plant: what the simulated robot is like, in engine-neutral terms.

One YAML file per plant, in `config/plants/`. A backend compiles the plant for its engine and
refuses what the engine cannot honour; it never ignores an option.
"""

import contextlib
import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from nao_lipm_gait.errors import NaoGaitError, is_number
from nao_lipm_gait.resources import find
from nao_lipm_gait.robot import RobotDescription


def _number(
    minimum: float,
    maximum: float,
    unit: str,
    *,
    optional: bool = False,
    integer: bool = False,
    default: Any = dataclasses.MISSING,
) -> Any:
    """A number in [minimum, maximum]; `optional` also allows None = not modelled."""
    return dataclasses.field(
        default=default,
        metadata={
            "kind": "integer" if integer else "number",
            "minimum": minimum,
            "maximum": maximum,
            "unit": unit,
            "optional": optional,
        }
    )


def _range(minimum: float, maximum: float, unit: str) -> Any:
    """A pair (low, high) inside [minimum, maximum], or None = the nominal value for every robot."""
    return dataclasses.field(
        metadata={
            "kind": "range",
            "minimum": minimum,
            "maximum": maximum,
            "unit": unit,
            "optional": True,
        }
    )


def _switch() -> Any:
    return dataclasses.field(metadata={"kind": "switch", "optional": False})


def _choice(*choices: str) -> Any:
    """One word out of several; the first is the default."""
    return dataclasses.field(
        default=choices[0], metadata={"kind": "choice", "choices": choices, "optional": False}
    )


def _allowed(metadata: Mapping[str, Any]) -> str:
    kind = metadata["kind"]
    if kind == "choice":
        return ", ".join(metadata["choices"])
    if kind == "switch":
        return "true or false"
    span = f"{metadata['minimum']:g} to {metadata['maximum']:g} {metadata['unit']}".rstrip()
    text = {
        "integer": f"a whole number, {span}",
        "number": f"a number, {span}",
        "range": f"a pair [low, high] within {span}",
    }[kind]
    return text + (", or null" if metadata["optional"] else "")


def _checked(name: str, value: Any, metadata: Mapping[str, Any]) -> Any:
    """`value` in its proper type, or NaoGaitError."""
    error = NaoGaitError(name, value, _allowed(metadata))
    if value is None:
        if metadata["optional"]:
            return None
        raise error
    kind = metadata["kind"]
    if kind == "switch":
        if not isinstance(value, bool):
            raise error
        return value
    if kind == "choice":
        if value not in metadata["choices"]:
            raise error
        return value
    low, high = metadata["minimum"], metadata["maximum"]
    if kind == "range":
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise error
        if not all(is_number(v) for v in value) or not low <= value[0] <= value[1] <= high:
            raise error
        return float(value[0]), float(value[1])
    if not is_number(value) or not low <= value <= high:
        raise error
    if kind == "integer":
        if not isinstance(value, int):
            raise error
        return value
    return float(value)


class _Checked:
    """Checks and normalises every field of a section, however it is constructed."""

    __slots__ = ()

    def __post_init__(self) -> None:
        section = type(self).__name__
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value = _checked(f"{section}.{field.name}", getattr(self, field.name), field.metadata)
            object.__setattr__(self, field.name, value)


@dataclass(frozen=True, slots=True)
class Physics(_Checked):
    """The world and how it is integrated."""

    step: float = _number(0.0001, 0.02, "s")
    """Length of one physics step; the control period is a multiple of it."""
    gravity: float = _number(0.0, 30.0, "m/s^2")
    iterations: int = _number(1, 1000, "", integer=True)
    """Iterations of the constraint solver per step (upper bound)."""
    self_collision: bool = _switch()
    """The left leg and the right leg can touch."""


@dataclass(frozen=True, slots=True)
class MotorPlant(_Checked):
    """The position servos. Stall torque and no-load speed are facts of the robot."""

    lag: float = _number(0.0, 0.2, "s")
    """Time constant with which a joint follows its setpoint; 0 = exact."""
    torque_fraction: float = _number(0.01, 2.0, "")
    """Share of the stall torque that reaches the joint at standstill (efficiency of the gear)."""
    torque_speed_line: bool = _switch()
    """The torque of a driving motor falls linearly to zero at its no-load speed."""
    speed_limit: bool = _switch()
    """Setpoints move no faster than the joint's speed limit."""
    stiffness: float | None = _number(1.0, 1e6, "N m/rad", optional=True)
    """Stiffness of the servos in the legs, at most that in arms and head; None = as stiff as the
    engine can make them."""
    armature: float | None = _number(0.0, 100.0, "", optional=True)
    """Factor on the rotor inertia reflected through the gear; None = what the engine's servos need
    (PyBullet: none; MuJoCo: the real one)."""
    friction: float = _number(0.0, 10.0, "N m")
    """Dry friction of each leg joint."""
    play: float = _number(0.0, 0.2, "rad")
    """Free play of the pitch joints of the legs, end to end."""
    encoder_feedback: bool = _switch()
    """The servos aim the encoders at their setpoints: behind the play and in encoder steps. False:
    they see the exact angle on the motor's side of the play."""


@dataclass(frozen=True, slots=True)
class Contact(_Checked):
    """The floor, as felt by the four corner points of each sole."""

    rigid: bool = _switch()
    """Stiff contact; `stiffness` and `damping` are then unused."""
    stiffness: float = _number(100.0, 1e7, "N/m")
    """Of one contact point."""
    damping: float = _number(0.0, 1e5, "N s/m")
    """Of one contact point."""
    friction: float = _number(0.0, 5.0, "")
    """Coulomb coefficient of the pair sole and floor."""


@dataclass(frozen=True, slots=True)
class Sensors(_Checked):
    """What the robot can know, and how late."""

    delay: float = _number(0.0, 1.0, "s")
    """From sampling to the moment when the frame can be used."""
    encoder_bits: int = _number(0, 24, "", integer=True)
    """Counts per turn = 2^bits; 0 = exact."""
    gyro_axes: int = _number(2, 3, "", integer=True)
    """2 = no yaw rate: the z axis reads 0."""
    gyro_noise: float = _number(0.0, 1.0, "rad/s")
    """Standard deviation of the white noise per sample."""
    gyro_bias: float = _number(0.0, 1.0, "rad/s")
    """Standard deviation over robots; constant for one robot."""
    gyro_range: float | None = _number(0.1, 1e3, "rad/s", optional=True)
    """Readings are cut at +- this; None = unlimited."""
    accel_noise: float = _number(0.0, 10.0, "m/s^2")
    """Standard deviation of the white noise per sample."""
    accel_bias: float = _number(0.0, 10.0, "m/s^2")
    """Standard deviation over robots; constant for one robot."""
    accel_range: float | None = _number(10.0, 1e4, "m/s^2", optional=True)
    """Readings are cut at +- this; None = unlimited."""


@dataclass(frozen=True, slots=True)
class Variation(_Checked):
    """How individual robots differ from the nominal one."""

    joint_zero_std: float = _number(0.0, 0.2, "rad")
    """Standard deviation of the zero error of a joint (command and encoder alike)."""
    joint_zero_cut: float = _number(0.0, 0.2, "rad")
    """No zero error is larger than this."""
    imu_mounting_std: float = _number(0.0, 0.2, "rad")
    """Standard deviation of the IMU's mounting angle about each axis."""
    mass: float = _number(0.0, 0.5, "")
    """Each link's mass is scaled by 1 +- this, uniformly."""
    friction: tuple[float, float] | None = _range(0.0, 5.0, "")
    """Pair friction, uniform; replaces contact.friction."""
    stiffness_scale: tuple[float, float] | None = _range(0.01, 100.0, "")
    """Factor on the contact stiffness, uniform in its logarithm."""
    motor_strength: tuple[float, float] | None = _range(0.01, 2.0, "")
    """Factor on every motor's torque, uniform."""


@dataclass(frozen=True, slots=True)
class Terrain(_Checked):
    """What lies ahead of the robot on the floor, from `start` on; a level floor without this.

    The size of the field and the height of the hexagons are the second paper's; the rest is chosen.
    """

    kind: str = _choice("flat", "hexagons", "ramp", "steps", "carpet")
    """`hexagons`: plates of different height; `ramp`: up, level, down; `steps`: up, up, down;
    `carpet`: the whole floor is as soft as `carpet_stiffness`."""
    start: float = _number(0.0, 10.0, "m", default=0.25)
    """Where the field begins, in x."""
    length: float = _number(0.1, 10.0, "m", default=1.0)
    """Of the field in x."""
    width: float = _number(0.1, 10.0, "m", default=1.5)
    """Of the field in y."""
    height: float = _number(0.0, 0.1, "m", default=0.015)
    """Of the highest plate, of the ramp, of each step."""
    plate: float = _number(0.02, 1.0, "m", default=0.1)
    """Across the flats of a hexagon."""
    carpet_stiffness: float = _number(100.0, 1e7, "N/m", default=2e3)
    """Of a carpet under one corner of a sole; in series with the contact."""


@dataclass(frozen=True, slots=True)
class SoleDesign(_Checked):
    """What the robot has under its feet."""

    kind: str = _choice("own", "spring", "sponge")
    """`own`: the robot's; `spring`: touches at the tips of leaf springs along its sides;
    `sponge`: 206 mm long, 50 mm wide and soft."""
    stiffness: float | None = _number(100.0, 1e7, "N/m", optional=True, default=None)
    """Of the sole at one corner, in series with the floor; None = that of its kind."""


@dataclass(frozen=True, slots=True)
class Plant:
    """A complete description of one kind of simulated robot and its floor."""

    name: str
    physics: Physics
    motor: MotorPlant
    contact: Contact
    sensors: Sensors
    variation: Variation
    terrain: Terrain = Terrain()
    sole: SoleDesign = SoleDesign()


def with_sensors_of(plant: Plant, robot: RobotDescription) -> Plant:
    """The plant with what the robot's own sensors tell better or worse; exact ones stay exact."""
    sensors = plant.sensors
    axes = max(sensors.gyro_axes, robot.gyro_axes or 0)
    bits = sensors.encoder_bits
    if robot.encoder_bits is not None:
        bits = min(bits, robot.encoder_bits)
    return with_options(plant, (("sensors.gyro_axes", axes), ("sensors.encoder_bits", bits)))


_SECTIONS: dict[str, type] = {
    "physics": Physics,
    "motor": MotorPlant,
    "contact": Contact,
    "sensors": Sensors,
    "variation": Variation,
    "terrain": Terrain,
    "sole": SoleDesign,
}
_OPTIONAL = ("terrain", "sole")
"""Sections that a file may leave out, whole or in part."""


PlantValue = float | bool | str | tuple[float, float] | None
"""What an option can hold."""
PlantOption = tuple[str, PlantValue]
"""An option and its value: ("motor.play", 0.035)."""


def with_options(plant: Plant, options: Iterable[PlantOption]) -> Plant:
    """The plant with some options replaced; of an option given twice, the last value counts.

    Raises:
        NaoGaitError: no plant has this option, or it cannot hold this value.
    """
    for name, value in options:
        section, field = _option_field(name)
        checked = _checked(name, value, field.metadata)
        part = dataclasses.replace(getattr(plant, section), **{field.name: checked})
        plant = dataclasses.replace(plant, **{section: part})
    return plant


def parse_options(settings: Iterable[str]) -> tuple[PlantOption, ...]:
    """Options typed as `section.option=value`, the value as in the YAML of a plant."""
    options: list[PlantOption] = []
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or not text.strip():
            raise NaoGaitError("plant option", setting, "section.option=value")
        _, field = _option_field(name)
        try:
            value = yaml.safe_load(text)
        except yaml.YAMLError:
            value = text
        if isinstance(value, str):  # YAML takes 1e4 for a word
            with contextlib.suppress(ValueError):
                value = float(value)
        options.append((name, _checked(name, value, field.metadata)))
    return tuple(options)


def option_text(option: PlantOption) -> str:
    """An option as `parse_options` reads it."""
    name, value = option
    if value is None:
        return f"{name}=null"
    if isinstance(value, bool):
        return f"{name}={str(value).lower()}"
    if isinstance(value, str):
        return f"{name}={value}"
    if isinstance(value, tuple):
        return f"{name}=[{value[0]:.10g},{value[1]:.10g}]"
    return f"{name}={value:.10g}"


def _option_field(name: str) -> tuple[str, Any]:
    """The section and the dataclass field of `section.option`."""
    section, _, key = name.partition(".")
    for field in dataclasses.fields(_SECTIONS[section]) if section in _SECTIONS else ():
        if field.name == key:
            return section, field
    known = (f"{s}.{f.name}" for s, cls in _SECTIONS.items() for f in dataclasses.fields(cls))
    raise NaoGaitError("plant option", name, f"one of {', '.join(known)}")


def _require_keys(
    where: str, data: object, names: tuple[str, ...], optional: Iterable[str] = ()
) -> Mapping[str, Any]:
    optional = tuple(optional)
    allowed = "exactly the keys " + ", ".join(name for name in names if name not in optional)
    if optional:
        allowed += "; if wanted " + ", ".join(optional)
    if not isinstance(data, Mapping):
        raise NaoGaitError(where, data, allowed)
    unknown = [key for key in data if key not in names]
    if unknown:
        raise NaoGaitError(f"{where}: unknown key", unknown[0], allowed)
    missing = [name for name in names if name not in data and name not in optional]
    if missing:
        raise NaoGaitError(f"{where}: missing key", missing[0], allowed)
    return data


def load_plant(name_or_path: str) -> Plant:
    """The plant of a shipped name (`reference`, `ideal`, `worn`) or of a YAML file.

    Raises:
        NaoGaitError: names the file, the key, its value and what is allowed.
    """
    path = Path(find("plants", name_or_path))
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise NaoGaitError(str(path), reason, "a readable YAML mapping") from error
    top = _require_keys(str(path), data, tuple(_SECTIONS), _OPTIONAL)
    sections: dict[str, Any] = {}
    for section, cls in _SECTIONS.items():
        if section not in top:
            continue
        fields = {field.name: field for field in dataclasses.fields(cls)}
        optional = fields if section in _OPTIONAL else ()
        values = _require_keys(f"{path}: {section}", top[section], tuple(fields), optional)
        for name, value in values.items():
            _checked(f"{path}: {section}.{name}", value, fields[name].metadata)
        sections[section] = cls(**values)
    return Plant(name=path.stem, **sections)
