"""Velocity commands: what is refused, and how long one counts; every motion has one outcome."""

import math

import pytest

from nao_lipm_gait.motion.scheduler import GET_UP
from nao_lipm_gait.runtime.commands import BiasWait, HeldVelocity, MotionRequests
from nao_lipm_gait.runtime.diagnostics import Diagnostics
from nao_lipm_gait.runtime.inputs import TwistInput, read_velocity
from robot_core.errors import NaoGaitError
from robot_core.types import STANDSTILL, GaitState, VelocityCommand

MS = 1_000_000


def test_command_counts_for_its_timeout_and_no_longer():
    velocity = HeldVelocity(0.5, Diagnostics(lambda: 0.0))
    walk = VelocityCommand(x=0.1)
    velocity.receive(walk, 1000 * MS)
    assert velocity.at(1500 * MS) == walk
    assert velocity.at(1501 * MS) == STANDSTILL
    assert velocity.at(1400 * MS) == STANDSTILL, "an old command must not come back"


def test_command_before_the_first_frame_counts_from_that_frame():
    velocity = HeldVelocity(0.5, Diagnostics(lambda: 0.0))
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


def test_the_wait_for_the_bias_is_bounded_when_the_clock_is_set_back() -> None:
    wait = BiasWait(2.0)
    assert wait.update(1_000_000 * MS, GaitState.STAND, None)
    assert wait.update(500 * MS, GaitState.STAND, None)
    assert wait.update(2_500 * MS, GaitState.STAND, None)
    assert not wait.update(2_501 * MS, GaitState.STAND, None)


# -- motions ---------------------------------------------------------------------------------------

STAND, WALK, MOTION = GaitState.STAND, GaitState.WALK, GaitState.MOTION
GETTING_UP, FALLEN, RELAXED = GaitState.GETTING_UP, GaitState.FALLEN, GaitState.RELAXED

Tick = tuple[GaitState, str, bool, bool]
"""State, running motion, a motion waits, the running motion has ended."""
WAITS: Tick = (WALK, "", True, True)
RUNS: Tick = (MOTION, "kick", False, False)


@pytest.mark.parametrize(
    ("ticks", "outcome"),
    [
        ([WAITS, RUNS, (MOTION, "kick", False, True)], "kick: done"),
        ([WAITS, RUNS, (STAND, "", False, True)], "kick: done"),
        ([WAITS, RUNS, (FALLEN, "", False, True)], "kick: aborted, the robot is fallen"),
        ([WAITS, (FALLEN, "", False, True)], "kick: aborted, the robot is fallen"),
        ([WAITS, (RELAXED, "", False, True)], "kick: aborted, the robot is relaxed"),
    ],
)
def test_a_motion_is_done_or_aborted(ticks: list[Tick], outcome: str) -> None:
    requests = MotionRequests()
    assert requests.request("kick") is None
    results = [requests.update(*tick) for tick in ticks]
    assert results == [None] * (len(ticks) - 1) + [outcome]
    assert requests.update(*ticks[-1]) is None, "once"


@pytest.mark.parametrize(
    ("ticks", "outcome"),
    [
        ([(STAND, "", False, True)], f"{GET_UP}: done"),
        ([(FALLEN, "", True, True), (GETTING_UP, "get_up_back", True, False),
          (STAND, "", False, True)], f"{GET_UP}: done"),
        ([(FALLEN, "", False, True)], f"{GET_UP}: aborted, the robot is fallen"),
    ],
)  # fmt: skip
def test_a_get_up_is_done_when_the_robot_stands(ticks: list[Tick], outcome: str) -> None:
    requests = MotionRequests()
    requests.request(GET_UP)
    requests.update(FALLEN, "", True, True)
    requests.update(GETTING_UP, "roll_over_left", True, False)
    results = [requests.update(*tick) for tick in ticks]
    assert results == [None] * (len(ticks) - 1) + [outcome]


def test_a_motion_that_begins_again_is_followed_anew() -> None:
    requests = MotionRequests()
    requests.request("kick")
    requests.update(*RUNS)
    assert requests.request("kick") == "kick: replaced by kick"
    assert requests.update(MOTION, "kick", True, True) is None, "the first one ends"
    assert requests.update(*RUNS) is None
    assert requests.update(MOTION, "kick", False, True) == "kick: done"
