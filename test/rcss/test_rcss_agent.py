"""A robot on a server: a small one that speaks the protocol, and rcsssmj where it is installed."""

import math
import os
import signal
from typing import Any

import pytest

from gait_lab.rcss.command import Job, run, supervise, walk
from gait_lab.rcss.field import ServerField
from gait_lab.rcss.server import Server, is_installed
from nao_lipm_gait import load_robot
from rcss_bridge import codec
from rcss_bridge.client import RETRY, Client
from rcss_bridge.joints import server_robot
from rcss_server import FakeServer, cycle_message
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL

K1 = server_robot("K1")
STAND = [
    math.degrees(dict(zip(robot.joint_names, robot.stand_pose, strict=True))[joint])
    for robot in (load_robot("booster_k1"),)
    for joint in K1.effectors
]
GIVEN = {
    "host": "127.0.0.1", "port": 60000, "team": "ours", "number": 3, "players": None,
    "robot": "K1", "drive": "0,0,0", "seconds": 1.0, "preset": "default", "field": "fifa7vs7",
    "exact": False,
}  # fmt: skip


def standing(count: int, mode: str = "PlayOn") -> list[bytes]:
    return [cycle_message(K1, 7.0 + 0.02 * i, angles=STAND, mode=mode) for i in range(count)]


def test_it_beams_before_the_kick_off_and_stands_on_its_motors():
    said: list[str] = []
    with FakeServer(standing(80, "BeforeKickOff")) as server:
        assert run(**{**GIVEN, "port": server.port}, say=said.append) == 0
    first, *rest = server.answers[0]
    x, y, _ = ServerField("fifa7vs7").start(3)
    beam = next(each for each in first if each[0] == "beam")
    assert (float(beam[1]), float(beam[2])) == (x, y)
    assert not any(each[0] == "beam" for answer in rest for each in answer)
    last = {each[0]: each[1:] for each in server.answers[0][-1]}
    assert all(float(last[name][2]) > 0.0 for name in K1.effectors.values())
    assert said[-1] == "ours 3: 1 s, 0 falls, 1 drops"


def test_it_comes_back_after_the_server_was_away():
    said: list[str] = []
    with FakeServer(standing(20), standing(60)) as server:
        assert run(**{**GIVEN, "port": server.port}, say=said.append) == 0
    assert len(server.inits) == 2
    assert any("closed the connection" in each for each in said)


class Ended:
    """A process that has ended."""

    def __init__(self, exitcode: int) -> None:
        self.exitcode = exitcode
        self.sentinel, other = os.pipe()
        os.close(other)

    def join(self) -> None:
        os.close(self.sentinel)


@pytest.mark.parametrize(
    ("codes", "starts", "status"),
    [
        ({1: [0], 2: [-signal.SIGKILL, 0]}, 3, 0),
        ({1: [-signal.SIGTERM], 2: [0]}, 2, 1),
        ({1: [1], 2: [-signal.SIGSEGV, -signal.SIGKILL, 0]}, 4, 1),
    ],
)
def test_a_killed_player_begins_anew(codes: dict[int, list[int]], starts: int, status: int):
    said: list[str] = []
    running: list[Any] = []
    left = {number: list(each) for number, each in codes.items()}
    jobs = [Job("", 0, "ours", each, "K1", STANDSTILL, 1.0, "default") for each in codes]
    done = supervise(jobs, lambda job: Ended(left[job.number].pop(0)), running, said.append)
    assert (done, running) == (status, [])
    assert not any(left.values())
    assert len(said) == starts - len(codes)


def test_it_comes_back_although_its_old_place_is_taken_for_a_while():
    said: list[str] = []
    with FakeServer(standing(20), None, None, standing(60)) as server:
        job = Job("127.0.0.1", server.port, "ours", 3, "K1", STANDSTILL, 1.0, "default")
        waits: list[float] = []
        assert walk(job, said.append, waits.append) == 0
    assert len(server.inits) == 4
    assert waits == [RETRY] * 3
    assert sum("refused" in each for each in said) == 0


def test_a_place_that_stays_taken_is_given_up_in_one_line():
    said: list[str] = []
    with FakeServer(standing(20), *[None] * 200) as server:
        job = Job("127.0.0.1", server.port, "ours", 3, "K1", STANDSTILL, 1.0, "default")
        assert walk(job, said.append, lambda _: None) == 1
    assert said[-1].count("refused") == 1


def test_a_refused_player_ends_in_one_line():
    said: list[str] = []
    with FakeServer(None) as server:
        assert run(**{**GIVEN, "port": server.port}, say=said.append) == 1
    assert len(said) == 1
    assert "refused" in said[0]


def test_a_damaged_message_costs_one_cycle():
    said: list[str] = []
    cycles = standing(60)
    cycles[10] = b"(error)"
    with FakeServer(cycles) as server:
        assert run(**{**GIVEN, "port": server.port}, say=said.append) == 0
    assert server.answers[0][10] == [["syn"]]
    assert len(server.answers[0][11]) > 20


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("robot", "NAO"), ("team", "a b"),
        ("drive", "1,2"), ("drive", "nan,0,0"), ("drive", "9,0,0"), ("drive", "a,b,c"),
        ("players", "3"), ("players", "0-2"), ("players", "4-2"), ("players", "1-100"),
        ("number", 0),
    ],
)  # fmt: skip
def test_arguments_that_are_not_allowed_are_refused_in_one_line(name: str, value: object):
    with pytest.raises(NaoGaitError) as refused:
        run(**{**GIVEN, name: value}, say=print)
    assert "\n" not in str(refused.value)


def test_no_two_players_begin_at_one_place():
    field = ServerField("fifa7vs7")
    for kicks_off in (False, True):
        starts = [field.start(number, kicks_off) for number in range(1, 12)]
        assert min(math.dist(a[:2], b[:2]) for a in starts for b in starts if a is not b) > 1.0
        assert all(-27.5 < x < 0.0 and abs(y) < 18.0 for x, y, _ in starts)


@pytest.mark.slow
@pytest.mark.skipif(not is_installed(), reason="rcsssmj is not installed")
def test_the_real_server_drops_it_and_it_stands():
    with Server() as server:
        said: list[str] = []
        given = {**GIVEN, "port": server.port, "seconds": 6.0}
        assert run(**given, say=said.append) == 0
        assert said[-1] == "ours 3: 6 s, 0 falls, 1 drops"
        with Client("127.0.0.1", server.port, "K9", "ours", 4) as client:
            client.connect()
            with pytest.raises(NaoGaitError, match="refused"):
                client.receive()
        with Client("127.0.0.1", server.port, "K1", "ours", 4) as client:
            client.connect()
            assert codec.percepts(client.receive()).game.left == "ours"
