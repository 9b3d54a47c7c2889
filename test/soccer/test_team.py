"""Team messages, what is accepted, and roles under loss."""

import select
import socket
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nao_soccer.game_state import Role
from nao_soccer.team.link import PERIOD, SILENCE, TeamLink
from nao_soccer.team.message import (
    NEVER,
    ROBOT_AGE_MAX,
    ROBOTS_MAX,
    SIZE_MAX,
    SIZES,
    BallMessage,
    TeamMessage,
    decode,
)
from nao_soccer.team.roles import MARGIN, STALL, Claim, RoleChoice
from nao_soccer.team.udp import UdpLink
from nao_soccer.world.state import TeamRobot
from robot_core.errors import NaoGaitError
from robot_core.field import Field

MESSAGE = TeamMessage(
    1, 2, 7, 1234, (0.5, -0.25, 1.0), True, False, False, Role.SUPPORTER, 3.5,
    BallMessage((1.0, 0.5), (0.0, -0.3), 0.1, 0.2), (TeamRobot((0.3, -0.4), 0.6),),
)  # fmt: skip

meters = st.floats(-20.0, 20.0)
balls = st.builds(
    BallMessage, st.tuples(meters, meters), st.tuples(meters, meters), st.floats(0.0, 30.0),
    st.floats(0.0, 100.0),
)  # fmt: skip

robots = st.builds(TeamRobot, st.tuples(meters, meters), st.floats(0.0, 100.0), st.booleans())


@given(
    st.builds(
        TeamMessage, st.integers(0, 255), st.integers(1, 20), st.integers(0, 65535),
        st.integers(0, 2**32 - 1), st.tuples(meters, meters, st.floats(-3.1, 3.1)), st.booleans(),
        st.booleans(), st.booleans(), st.sampled_from(Role), st.floats(0.0, 100.0),
        st.none() | balls, st.lists(robots, max_size=ROBOTS_MAX + 2).map(tuple),
    )
)  # fmt: skip
@settings(max_examples=200)
def test_what_was_told_is_heard(message: TeamMessage) -> None:
    data = message.encode()
    assert len(data) in SIZES
    assert SIZES[-1] <= SIZE_MAX
    heard = decode(data)
    assert heard.pose == pytest.approx(message.pose, abs=1e-3)
    assert heard.seconds_to_ball == pytest.approx(min(message.seconds_to_ball, NEVER), abs=0.01)
    assert (heard.ball is None) == (message.ball is None)
    if message.ball is not None and heard.ball is not None:
        assert heard.ball.position == pytest.approx(message.ball.position, abs=1e-3)
    told = message.robots[:ROBOTS_MAX]
    assert len(heard.robots) == len(told)
    for one, other in zip(heard.robots, told, strict=True):
        assert one.position == pytest.approx(other.position, abs=1e-3)
        assert one.age == pytest.approx(min(other.age, ROBOT_AGE_MAX), abs=0.01)
        assert one.mate == other.mate
    exact = ("team", "player", "count", "time", "valid", "fallen", "penalized", "role")
    assert all(getattr(heard, name) == getattr(message, name) for name in exact)


@given(st.binary(max_size=64))
def test_foreign_bytes_are_refused(data: bytes) -> None:
    with pytest.raises(NaoGaitError):
        decode(data)


@given(st.integers(0, len(MESSAGE.encode()) - 1), st.integers(0, 255))
@settings(max_examples=300)
def test_a_damaged_message_is_read_or_refused(place: int, value: int) -> None:
    data = bytearray(MESSAGE.encode())
    data[place] = value
    try:
        assert decode(bytes(data)).player in range(1, 21)
    except NaoGaitError:
        assert place < 7 or data[place] > 2


def link() -> TeamLink:
    return TeamLink(1, 1, Field(length=4.5, width=3.0))


def test_a_replayed_message_is_refused_and_a_silent_mate_forgotten() -> None:
    ear = link()
    ear.receive(MESSAGE.encode(), 0.0)
    for count in (7, 6, 65000):
        with pytest.raises(NaoGaitError, match="count"):
            ear.receive(replace(MESSAGE, count=count).encode(), 0.5)
    ear.receive(replace(MESSAGE, count=9).encode(), 1.0)
    assert [claim.number for claim in ear.claims(1.0 + 0.9 * SILENCE)] == [2]
    assert ear.claims(1.0 + SILENCE) == []
    assert ear.mates(1.0 + SILENCE) == ()
    ear.receive(replace(MESSAGE, count=3).encode(), 5.0)  # it was started again
    assert len(ear.mates(5.0)) == 1


