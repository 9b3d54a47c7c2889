"""How a walk on the server is judged."""

import math

import numpy as np
import pytest

from gait_lab.bench.suites.rcss import _kick_rows, _scaled
from gait_lab.rcss.trial import NO_ANSWER, LateClient, ServerKick, ServerWalk, _mean_velocity
from rcss_server import FakeServer
from sim_bridge.trials.tasks import RandomCommands, find_task


@pytest.mark.parametrize("turn", [0.0, 0.7, -1.9])
def test_the_velocity_of_a_circle_is_that_of_its_own_heading(turn: float):
    """A robot that walks in circles is as fast as one that walks straight."""
    ahead, aside = 0.4, -0.1
    yaws = 1.0 + turn * 0.02 * np.arange(500)
    steps = 0.5 * (yaws[1:] + yaws[:-1])
    dx = 0.02 * (ahead * np.cos(steps) - aside * np.sin(steps))
    dy = 0.02 * (ahead * np.sin(steps) + aside * np.cos(steps))
    places = np.column_stack((np.append(0.0, np.cumsum(dx)), np.append(0.0, np.cumsum(dy))))
    assert _mean_velocity(places, yaws) == pytest.approx((ahead, aside, turn))


def test_speeds_are_positive_along_the_command_in_the_units_of_the_tables():
    walked = ServerWalk(False, (-0.3, 0.2, math.radians(50)))
    assert walked.speed(find_task("back=40")) == pytest.approx(30.0)
    assert walked.speed(find_task("forward=40")) == pytest.approx(-30.0)
    assert walked.speed(find_task("side=20")) == pytest.approx(20.0)
    assert walked.speed(find_task("turn=90")) == pytest.approx(50.0)


def test_random_commands_are_scaled_to_the_speeds_of_the_tasks():
    faster = _scaled(RandomCommands([3]), ["forward=94", "back=20", "turn=126"])
    usual = RandomCommands([3])
    ways = set()
    for time in np.arange(0.0, 60.0, 0.5).tolist():
        command, before = faster(time), usual.at(time)
        share = 2.0 if before.x > 0.0 else 0.5
        assert command == pytest.approx((share * before.x, before.y, before.yaw))
        ways.add(math.copysign(1.0, before.x))
    assert ways == {-1.0, 1.0}


def test_kicks_are_judged_by_those_that_left_the_robot_on_its_feet():
    far, near = ServerKick(False, 8.0, 0.1), ServerKick(False, 6.0, -0.1)
    fell = ServerKick(True, math.nan, math.nan)
    rows = {each.quantity: each.value for each in _kick_rows("kick", [far, fell, near])}
    assert (rows["tried"], rows["stood"]) == (3, 2)
    assert (rows["distance"], rows["distance_spread"]) == (7.0, 1.0)
    assert rows["direction"] == pytest.approx(0.0)
    assert rows["direction_spread"] == pytest.approx(math.degrees(0.1))
    rows = {each.quantity: each.value for each in _kick_rows("kick", [fell])}
    assert (rows["tried"], rows["stood"]) == (1, 0)
    assert math.isnan(rows["distance"])
    assert math.isnan(rows["direction_spread"])


def test_a_share_of_the_answers_is_late():
    messages = [b"(time (now 1.0))"] * 400
    with (
        FakeServer(messages) as server,
        LateClient("127.0.0.1", server.port, "K1", "ours", 2, late=0.2) as client,
    ):
        client.connect()
        for _ in messages:
            client.receive()
            client.send(b"(he1 0 0 0 0 0)" + NO_ANSWER)
    late = sum(each == [["syn"]] for each in server.answers[0])
    assert 50 < late < 110
