"""For how long a velocity command counts."""

from nao_lipm_gait.runtime.velocity_input import VelocityInput
from nao_lipm_gait.types import STANDSTILL, VelocityCommand

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
