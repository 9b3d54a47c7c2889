"""The plant: what the simulated robot and its floor are like, in engine-neutral terms.

One YAML file per plant, in `config/plants/`. A file names every option, or says `base: reference`
and names only what differs. A backend compiles the plant for its engine and refuses an option that
the engine cannot model; it never ignores one.
"""

from collections.abc import Iterable
from typing import Any

import attrs

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import find, read_layers
from robot_core.robot import RobotDescription
from robot_core.schema import Interval, Number, Settings, choice, group, number, switch, text


def _range(minimum: float, maximum: float, meaning: str) -> Any:
    """A pair (low, high), or None = the nominal value for every robot."""
    return schema.field(schema.Optional(Interval(Number(minimum, maximum))), meaning=meaning)


@attrs.frozen
class Physics(Settings):
    """The physics engine."""

    step: float = number(
        minimum=0.0001, maximum=0.02, unit="s",
        meaning="Length of a physics step; the control period is a multiple of it.",
    )
    gravity: float = number(minimum=0.0, maximum=30.0, unit="m/s^2", meaning="Gravity.")
    iterations: int = number(
        minimum=1, maximum=1000, whole=True,
        meaning="Largest number of iterations of the constraint solver per step.",
    )
    self_collision: bool = switch(meaning="The left leg and the right leg can touch.")


@attrs.frozen
class MotorPlant(Settings):
    """The position servos. Stall torque and no-load speed are facts of the robot."""

    lag: float = number(
        minimum=0.0, maximum=0.2, unit="s",
        meaning="Time constant with which a joint follows its setpoint; 0 = the least possible.",
    )
    torque_fraction: float = number(
        minimum=0.01, maximum=2.0,
        meaning="Share of the stall torque that reaches the joint at standstill (gear losses).",
    )
    torque_speed_line: bool = switch(
        meaning="The torque of a driving motor falls linearly to zero at its no-load speed."
    )
    speed_limit: bool = switch(
        meaning="Setpoints of stiff motors move no faster than the joint's speed limit."
    )
    stiffness: float | None = number(
        minimum=1.0, maximum=1e6, unit="N m/rad", optional=True,
        meaning="Stiffness of the leg servos and upper limit for arms and head; null = as stiff as "
        "the engine can make them.",
    )
    armature: float | None = number(
        minimum=0.0, maximum=100.0, optional=True,
        meaning="Factor on the reflected rotor inertia; null = what the engine's servos need "
        "(PyBullet: none, MuJoCo: the real one).",
    )
    friction: float = number(
        minimum=0.0, maximum=10.0, unit="N m", meaning="Dry friction of each leg joint."
    )
    play: float = number(
        minimum=0.0, maximum=0.2, unit="rad",
        meaning="Free play of the pitch joints of the legs, end to end.",
    )
    encoder_feedback: bool = switch(
        meaning="The servos control the encoder reading, which lies behind the play and has the "
        "encoder's resolution; false = the exact angle on the motor's side of the play."
    )


@attrs.frozen
class Contact(Settings):
    """The floor at the four corner points of each sole."""

    rigid: bool = switch(meaning="Hard floor; stiffness and damping are then unused.")
    stiffness: float = number(
        minimum=100.0, maximum=1e7, unit="N/m", meaning="Stiffness of a contact point."
    )
    damping: float = number(
        minimum=0.0, maximum=1e5, unit="N s/m", meaning="Damping of a contact point."
    )
    mass: float = number(
        minimum=0.1, maximum=1000.0, unit="kg",
        meaning="Heavier robots get stiffness and damping in proportion, so that they sink alike.",
    )
    friction: float = number(
        minimum=0.0, maximum=5.0, meaning="Coulomb coefficient of the pair sole and floor."
    )