def test_a_mate_that_is_nowhere_near_the_field_is_not_trusted() -> None:
    ear = link()
    with pytest.raises(NaoGaitError, match="near the field"):
        ear.receive(replace(MESSAGE, pose=(9.0, 0.0, 0.0)).encode(), 0.0)
    assert ear.refused == 1


def test_a_ball_far_off_the_field_is_not_believed_but_the_rest_is() -> None:
    ear = link()
    ball = BallMessage((30.0, 0.5), (0.0, 0.0), 0.05, 0.0)
    with pytest.raises(NaoGaitError, match="player 2: ball"):
        ear.receive(replace(MESSAGE, ball=ball).encode(), 0.0)
    (mate,) = ear.mates(0.0)
    assert mate.ball is None
    assert [claim.seconds for claim in ear.claims(0.0)] == [MESSAGE.seconds_to_ball]


def test_robots_that_a_mate_sees_are_heard_but_for_those_far_off_the_field() -> None:
    ear = link()
    near, far = TeamRobot((1.0, 0.5), 0.2), TeamRobot((9.0, 0.5), 0.2)
    ear.receive(replace(MESSAGE, robots=(far, near)).encode(), 0.0)
    assert ear.mates(0.0)[0].robots == (near,)


def test_the_clock_of_a_mate_does_not_count() -> None:
    """A mate far ahead in time is forgotten as soon as any other one."""
    ear = link()
    for count, clock in enumerate((0, 2**32 - 1, 5)):
        ear.receive(replace(MESSAGE, count=count, time=clock).encode(), 0.5 * count)
        assert ear.mates(0.5 * count)[0].stamp == 500_000_000 * count
    assert ear.mates(1.0 + SILENCE) == ()


def test_messages_of_other_teams_and_own_ones_are_left_out() -> None:
    ear = link()
    ear.receive(replace(MESSAGE, team=2).encode(), 0.0)
    ear.receive(replace(MESSAGE, player=1).encode(), 0.0)
    assert ear.mates(0.0) == ()


@pytest.mark.parametrize("budget", [40, 1200])
def test_the_budget_lasts_to_the_end_of_the_game(budget: int) -> None:
    """Two players for ten minutes."""
    radios = [TeamLink(1, number, Field()) for number in (1, 2)]
    left, late = budget, 0
    for tick in range(6000):
        time = 0.1 * tick
        for radio in radios:
            data = radio.send(
                time, lambda count: replace(MESSAGE, count=count), budget=left,
                remaining=600.0 - time, urgent=tick % 7 == 0,
            )  # fmt: skip
            if data is not None:
                left -= 1
                late += time > 500.0
    assert left >= 0
    assert late > 0


def test_a_new_role_is_told_at_once_but_not_without_end() -> None:
    radio = link()
    make = MESSAGE.__class__
    assert radio.send(0.0, lambda count: MESSAGE) is not None
    assert radio.send(0.1, lambda count: MESSAGE, urgent=True) is None
    assert radio.send(0.25, lambda count: MESSAGE, urgent=True) is not None
    assert radio.send(0.3 + PERIOD / 2, lambda count: MESSAGE) is None
    assert make is TeamMessage


# -- roles -----------------------------------------------------------------------------------------


def test_the_nearer_one_goes_to_the_ball_and_stays_the_striker() -> None:
    near, far = RoleChoice(1), RoleChoice(2)
    assert near.update(0.0, 2.0, [Claim(2, Role.SUPPORTER, 4.0)]) is Role.STRIKER
    assert far.update(0.0, 4.0, [Claim(1, Role.STRIKER, 2.0)]) is Role.SUPPORTER
    inside, beyond = 2.0 - 0.9 * MARGIN, 2.0 - 1.1 * MARGIN
    assert far.update(1.0, inside, [Claim(1, Role.STRIKER, 2.0)]) is Role.SUPPORTER
    assert far.update(1.1, beyond, [Claim(1, Role.STRIKER, 2.0)]) is Role.STRIKER
    assert near.update(1.2, 2.0, [Claim(2, Role.STRIKER, beyond)]) is Role.SUPPORTER


