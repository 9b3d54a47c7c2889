"""Velocity commands: what is refused, and for how long one counts."""

import math

import pytest

from nao_lipm_gait.runtime.commands import VelocityInput, read_velocity
from nao_lipm_gait.runtime.inputs import TwistInput
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, VelocityCommand

MS = 1_000_000


def test_command_counts_for_its_timeout_and_no_longer():
    velocity = VelocityInput(0.5)
    walk = VelocityCommand(x=0.1)
    velocity.receive(walk, 1000 * MS)
    assert velocity.at(1500 * MS) == walk
    assert velocity.at(1501 * MS) == STANDSTILL
    assert velocity.at(1400 * MS) == STANDSTILL, "an old command must not come back"


def test_command_before_the_first_frame_counts_from_that_frame():
    velocity = VelocityInput(0.5)
    walk = VelocityCommand(x=0.1)
    velocity.receive(walk, None)
    assert velocity.at(7000 * MS) == walk
    assert velocity.at(7500 * MS) == walk
    assert velocity.at(7501 * MS) == STANDSTILL


def test_planar_part_of_a_twist_is_taken():
    twist = TwistInput((0.1, 0.2, 9.0), (1.0, 2.0, 0.3))
    assert read_velocity(twist) == VelocityCommand(0.1, 0.2, 0.3)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e6, -1e6])
@pytest.mark.parametrize("place", range(6))
def test_bad_twist_is_refused_by_field(bad: float, place: int):
    values = [0.0] * 6
    values[place] = bad
    x, y, z, roll, pitch, yaw = values
    field = ("linear", "angular")[place // 3] + "." + "xyz"[place % 3]
    with pytest.raises(NaoGaitError, match=rf"cmd_vel {field}: got .*; allowed: a finite number"):
        read_velocity(TwistInput((x, y, z), (roll, pitch, yaw)))
