"""Every requested motion has one outcome."""

import pytest

from nao_lipm_gait.motion.scheduler import GET_UP
from nao_lipm_gait.runtime.motion_requests import MotionRequests
from robot_core.types import GaitState

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