def test_before_a_kick_off_a_team_keeps_its_striker() -> None:
    other = [Claim(1, Role.STRIKER, 8.0)]
    choice = RoleChoice(2)
    assert choice.update(0.0, 0.5, other, playing=False) is Role.SUPPORTER
    assert choice.update(0.1, 0.5, other) is Role.STRIKER
    assert RoleChoice(2).update(0.0, 0.5, [], playing=False) is Role.STRIKER


def test_a_player_alone_is_the_striker_and_a_goalkeeper_never() -> None:
    assert RoleChoice(2).update(0.0, NEVER, []) is Role.STRIKER
    assert RoleChoice(1).update(0.0, 0.1, [], goalkeeper=True) is Role.KEEPER


def test_a_striker_that_does_not_move_the_ball_is_not_waited_for() -> None:
    choice = RoleChoice(2)
    liar = [Claim(1, Role.STRIKER, 0.0)]
    roles = [choice.update(float(t), 3.0, liar, ball=(1.0, 0.0)) for t in range(int(STALL) + 4)]
    assert roles[: int(STALL)] == [Role.SUPPORTER] * int(STALL)
    assert Role.STRIKER in roles


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_there_is_one_striker_nearly_always_even_if_messages_are_lost(loss: float) -> None:
    """Times to the ball that wander, told at 2 Hz and at once when a role changes."""
    random = np.random.default_rng(5)
    choices = [RoleChoice(1), RoleChoice(2)]
    seconds = [3.0, 3.5]
    told: list[list[Claim]] = [[], []]
    counts, conflict, longest = [], 0, 0
    for tick in range(12000):  # 20 Hz, ten minutes
        for i, choice in enumerate(choices):
            wander = 0.1 * random.standard_normal() - 0.01 * (seconds[i] - 4.0)
            seconds[i] = min(max(seconds[i] + wander, 0.0), 12.0)
            before = choice.role
            role = choice.update(0.05 * tick, seconds[i], told[i])
            speaks = tick % 10 == 5 * i or role is not before
            if speaks and random.random() >= loss:
                told[1 - i] = [Claim(i + 1, role, seconds[i])]
        strikers = sum(choice.role is Role.STRIKER for choice in choices)
        counts.append(strikers == 1)
        conflict = conflict + 1 if strikers > 1 else 0
        longest = max(longest, conflict)
    assert np.mean(counts) > (0.98 if loss == 0.0 else 0.95)
    assert 0.05 * longest <= (1.0 if loss == 0.0 else 2.0)


# -- sockets ---------------------------------------------------------------------------------------


@pytest.fixture
def controller() -> Iterator[socket.socket]:
    """A socket of the loopback address: nobody else gets its port, also not of the broadcasts."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as controller:
        controller.bind(("127.0.0.1", 0))
        yield controller


def arrived(link: UdpLink) -> list[bytes]:
    """The next packets; a busy machine delivers them late, even to itself."""
    select.select([link._socket], [], [], 60.0)
    return [data for data, _ in link.received()]


def test_a_packet_reaches_all_who_listen_on_this_machine(controller: socket.socket) -> None:
    links = [UdpLink(controller.getsockname()[1]) for _ in range(3)]
    try:
        links[0].send(b"hello")
        assert [arrived(each) for each in links] == [[b"hello"]] * 3
    finally:
        for each in links:
            each.close()


def test_a_return_message_reaches_the_gamecontroller_alone(controller: socket.socket) -> None:
    """A GameController that listens on one address, and a stranger that listens to broadcasts."""
    back = controller.getsockname()[1]
    controller.settimeout(60.0)
    robot, stranger = UdpLink(0, target_port=back), UdpLink(back)
    try:
        robot.send_to(b"answer", "127.0.0.1")
        assert controller.recv(100) == b"answer"
        robot.send(b"to all")
        assert arrived(stranger) == [b"to all"]
    finally:
        robot.close()
        stranger.close()


def test_a_port_that_cannot_be_opened_is_refused() -> None:
    with pytest.raises(NaoGaitError, match="UDP address"):
        UdpLink(10001, "203.0.113.7")
