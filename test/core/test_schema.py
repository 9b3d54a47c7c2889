"""The schema: strict values, paths in every refusal, one line per refusal."""

import math
import pickle
from enum import StrEnum
from pathlib import Path

import attrs
import numpy as np
import pytest
import yaml

from robot_core import schema
from robot_core.errors import NaoGaitError, one_line
from robot_core.schema import Settings, choice, group, number, switch, text


class Colour(StrEnum):
    """A choice."""

    RED = "red"
    BLUE = "blue"


@attrs.frozen
class Wheel(Settings):
    """A nested group."""

    radius: float = number(minimum=0.1, maximum=1.0, unit="m", meaning="Of the tyre.")
    spokes: int = number(8, 2, 40, whole=True)


@attrs.frozen
class Cart(Settings):
    """A group of every kind of field."""

    name: str = text()
    front: Wheel = group(Wheel)
    colour: Colour = choice(Colour)
    brake: bool = switch(False)
    load: float | None = number(None, 0.0, 50.0, "kg")
    play: tuple[float, float] = schema.field(schema.Interval(schema.Number(0.0, 1.0)), (0.0, 0.5))
    seats: tuple[str, ...] = schema.field(schema.Sequence(schema.Text(), unique=True), ())
    prices: dict[str, float] = schema.field(
        schema.Table(schema.Number(0.0, 9.0)), attrs.Factory(dict)
    )


GOOD = {"name": "red one", "front": {"radius": 1}}


def test_values_get_their_own_types_and_defaults() -> None:
    cart = Cart.from_mapping({**GOOD, "colour": "blue", "load": 3, "play": [0, 1], "seats": ["a"]})
    assert cart.front == Wheel(1.0)
    assert isinstance(cart.front.radius, float)
    assert cart.colour is Colour.BLUE
    assert isinstance(cart.load, float)
    assert cart.play == (0.0, 1.0)
    assert cart.seats == ("a",)
    assert cart.prices == {}
    assert not cart.brake
    assert pickle.loads(pickle.dumps(cart)) == cart


@pytest.mark.parametrize(
    ("change", "field", "allowed"),
    [
        ({"name": ""}, "cart.name", "a text"),
        ({"name": 3}, "cart.name", "a text"),
        ({"front": 3}, "cart.front", "a mapping of radius, spokes"),
        ({"front": {}}, "cart.front.radius", "a number from 0.1 to 1 m (required)"),
        ({"front": {"radius": True}}, "cart.front.radius", "a number from 0.1 to 1 m"),
        ({"front": {"radius": math.nan}}, "cart.front.radius", "a number from 0.1 to 1 m"),
        ({"front": {"radius": 10**400}}, "cart.front.radius", "a number from 0.1 to 1 m"),
        ({"front": {"radius": 10**5000}}, "cart.front.radius", "a number from 0.1 to 1 m"),
        ({"front": {"radius": 0.5, "spokes": 2.5}}, "cart.front.spokes", "a whole number"),
        ({"front": {"radius": 0.5, "spikes": 2}}, "cart.front.spikes", "keys radius, spokes"),
        ({"colour": "green"}, "cart.colour", "one of red, blue"),
        ({"colour": ["red"]}, "cart.colour", "one of red, blue"),
        ({"brake": 0}, "cart.brake", "true or false"),
        ({"brake": None}, "cart.brake", "true or false"),
        ({"load": math.inf}, "cart.load", "a number from 0 to 50 kg, or null"),
        ({"play": [1.0, 0.0]}, "cart.play", "[low, high] from 0 to 1, low <= high"),
        ({"play": [0.0]}, "cart.play", "[low, high]"),
        ({"seats": "a"}, "cart.seats", "a list"),
        ({"seats": ["a", "a"]}, "cart.seats", "each item once"),
        ({"seats": ["a", 1]}, "cart.seats[2]", "a text"),
        ({"prices": {"sand": -1}}, "cart.prices.sand", "a number from 0 to 9"),
        ({3: 4}, "cart.3", "one of the keys name, front"),
    ],
)
def test_a_refusal_names_the_path_and_what_is_allowed_in_one_line(
    change: dict[object, object], field: str, allowed: str
) -> None:
    with pytest.raises(NaoGaitError) as refused:
        Cart.from_mapping({**GOOD, **change}, "cart")
    assert refused.value.field == field
    assert allowed in refused.value.allowed
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 600


