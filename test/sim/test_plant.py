"""Plants: the shipped ones, files that are based on others, and the refusal of wrong options."""

import copy
import math
from pathlib import Path
from typing import Any

import attrs
import pytest
import yaml

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.resources import find, names
from sim_bridge.plant import (
    Contact,
    MotorPlant,
    Physics,
    Plant,
    Sensors,
    Variation,
    load_plant,
    option_text,
    parse_options,
    with_options,
)

SECTIONS = {
    "physics": Physics,
    "motor": MotorPlant,
    "contact": Contact,
    "sensors": Sensors,
    "variation": Variation,
}
OPTIONS = [
    (section, field) for section, kind in SECTIONS.items() for field in schema.fields(kind)
]
Settings = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def reference() -> Settings:
    return dict(yaml.safe_load(find("plants", "reference").read_text()))


def load(folder: Path, settings: object) -> Plant:
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(settings))
    return load_plant(str(path))


def test_reference_is_the_plant_that_figures_are_measured_on() -> None:
    plant = load_plant("reference")
    assert plant.name == "reference"
    assert plant.physics == Physics(0.002, 9.81, 50, self_collision=True)
    motor = plant.motor
    assert (motor.lag, motor.torque_fraction) == (0.015, 0.7)
    assert motor.torque_speed_line
    assert motor.speed_limit
    assert (motor.stiffness, motor.armature, motor.friction, motor.play) == (None, None, 0.0, 0.0)
    assert plant.contact == Contact(
        rigid=False, stiffness=1e4, damping=200.0, mass=6.0, friction=0.6
    )
    assert plant.sensors.delay == 0.040
    assert plant.sensors.encoder_bits == 12
    assert plant.sensors.gyro_axes == 2
    assert min(plant.sensors.gyro_noise, plant.sensors.gyro_bias) > 0.0
    assert min(plant.sensors.accel_noise, plant.sensors.accel_bias) > 0.0
    variation = plant.variation
    assert math.degrees(variation.joint_zero_std) == pytest.approx(0.5, abs=1e-5)
    assert math.degrees(variation.joint_zero_cut) == pytest.approx(1.0, abs=1e-5)
    assert math.degrees(variation.imu_mounting_std) == pytest.approx(0.5, abs=1e-5)
    assert variation.mass == 0.03
    assert variation.friction == (0.4, 0.8)
    assert variation.stiffness_scale == (0.7, 1.4)
    assert variation.motor_strength == (0.85, 1.0)


def test_ideal_is_rigid_exact_and_in_time() -> None:
    plant = load_plant("ideal")
    assert plant.contact.rigid
    assert plant.motor.lag == plant.motor.friction == plant.motor.play == 0.0
    sensors = plant.sensors
    assert sensors.delay == sensors.encoder_bits == 0
    assert sensors.gyro_noise == sensors.gyro_bias == sensors.accel_noise == 0.0
    assert sensors.effort_noise == 0.0
    assert plant.variation == Variation(0.0, 0.0, 0.0, 0.0, None, None, None)


def test_worn_is_reference_with_worse_motors() -> None:
    worn, reference = load_plant("worn"), load_plant("reference")
    assert worn.motor.stiffness is not None
    assert worn.motor.armature == 1.0
    assert worn.motor.friction > 0.0
    assert math.degrees(worn.motor.play) == pytest.approx(1.2, abs=1e-4)
    assert attrs.evolve(worn, name="reference", motor=reference.motor) == reference


def test_every_shipped_plant_loads() -> None:
    assert {load_plant(name).name for name in names("plants")} >= {"reference", "ideal", "worn"}


def test_an_unknown_name_lists_the_plants() -> None:
    with pytest.raises(NaoGaitError, match=r"got 'perfect'.*ideal, reference, worn"):
        load_plant("perfect")


def test_a_file_of_my_own_takes_its_name(tmp_path: Path, reference: Settings) -> None:
    settings = copy.deepcopy(reference)
    settings["contact"]["friction"] = 1
    plant = load(tmp_path, settings)
    assert plant.name == "mine"
    assert plant.contact.friction == 1.0
    assert isinstance(plant.contact.friction, float)
    shipped = load_plant("reference")
    assert attrs.evolve(plant, name=shipped.name, contact=shipped.contact) == shipped


@pytest.mark.parametrize(
    ("section", "field"), OPTIONS, ids=[f"{section}.{field.name}" for section, field in OPTIONS]
)
def test_every_option_is_checked(
    tmp_path: Path, reference: Settings, section: str, field: schema.Field
) -> None:
    kind = field.kind.kind if isinstance(field.kind, schema.Optional) else field.kind
    wrong: list[object] = ["much", {"a": 1}, math.nan]
    if kind is field.kind:
        wrong.append(None)
    if isinstance(kind, schema.Text):
        wrong.remove("much")
    elif isinstance(kind, schema.Switch):
        wrong += [1, 0.0, [True]]
    elif isinstance(kind, schema.Interval):
        low, high = kind.number.minimum, kind.number.maximum
        wrong += [low, [low - 1.0, high], [low, high + 1.0], [high, low], [low, math.nan], [low]]
    elif isinstance(kind, schema.Number):
        wrong += [True, math.inf, [kind.minimum], kind.minimum - 1, kind.maximum + 1]
        wrong += [kind.minimum + 0.5] if kind.whole else []
    for value in wrong:
        settings = copy.deepcopy(reference)
        settings[section][field.name] = value
        with pytest.raises(NaoGaitError) as refused:
            load(tmp_path, settings)
        assert refused.value.field == f"{tmp_path / 'mine.yaml'}: {section}.{field.name}"
        assert refused.value.allowed == field.allowed


