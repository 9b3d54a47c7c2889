"""Messages of the GameController: bytes built from the published layout, and foreign bytes."""

import struct
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nao_soccer.game_state import Competition, GamePhase, Phase, SetPlay
from nao_soccer.referee.protocol import (
    SIZES,
    VERSIONS,
    ControlMessage,
    Penalty,
    PlayerInfo,
    ReturnMessage,
    TeamInfo,
    decode,
    decode_return,
    seen_by,
)
from robot_core.errors import NaoGaitError


def layout(version: int, penalty: int = 0, state: int = 3, set_play: int = 0) -> bytes:
    """A message of teams 5 and 7, field by field as the header file has them.

    Player 2 of team 7 has the penalty.
    """
    seventh, eighth = (1, 0) if version <= 18 else (0, 0)
    data = b"RGme" + bytes((version, 200, 4, seventh, eighth, 0, state, set_play, 1, 7))
    data += struct.pack("<hh", 431, -3)
    extra = {19: 2, 20: 1}.get(version, 0)
    for number, score in ((5, 2), (7, 1)):
        data += bytes((number, 0, 2, 1, score, 0)) + struct.pack("<HH", 0, 1111)
        for player in range(1, 21):
            away = penalty if (number, player) == (7, 2) else 0
            data += bytes((away, 30 if away else 0)) + bytes(extra)
    return data


@pytest.mark.parametrize(("version", "size"), [(15, 118), (18, 118), (19, 198), (20, 158)])
def test_a_message_of_each_version_is_read(version: int, size: int) -> None:
    data = layout(version)
    assert len(data) == size == SIZES[version]
    message = decode(data)
    assert message.version == version
    assert (message.packet, message.players_per_team) == (200, 4)
    assert (message.phase, message.kicking_team) == (Phase.PLAYING, 7)
    assert (message.seconds_remaining, message.secondary_time) == (431, -3)
    assert [(team.number, team.score) for team in message.teams] == [(5, 2), (7, 1)]
    assert message.teams[1].message_budget == 1111
    assert message.encode()[4:] == data[4:7] + message.encode()[7:9] + data[9:] or version != 18


@pytest.mark.parametrize(
    ("version", "code", "penalty"),
    [
        (18, 4, Penalty.INCAPABLE),
        (19, 4, Penalty.INCAPABLE),
        (20, 4, Penalty.GAME_STUCK),
        (20, 5, Penalty.INCAPABLE),
        (18, 7, Penalty.PICK_UP),
        (19, 5, Penalty.PICK_UP),
        (20, 6, Penalty.PICK_UP),
        (18, 99, Penalty.OTHER),
        (18, 11, Penalty.MOTION_IN_STANDBY),
        (15, 11, Penalty.OTHER),
        (20, 3, Penalty.MOTION_IN_STOP),
    ],
)
def test_penalties_are_numbered_by_the_version(version: int, code: int, penalty: Penalty) -> None:
    message = decode(layout(version, code))
    assert message.teams[1].players[1] == PlayerInfo(penalty, 30)
    assert seen_by(message, 7, 2).penalized
    assert not seen_by(message, 7, 1).penalized


@pytest.mark.parametrize(
    ("version", "code", "set_play"),
    [(18, 1, SetPlay.GOAL_KICK), (20, 5, SetPlay.GOAL_KICK), (18, 4, SetPlay.KICK_IN)],
)
def test_set_plays_are_numbered_by_the_version(version: int, code: int, set_play: SetPlay) -> None:
    assert decode(layout(version, set_play=code)).set_play is set_play


def test_each_player_sees_the_game_from_its_own_side() -> None:
    message = decode(layout(18))
    own, other = seen_by(message, 7, 2), seen_by(message, 5, 2)
    assert (own.own_kick, other.own_kick) == (True, False)
    assert (own.own_score, own.other_score) == (1, 2)
    assert own.message_budget == 1111
    for team, player in ((6, 1), (7, 21), (7, 0)):
        with pytest.raises(NaoGaitError):
            seen_by(message, team, player)