@attrs.frozen
class Sensors(Settings):
    """Resolution, errors and delay of the sensors."""

    delay: float = number(
        minimum=0.0, maximum=1.0, unit="s",
        meaning="Time from sampling until the frame can be used.",
    )
    encoder_bits: int = number(
        minimum=0, maximum=24, whole=True, meaning="Counts per turn = 2^bits; 0 = exact."
    )
    gyro_axes: int = number(
        minimum=2, maximum=3, whole=True, meaning="2 = no yaw rate: the z axis reads 0."
    )
    gyro_noise: float = number(
        minimum=0.0, maximum=1.0, unit="rad/s",
        meaning="Standard deviation of the white noise per sample.",
    )
    gyro_bias: float = number(
        minimum=0.0, maximum=1.0, unit="rad/s",
        meaning="Standard deviation over robots; constant for one robot.",
    )
    gyro_range: float | None = number(
        minimum=0.1, maximum=1e3, unit="rad/s", optional=True,
        meaning="Readings saturate at +- this value; null = unlimited.",
    )
    accel_noise: float = number(
        minimum=0.0, maximum=10.0, unit="m/s^2",
        meaning="Standard deviation of the white noise per sample.",
    )
    accel_bias: float = number(
        minimum=0.0, maximum=10.0, unit="m/s^2",
        meaning="Standard deviation over robots; constant for one robot.",
    )
    accel_range: float | None = number(
        minimum=10.0, maximum=1e4, unit="m/s^2", optional=True,
        meaning="Readings saturate at +- this value; null = unlimited.",
    )
    effort_noise: float = number(
        0.0, 0.0, 1.0, "",
        "Standard deviation of the white noise of a motor's torque per sample, as a share of its "
        "stall torque.",
    )


@attrs.frozen
class ForceSensors(Settings):
    """The four force sensors of each sole; errors are drawn for each sensor of an individual."""

    four: bool = switch(
        False, "The wrenches are what the four sensors give; false = the exact wrenches."
    )
    gain: float = number(
        0.0, 0.0, 0.9, "", "Largest error of a sensor's gain, as a share; uniform."
    )
    offset: float = number(0.0, 0.0, 50.0, "N", "Largest offset of a sensor; uniform.")
    noise: float = number(0.0, 0.0, 50.0, "N", "Standard deviation of the white noise per sample.")
    dead_zone: float = number(0.0, 0.0, 50.0, "N", "Below this a sensor reads 0.")


@attrs.frozen
class Heat(Settings):
    """Temperature of the motors, and the voltage of the battery.

    The rise of temperature at nominal torque, its time constant and the fading are chosen; nominal
    torques and the battery are facts of the robot.
    """

    enabled: bool = switch(False, "Motors get hot and lose torque; the battery runs down.")
    ambient: float = number(
        25.0, -20.0, 50.0, "deg C", "Temperature of the motors at the start and around them."
    )
    rise: float = number(
        60.0, 1.0, 200.0, "K", "Final rise of a motor that gives its nominal torque at rest."
    )
    time_constant: float = number(
        500.0, 1.0, 1e4, "s", "Time constant of the temperature, of motors of this size."
    )
    fade_from: float = number(
        75.0, 20.0, 200.0, "deg C", "From here on a motor loses torque, linearly."
    )
    limit: float = number(90.0, 21.0, 250.0, "deg C", "Here a motor has no torque left.")
    charge: float = number(1.0, 0.01, 1.0, "", "Charge of the battery at the start.")
    electronics: float = number(
        15.0, 0.0, 200.0, "W", "Power of computer and boards beside the motors."
    )


