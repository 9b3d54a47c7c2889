"""The protocol of rcsssmj: expressions, percepts, actions, frames."""

import base64
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcss_bridge import codec
from rcss_bridge.codec import Motor, Unframer, framed
from rcss_bridge.joints import ROBOTS
from rcss_bridge.sexpr import DEPTH_MAX, parse, write
from rcss_server import cycle_message
from robot_core.errors import NaoGaitError

K1 = ROBOTS["K1"]
ATOMS = st.text(
    st.characters(exclude_categories=("Z", "C"), exclude_characters="()"), min_size=1, max_size=8
)
EXPRESSIONS = st.recursive(
    st.lists(ATOMS, max_size=4), lambda inner: st.lists(ATOMS | inner, max_size=4), max_leaves=20
)


@given(EXPRESSIONS)
def test_what_is_written_is_read(expression: list):
    assert parse(write(expression)) == expression


@given(st.lists(st.binary(max_size=300), max_size=6), st.integers(1, 7))
def test_frames_come_out_as_they_went_in_however_they_arrive(messages: list, piece: int):
    stream = b"".join(map(framed, messages))
    unframer, found = Unframer(), []
    for start in range(0, len(stream), piece):
        unframer.add(stream[start : start + piece])
        while (message := unframer.next()) is not None:
            found.append(message)
    assert found == messages


def refused_or_read(message: bytes):
    refusal = ""
    try:
        codec.percepts(message)
    except NaoGaitError as error:
        refusal = str(error)
    assert "\n" not in refusal


@settings(max_examples=300)
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_in_one_line(message: bytes):
    refused_or_read(message)


@settings(max_examples=300)
@given(st.data())
def test_a_damaged_message_is_read_or_refused_in_one_line(data: st.DataObject):
    good = cycle_message(K1, 3.14, more=[["See", ["B", ["pol", 1, 2, 3]]]])
    start = data.draw(st.integers(0, len(good)))
    length = data.draw(st.integers(0, 40))
    refused_or_read(good[:start] + data.draw(st.binary(max_size=8)) + good[start + length :])


@pytest.mark.parametrize(
    "message",
    [
        b"(", b")", b"(a))", b"\xff\xfe", b"(" * (DEPTH_MAX + 2) + b")" * (DEPTH_MAX + 2), b"",
        b"(error)", b"(syn)",
        cycle_message(K1, math.nan),
        cycle_message(K1, 0.0, gyro=(0, "inf", 0)),
        cycle_message(K1, 0.0, force=(0, 0)),
        cycle_message(K1, 0.0, more=[["See", ["P", ["team", "x"]]]]),
        cycle_message(K1, 0.0, more=[["MIC", "hear", [0, "a"]]]),
    ],
)  # fmt: skip
def test_hostile_messages_are_refused(message: bytes):
    with pytest.raises(NaoGaitError):
        codec.percepts(message)


def test_a_message_of_a_gigabyte_is_not_waited_for():
    unframer = Unframer()
    unframer.add((1 << 30).to_bytes(4, "big"))
    with pytest.raises(NaoGaitError, match="at most"):
        unframer.next()


def test_percepts_are_in_si_units_and_hold_no_truth():
    see = [
        "See",
        ["l_llf", ["pol", 5.0, 90.0, -45.0]],
        ["B", ["pol", 2.0, -30.0, 0.0]],
        ["P", ["team", "theirs"], ["id", 7], ["head", ["pol", 3.0, 10.0, 5.0]]],
    ]
    speech = base64.b64encode(b"\x00\xff hello").decode()
    message = cycle_message(
        K1, 12.34, angles=range(22), gyro=(180, -90, 0), force=(0.1, -0.2, 9.8),
        more=[see, ["MIC", "hear", [-90, speech]]],
    )  # fmt: skip
    found = codec.percepts(message)
    assert found.time == 12.34
    assert found.game == (1.5, "PlayOn", "ours", "theirs", (2, 1))
    assert found.joints["hj1"] == 0.0
    assert found.joints["rlj6"] == pytest.approx(math.radians(21))
    assert found.angular_velocity == pytest.approx((math.pi, -math.pi / 2, 0))
    assert found.linear_acceleration == (0.1, -0.2, 9.8)
    assert found.sight is not None
    assert found.sight.marks["l_llf"] == pytest.approx((5.0, math.pi / 2, -math.pi / 4))
    assert found.sight.ball == pytest.approx((2.0, -math.pi / 6, 0.0))
    (player,) = found.sight.players
    assert (player.team, player.number) == ("theirs", 7)
    assert player.parts["head"].distance == 3.0
    (heard,) = found.heard
    assert heard.data == b"\x00\xff hello"
    assert heard.azimuth == pytest.approx(-math.pi / 2)
    assert "77.5" in message.decode()
    assert "77.5" not in repr(found), "the true place reaches the player"
    assert codec.torso_truth(message) == ((77.5, -66.5, 55.5), (1.0, 0.0, 0.0, 0.0))


def test_a_cycle_without_vision_is_not_an_empty_image():
    assert codec.percepts(cycle_message(K1, 0.0)).sight is None
    found = codec.percepts(cycle_message(K1, 0.0, more=[["See"]])).sight
    assert found is not None
    assert (found.ball, found.marks, found.players) == (None, {}, ())


NUMBERS = st.floats(-1e3, 1e3)
MOTORS = st.builds(Motor, NUMBERS, NUMBERS, st.floats(0, 1e3), st.floats(0, 1e3), NUMBERS)


@given(
    st.dictionaries(st.sampled_from(sorted(K1.effectors.values())), MOTORS),
    st.none() | st.tuples(NUMBERS, NUMBERS, NUMBERS),
    st.none() | st.binary(min_size=1, max_size=codec.SPEECH_MAX),
)
def test_actions_say_what_they_were_made_of(motors: dict, beam: tuple | None, speech: bytes | None):
    found = parse(codec.actions(motors, beam, speech))
    assert found.pop() == ["syn"]
    if speech is not None:
        *head, text = found.pop()
        assert head == ["SPK", "say", "100"]
        assert base64.b64decode(text) == speech
    if beam is not None:
        name, *values = found.pop()
        x, y, yaw = map(float, values)
        assert name == "beam"
        assert (x, y) == pytest.approx(beam[:2], abs=1e-3)
        assert yaw == pytest.approx(math.degrees(beam[2]), abs=1e-2)
    assert [each[0] for each in found] == list(motors)
    for (_, *values), motor in zip(found, motors.values(), strict=True):
        q, dq, *rest = map(float, values)
        assert (math.radians(q), math.radians(dq)) == pytest.approx(motor[:2], abs=1e-5)
        assert rest == pytest.approx(motor[2:], abs=1e-3)


@pytest.mark.parametrize(
    "arguments",
    [
        ({"lle1": Motor(math.nan, 0, 1, 1, 0)},), ({}, (0.0, math.inf, 0.0)),
        ({}, None, b""), ({}, None, b"x" * 11),
    ],
)  # fmt: skip
def test_actions_that_make_no_sense_are_refused(arguments: tuple):
    with pytest.raises(NaoGaitError):
        codec.actions(*arguments)


@pytest.mark.parametrize("team", ["", "a b", "(x)", "a\nb"])
def test_names_that_would_break_the_protocol_are_refused(team: str):
    with pytest.raises(NaoGaitError):
        codec.init("K1", team, 1)