def test_a_substitute_has_a_number_beyond_those_on_the_field() -> None:
    """As in the Standard Platform League: 7 on the field, numbers to 20."""
    message = decode(layout(18))
    assert message.players_per_team == 4
    assert not seen_by(message, 7, 12).penalized
    away = tuple(replace(each, penalty=Penalty.SUBSTITUTE) for each in message.teams[1].players)
    teams = (message.teams[0], replace(message.teams[1], players=away))
    waits = decode(replace(message, teams=teams).encode())
    assert seen_by(waits, 7, 12).penalized


@pytest.mark.parametrize("count", [21, 255])
def test_more_players_than_a_message_holds_are_refused(count: int) -> None:
    data = layout(18)
    with pytest.raises(NaoGaitError, match="players per team"):
        decode(data[:6] + bytes((count,)) + data[7:])
    with pytest.raises(NaoGaitError, match="players per team"):
        replace(decode(data), players_per_team=count).encode()


def with_competition(message: ControlMessage) -> ControlMessage:
    """The same with a competition that its version knows."""
    old = message.version <= 18
    return replace(message, competition=Competition.MOST_PASSES if old else Competition.MIDDLE)


players = st.lists(
    st.builds(PlayerInfo, st.sampled_from([Penalty.NONE, Penalty.PUSHING]), st.integers(0, 255)),
    min_size=20, max_size=20,
).map(tuple)  # fmt: skip
teams = st.builds(
    TeamInfo, st.integers(0, 255), st.integers(0, 255), st.integers(0, 20), st.integers(0, 65535),
    st.integers(0, 9), st.integers(0, 9), players,
)  # fmt: skip
messages = st.builds(
    ControlMessage, st.tuples(teams, teams),
    st.sampled_from([each for each in Phase if each is not Phase.STANDBY]),
    st.sampled_from([SetPlay.NONE, SetPlay.KICK_IN, SetPlay.CORNER_KICK, SetPlay.GOAL_KICK]),
    st.none() | st.integers(0, 254), st.booleans(), st.integers(-32768, 32767),
    st.integers(-32768, 32767), st.just(6), st.integers(0, 255), st.just(False),
    st.sampled_from(VERSIONS), st.sampled_from(GamePhase),
).map(with_competition)  # fmt: skip


@given(messages)
@settings(max_examples=150)
def test_what_was_written_is_read(message: ControlMessage) -> None:
    assert decode(message.encode()) == message


@given(st.binary(max_size=260))
@settings(max_examples=300)
def test_foreign_bytes_are_refused_in_one_line(data: bytes) -> None:
    for read in (decode, decode_return):
        with pytest.raises(NaoGaitError) as error:
            read(data)
        assert "\n" not in str(error.value)


@given(st.sampled_from(VERSIONS), st.integers(0, 197), st.integers(0, 255))
@settings(max_examples=300)
def test_a_damaged_message_is_read_or_refused(version: int, place: int, value: int) -> None:
    data = bytearray(layout(version))
    data[place % len(data)] = value
    try:
        message = decode(bytes(data))
    except NaoGaitError:
        return
    assert message.version == version


@pytest.mark.parametrize("version", VERSIONS)
def test_a_truncated_message_is_refused(version: int) -> None:
    data = layout(version)
    for length in range(len(data)):
        with pytest.raises(NaoGaitError):
            decode(data[:length])
    with pytest.raises(NaoGaitError):
        decode(data + b"\0")


def test_the_return_message_has_its_published_layout() -> None:
    sent = ReturnMessage(3, 7, True, (1.0, -0.5, 0.25), 1.5, (0.5, 0.0))
    data = sent.encode()
    assert len(data) == 32
    assert data[:8] == b"RGrt\x04\x03\x07\x01"
    assert struct.unpack("<6f", data[8:]) == (1000.0, -500.0, 0.25, 1.5, 500.0, 0.0)
    assert decode_return(data) == sent
    unseen = replace(sent, ball_age=None)
    assert struct.unpack_from("<f", unseen.encode(), 20) == (-1.0,)
    with pytest.raises(NaoGaitError):
        decode_return(data[:8] + struct.pack("<f", float("nan")) + data[12:])