@attrs.frozen
class Variation(Settings):
    """How individual robots differ from the nominal one."""

    joint_zero_std: float = number(
        minimum=0.0, maximum=0.2, unit="rad",
        meaning="Standard deviation of a joint's zero error, the same in command and encoder.",
    )
    joint_zero_cut: float = number(
        minimum=0.0, maximum=0.2, unit="rad", meaning="Largest zero error of a joint."
    )
    imu_mounting_std: float = number(
        minimum=0.0, maximum=0.2, unit="rad",
        meaning="Standard deviation of the IMU's mounting angle about each axis.",
    )
    mass: float = number(
        minimum=0.0, maximum=0.5, meaning="Each link's mass is scaled by 1 +- this, uniformly."
    )
    friction: tuple[float, float] | None = _range(
        0.0, 5.0, "Friction of sole and floor, uniform; replaces contact.friction."
    )
    stiffness_scale: tuple[float, float] | None = _range(
        0.01, 100.0, "Factor on the contact stiffness, uniform in its logarithm."
    )
    motor_strength: tuple[float, float] | None = _range(
        0.01, 2.0, "Factor on the torque of every motor, uniform."
    )
    wrong_joint: str = text("", "Joint whose zero is off by `wrong_zero` more, as after a repair.")
    wrong_zero: float = number(0.0, -0.35, 0.35, "rad", "See `wrong_joint`.")


@attrs.frozen
class Terrain(Settings):
    """The floor ahead of the robot; level unless a kind is given.

    The size of the field and the height of the hexagons are the second paper's; the rest is chosen.
    """

    kind: str = choice(
        ("flat", "hexagons", "ramp", "steps", "carpet"),
        "hexagons = plates of different height, ramp = up, level, down, steps = up, up, down, "
        "carpet = the whole floor is as soft as carpet_stiffness.",
    )
    start: float = number(0.25, 0.0, 10.0, "m", "Where the field begins in x.")
    length: float = number(1.0, 0.1, 10.0, "m", "Length of the field in x.")
    width: float = number(1.5, 0.1, 10.0, "m", "Width of the field in y.")
    height: float = number(
        0.015, 0.0, 0.1, "m", "Height of the highest plate, of the ramp, of each step."
    )
    plate: float = number(0.1, 0.02, 1.0, "m", "Width of a hexagon across its flats.")
    carpet_stiffness: float = number(
        2e3, 100.0, 1e7, "N/m",
        "Stiffness of a carpet under one corner of a sole, in series with the contact.",
    )


@attrs.frozen
class SoleDesign(Settings):
    """The soles of the robot."""

    kind: str = choice(
        ("own", "spring", "sponge"),
        "own = the robot's soles, spring = contact at the tips of leaf springs along the sides, "
        "sponge = soft soles of 206 mm by 50 mm.",
    )
    stiffness: float | None = number(
        None, 100.0, 1e7, "N/m",
        "Stiffness of the sole at one corner, in series with the floor; null = that of its kind.",
    )


@attrs.frozen
class CameraPlant(Settings):
    """The cameras; how they differ is drawn for each camera of each individual."""

    delay: float = number(
        0.1, 0.0, 1.0, "s", "Time from exposure until the image can be used."
    )
    shutter: float = number(
        0.01, 0.0, 0.1, "s", "Length of an exposure, for motion blur; the stamp is its middle."
    )
    noise: float = number(
        3.0, 0.0, 64.0, "grey levels", "Standard deviation of a pixel's noise, of 255."
    )
    exposure: float = number(
        1.25, 1.0, 4.0, "", "Largest factor on the brightness; the smallest is its inverse."
    )
    white_balance: float = number(
        1.1, 1.0, 2.0, "", "Largest factor on red and on blue; the smallest is its inverse."
    )
    vignette: tuple[float, float] = schema.field(
        Interval(Number(0.0, 0.9)), (0.1, 0.3), "Share of the light that a corner loses."
    )
    mounting: float = number(
        0.0, 0.0, 0.2, "rad", "Standard deviation of a camera's mounting about each of its axes."
    )


@attrs.frozen
class Plant(Settings):
    """A complete description of one kind of simulated robot and its floor."""

    name: str = schema.text()
    physics: Physics = group(Physics)
    motor: MotorPlant = group(MotorPlant)
    contact: Contact = group(Contact)
    sensors: Sensors = group(Sensors)
    variation: Variation = group(Variation)
    terrain: Terrain = group(Terrain, Terrain())
    sole: SoleDesign = group(SoleDesign, SoleDesign())
    camera: CameraPlant = group(CameraPlant, CameraPlant())
    force_sensors: ForceSensors = group(ForceSensors, ForceSensors())
    heat: Heat = group(Heat, Heat())