@pytest.mark.parametrize(
    ("field", "value", "names", "meant"),
    [
        ("cart.front.spoeks", 3, ("radius", "spokes"), "spokes"),
        ("cart.front.spoeks", "wood", ("radius", "spokes"), "spokes"),
        ("cart.colour", "blu", ("red", "blue"), "blue"),
        ("set", "brkae=true", ("brake", "load"), "brake"),
        ("cart.colour", "green", ("red", "blue"), None),
        ("cart.colour", "red", ("red", "blue"), None),
        ("cart.spokes", 3, ("1", "2"), None),
        ("cart.colour", "r" * 10_000, ("red", "blue"), None),
        ("cart.spokes", "ten", (), None),
    ],
)
def test_a_name_that_resembles_an_allowed_one_is_asked_for(
    field: str, value: object, names: tuple[str, ...], meant: str | None
) -> None:
    asked = f" did you mean {meant}?" if meant else ""
    among = NaoGaitError(field, value, "what is in the file", names)
    assert str(among).endswith(f";{asked} allowed: what is in the file")
    assert str(pickle.loads(pickle.dumps(among))) == str(among)
    alone = NaoGaitError(field, value, names)
    assert alone.allowed == f"one of {', '.join(names)}"
    assert str(alone).endswith(f";{asked} allowed: {alone.allowed}")


@pytest.mark.parametrize(
    "content", ["a: 1\nfoot: 2\nfoot: 3", "a: [{b: {foot: 1, 'foot': 1}}]"]
)  # fmt: skip
def test_a_key_that_is_given_twice_is_refused(content: str) -> None:
    with pytest.raises(NaoGaitError, match=r"thing: got 'foot twice \(line [13]\)'"):
        schema.parse_yaml(content, "thing")


def test_a_key_may_replace_one_that_is_merged() -> None:
    text = "a: &a {x: 1, y: 2}\nb: &b {<<: *a, x: 3}\nc: {<<: *a, y: 4}"
    assert schema.parse_yaml(text, "thing") == yaml.safe_load(text)
    assert schema.parse_yaml("", "thing") is None


def test_fields_are_checked_in_code_too() -> None:
    with pytest.raises(NaoGaitError, match="radius"):
        Wheel(radius=3.0)
    with pytest.raises(NaoGaitError, match="radius"):
        Wheel(0.5).replace(radius=3.0)
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        Wheel(0.5).radius = 0.7  # type: ignore[misc]


def test_fields_describe_themselves() -> None:
    radius, spokes = schema.fields(Wheel)
    assert (radius.minimum, radius.maximum, radius.unit) == (0.1, 1.0, "m")
    assert radius.default is schema.REQUIRED
    assert radius.meaning == "Of the tyre."
    assert (spokes.default, spokes.is_number, spokes.is_switch) == (8, True, False)


@pytest.mark.parametrize(
    "content",
    [b"a: [unclosed", b"\xff\xfe\x00", b"a: " + b"9" * 5000, b"[" * 3000, b"!!python/name:os.x"],
    ids=["syntax", "no text", "huge integer", "deep", "object"],
)  # fmt: skip
def test_an_unreadable_file_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.yaml"
    path.write_bytes(content)
    with pytest.raises(NaoGaitError, match=r"thing .*bad\.yaml.*readable") as refused:
        schema.read_yaml(path, "thing")
    assert "\n" not in str(refused.value)


def test_numbers_of_numpy_are_shown_as_numbers() -> None:
    values = np.array((0.0, -1.5e-3, np.nan)), np.float64(2.5), np.int64(3), [np.float32(0.5)]
    shown = [str(NaoGaitError("field", value, "none")) for value in (list(values[0]), *values[1:])]
    assert not any("np." in text for text in shown)
    assert "got [0.0, -0.0015, nan];" in shown[0]
    assert ["got 2.5;" in shown[1], "got 3;" in shown[2], "got [0.5];" in shown[3]] == [True] * 3


def test_an_unexpected_error_is_one_line_with_its_place() -> None:
    with pytest.raises(ZeroDivisionError) as found:
        _divide()
    text = one_line(found.value)
    assert text.startswith("ZeroDivisionError: on two lines (test_schema.py:")
    assert text.endswith(" in _divide)")
    assert one_line(ValueError("never raised")) == "ValueError: never raised"


def _divide() -> None:
    raise ZeroDivisionError("on two\n  lines")