@pytest.mark.parametrize(
    ("section", "key"), [(None, "wind"), ("motor", "stifness"), ("variation", "speed")]
)
def test_an_unknown_key_is_named(
    tmp_path: Path, reference: Settings, section: str | None, key: str
) -> None:
    settings = copy.deepcopy(reference)
    (settings if section is None else settings[section])[key] = 1.0  # type: ignore[assignment]
    with pytest.raises(NaoGaitError) as refused:
        load(tmp_path, settings)
    path = key if section is None else f"{section}.{key}"
    assert refused.value.field == f"{tmp_path / 'mine.yaml'}: {path}"
    known = tuple(reference if section is None else reference[section])
    assert all(name in refused.value.allowed for name in known)


@pytest.mark.parametrize(("section", "key"), [(None, "sensors"), ("sensors", "delay")])
def test_a_missing_key_is_named(
    tmp_path: Path, reference: Settings, section: str | None, key: str
) -> None:
    settings: Any = copy.deepcopy(reference)
    del (settings if section is None else settings[section])[key]
    with pytest.raises(NaoGaitError, match="required") as refused:
        load(tmp_path, settings)
    assert refused.value.field.endswith(f"mine.yaml: {f'{section}.' if section else ''}{key}")


# -- plants that are based on others ---------------------------------------------------------------


def test_a_plant_names_only_what_differs_from_its_base(tmp_path: Path) -> None:
    plant = load(tmp_path, {"base": "reference", "motor": {"lag": 0.03}})
    shipped = load_plant("reference")
    assert plant.name == "mine"
    assert plant == attrs.evolve(shipped, name="mine", motor=shipped.motor.replace(lag=0.03))


def test_a_base_may_be_a_file_beside_the_plant_with_a_base_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "slow.yaml").write_text("base: worn\nmotor: {lag: 0.03, play: 0.0}")
    plant = load(tmp_path, {"base": "slow.yaml", "motor": {"play": 0.01}})
    worn = load_plant("worn")
    assert plant.motor == worn.motor.replace(lag=0.03, play=0.01)


@pytest.mark.parametrize("base", ["perfect", "no.yaml", 3, None, ["reference"]])
def test_an_unknown_base_is_refused(tmp_path: Path, base: object) -> None:
    with pytest.raises(NaoGaitError, match=r"mine\.yaml: base: got") as refused:
        load(tmp_path, {"base": base})
    assert refused.value.value == base


def test_plants_that_are_based_on_each_other_are_refused(tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("base: mine.yaml")
    with pytest.raises(NaoGaitError, match=r"other\.yaml: base: .*not based on this one"):
        load(tmp_path, {"base": "other.yaml"})
    with pytest.raises(NaoGaitError, match=r"mine\.yaml: base"):
        load(tmp_path, {"base": "mine.yaml"})


def test_an_error_in_a_base_names_the_file_of_the_base(tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("base: reference\nmotor: {lag: -1}")
    with pytest.raises(NaoGaitError, match=r"other\.yaml: motor\.lag: got -1"):
        load(tmp_path, {"base": "other.yaml", "motor": {"lag": 0.01}})


# -- files that are no plants ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "text", ["", "- 1", "physics: 3", "a: [unclosed", "!!python/object/apply:os.getcwd []"]
)
def test_what_is_no_plant_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError, match=r"bad\.yaml"):
        load_plant(str(path))


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "binary.yaml"
    path.write_bytes(b"\xff\xfe\x00physics")
    with pytest.raises(NaoGaitError, match=r"binary\.yaml"):
        load_plant(str(path))


def test_options_are_replaced_one_by_one_and_the_rest_stays() -> None:
    reference = load_plant("reference")
    changed = with_options(
        reference, (("motor.play", 0.1), ("motor.play", 0.035), ("variation.friction", None))
    )
    assert changed.motor == attrs.evolve(reference.motor, play=0.035)
    assert changed.variation == attrs.evolve(reference.variation, friction=None)
    assert (changed.physics, changed.contact) == (reference.physics, reference.contact)
    assert with_options(reference, ()) == reference


@pytest.mark.parametrize(
    ("name", "value", "field"),
    [("motor.play", 0.3, "motor.play"), ("motor.play", None, "motor.play"),
     ("motor.torque_speed_line", 1.0, "motor.torque_speed_line"),
     ("motor.slack", 0.1, "plant option"), ("play", 0.1, "plant option"),
     ("name", "x", "plant option"), ("motor.", 1, "plant option")],
)  # fmt: skip
def test_wrong_options_are_refused_by_name(name: str, value: Any, field: str) -> None:
    with pytest.raises(NaoGaitError) as caught:
        with_options(load_plant("reference"), ((name, value),))
    assert caught.value.field == field


def test_options_are_typed_as_in_the_file() -> None:
    typed = ("motor.play=0.035", "motor.stiffness=null", "contact.stiffness=1e4",
             "motor.torque_speed_line=false", "variation.friction=[0.2, 0.3]",
             "sensors.encoder_bits=10")  # fmt: skip
    options = parse_options(typed)
    assert options == (
        ("motor.play", 0.035), ("motor.stiffness", None), ("contact.stiffness", 1e4),
        ("motor.torque_speed_line", False), ("variation.friction", (0.2, 0.3)),
        ("sensors.encoder_bits", 10),
    )  # fmt: skip
    assert parse_options(option_text(option) for option in options) == options


@pytest.mark.parametrize("text", ["motor.play", "motor.play=", "motor.play=much", "motor.play=.nan",
                                  "motor.play=[", "slack=1", "motor.play=9"])  # fmt: skip
def test_badly_typed_options_are_refused(text: str) -> None:
    with pytest.raises(NaoGaitError):
        parse_options((text,))