PlantValue = float | bool | str | tuple[float, float] | None
"""What an option can hold."""
PlantOption = tuple[str, PlantValue]
"""An option and its value: ("motor.play", 0.035)."""

_SECTIONS: dict[str, type[Settings]] = {
    field.name: field.kind.settings
    for field in schema.fields(Plant)
    if isinstance(field.kind, schema.Group)
}
_OPTIONS = {
    f"{section}.{field.name}": field
    for section, settings in _SECTIONS.items()
    for field in schema.fields(settings)
}


def load_plant(name_or_path: str) -> Plant:
    """Load the plant of a shipped name (`reference`, `ideal`, `worn`) or of a YAML file.

    Raises:
        NaoGaitError: Names the file, the key, its value and what is allowed.
    """
    path = find("plants", name_or_path)
    sections: dict[str, dict[str, Any]] = {}
    for layer, values in read_layers(path, "plant", "plants"):
        below = bool(sections)
        for section, options in values.items():
            where = f"{layer}: {section}"
            if section not in _SECTIONS:
                allowed = f"one of the keys base, {', '.join(_SECTIONS)}"
                raise NaoGaitError(where, options, allowed, _SECTIONS)
            own = _SECTIONS[section].checked(options, where, partial=True)
            sections[section] = {**sections.get(section, {}), **own}
        if below and "friction" in values.get("contact", ()):
            _check_friction(
                f"{layer}: contact.friction", sections["contact"]["friction"],
                sections.get("variation", {}).get("friction"),
            )  # fmt: skip
    return Plant.from_mapping({"name": path.stem, **sections}, f"{path}: ")


def _check_friction(where: str, friction: float, drawn: tuple[float, float] | None) -> None:
    """Refuse a friction that has no effect, because each individual draws its own."""
    if drawn is not None:
        allowed = "set variation.friction to null as well: each robot draws its friction from there"
        raise NaoGaitError(where, friction, allowed)


def with_sensors_of(plant: Plant, robot: RobotDescription) -> Plant:
    """Adapt the sensors to those of the robot; exact sensors stay exact."""
    sensors = plant.sensors
    axes = max(sensors.gyro_axes, robot.gyro_axes or 0)
    bits = sensors.encoder_bits
    if robot.encoder_bits is not None:
        bits = min(bits, robot.encoder_bits)
    return with_options(plant, (("sensors.gyro_axes", axes), ("sensors.encoder_bits", bits)))


def with_options(plant: Plant, options: Iterable[PlantOption]) -> Plant:
    """Replace some options of a plant; of an option given twice, the last value counts.

    Raises:
        NaoGaitError: No plant has this option, it cannot hold this value, or it has no effect.
    """
    options = tuple(options)
    for name, value in options:
        checked = _option(name).kind.check(name, value)
        section, _, key = name.partition(".")
        part = attrs.evolve(getattr(plant, section), **{key: checked})
        plant = attrs.evolve(plant, **{section: part})
    if "contact.friction" in dict(options):
        _check_friction("contact.friction", plant.contact.friction, plant.variation.friction)
    return plant


def parse_options(settings: Iterable[str]) -> tuple[PlantOption, ...]:
    """Parse options like `motor.play=0.035`; a value is written as in the YAML of a plant.

    Raises:
        NaoGaitError: It is no option of a plant, or its value is not allowed.
    """
    options: list[PlantOption] = []
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals or not text.strip():
            raise NaoGaitError("plant option", setting, "section.option=value")
        options.append((name, _option(name).kind.check(name, schema.value_of(text))))
    return tuple(options)


def option_text(option: PlantOption) -> str:
    """Write an option so that `parse_options` reads it."""
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


def _option(name: str) -> schema.Field:
    """The field of `section.option`."""
    option = _OPTIONS.get(name)
    if option is None:
        raise NaoGaitError("plant option", name, _OPTIONS)
    return option
