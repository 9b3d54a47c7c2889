"""How a walk on the server is judged."""

import math

import numpy as np
import pytest

from gait_lab.rcss.trial import ServerWalk, _mean_velocity
from sim_bridge.trials.tasks import find_task


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
    walked = ServerWalk(True, False, (-0.3, 0.2, math.radians(50)))
    assert walked.speed(find_task("back=40")) == pytest.approx(30.0)
    assert walked.speed(find_task("forward=40")) == pytest.approx(-30.0)
    assert walked.speed(find_task("side=20")) == pytest.approx(20.0)
    assert walked.speed(find_task("turn=90")) == pytest.approx(50.0)
