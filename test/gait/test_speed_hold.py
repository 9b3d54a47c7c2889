"""Speed hold: laws of the learned offset, and a robot that reaches its commanded speed."""

import pytest

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.velocity_control import (
    ERROR_MAX,
    OFFSET_MAX,
    RESERVE_MIN,
    TURN_OFFSET_MAX,
    SpeedHold,
)
from robot_core.types import VelocityCommand
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task

DT = 0.01
TIME = 2.0
COMMAND = VelocityCommand(0.2, -0.05, 0.3)


def follow(
    hold: SpeedHold,
    seconds: float,
    lack: tuple[float, float],
    reserve: float = 1.0,
    command: VelocityCommand = COMMAND,
) -> VelocityCommand:
    """The last command for a robot that walks by `lack` [m/s] slower than commanded."""
    given = command
    for _ in range(round(seconds / DT)):
        walked = given.x - lack[0], given.y - lack[1], 0.0
        given = hold.correct(command, walked, reserve, TIME, DT)
    return given


def learned(hold: SpeedHold) -> tuple[float, float]:
    """The correction [m/s] in x and y for a robot that walks exactly as commanded."""
    given = hold.correct(COMMAND, tuple(COMMAND), 1.0, TIME, DT)
    return given.x - COMMAND.x, given.y - COMMAND.y


@pytest.mark.parametrize("lack", [(0.02, 0.01), (-0.03, 0.0), (0.0, -0.02)])
def test_a_constant_error_is_learned(lack: tuple[float, float]) -> None:
    given = follow(SpeedHold(), 20.0, lack)
    assert given.x - lack[0] == pytest.approx(COMMAND.x, abs=1e-4)
    assert given.y - lack[1] == pytest.approx(COMMAND.y, abs=1e-4)
    assert given.yaw == COMMAND.yaw


def test_the_learned_offset_outlasts_a_stand() -> None:
    hold = SpeedHold()
    follow(hold, 20.0, (0.02, 0.0))
    still = VelocityCommand(0.0, 0.0, 0.0)
    assert hold.correct(still, (0.0, 0.0, 0.0), 1.0, TIME, DT) == still
    assert hold.correct(COMMAND, (0.0, 0.0, 0.0), 1.0, TIME, DT).x == pytest.approx(0.22, abs=1e-4)


def test_nothing_is_learned_until_the_walk_has_reached_the_command() -> None:
    hold = SpeedHold()
    for tick in range(300):
        ramp = VelocityCommand(0.3 * tick / 300, 0.0, 0.0)
        hold.correct(ramp, (0.0, 0.0, 0.0), 1.0, TIME, DT)
    assert abs(learned(hold)[0]) < 0.01


def test_neither_a_push_nor_a_blocked_robot_winds_up_the_offset() -> None:
    hold = SpeedHold()
    follow(hold, 20.0, (0.0, 0.0))
    hold.correct(COMMAND, (-3.0, 3.0, 0.0), 1.0, TIME, DT)
    assert max(map(abs, learned(hold))) <= ERROR_MAX * DT / TIME + 1e-12
    follow(hold, 60.0, (5.0, 5.0))
    assert learned(hold) == pytest.approx((OFFSET_MAX, OFFSET_MAX))


def test_the_longest_steps_are_not_made_longer_but_may_be_made_shorter() -> None:
    hold = SpeedHold()
    assert follow(hold, 20.0, (0.03, 0.0), reserve=0.0).x == COMMAND.x
    assert abs(learned(hold)[0]) < 1e-3, "a correction without room does not grow"
    assert follow(SpeedHold(), 20.0, (-0.03, 0.0), reserve=0.0).x == pytest.approx(0.17, abs=1e-4)
    follow(hold, 20.0, (0.02, 0.0))
    half = hold.correct(COMMAND, (0.2, -0.05, 0.0), 0.5 * RESERVE_MIN, TIME, DT)
    assert half.x == pytest.approx(0.21, abs=1e-3)


def turned(hold: SpeedHold, seconds: float, rate: float, lack: float) -> VelocityCommand:
    """The last command for a robot that turns on the spot by `lack` [rad/s] slower."""
    turn = given = VelocityCommand(0.0, 0.0, rate)
    for _ in range(round(seconds / DT)):
        given = hold.correct(turn, (0.01, 0.01, given.yaw - lack), 1.0, TIME, DT)
    return given


@pytest.mark.parametrize("rate", [0.8, -0.8])
def test_a_turn_that_falls_short_is_corrected_to_either_side(rate: float) -> None:
    short = 0.03 * rate
    hold = SpeedHold()
    assert turned(hold, 20.0, rate, short).yaw == pytest.approx(rate + short, abs=1e-4)
    mirrored = turned(hold, DT, -rate, -short)
    assert mirrored.yaw == pytest.approx(-rate - short, abs=2e-4), "to the other side"
    assert abs(turned(hold, 60.0, rate, 9.0 * rate).yaw - rate) == pytest.approx(TURN_OFFSET_MAX)


def test_a_turn_does_not_move_the_robot_and_a_curve_is_not_turned_more() -> None:
    hold = SpeedHold()
    follow(hold, 20.0, (0.02, 0.01))
    on_the_spot = turned(hold, 20.0, 0.5, 0.05)
    assert (on_the_spot.x, on_the_spot.y) == (0.0, 0.0)
    assert follow(hold, 5.0, (0.02, 0.01)).yaw == COMMAND.yaw
    side = follow(hold, 20.0, (0.02, 0.01), command=VelocityCommand(0.0, 0.1, 0.0))
    assert side.x == pytest.approx(0.02, abs=1e-4), "the robot must not drift forward"


def test_time_zero_switches_it_off() -> None:
    hold = SpeedHold()
    for _ in range(500):
        assert hold.correct(COMMAND, (0.0, 0.0, 0.0), 1.0, 0.0, DT) == COMMAND


def test_a_robot_that_is_too_slow_reaches_its_commanded_speed() -> None:
    pytest.importorskip("mujoco")
    task = find_task("forward=20").lasting(10.0)

    def walked(time: float) -> float:
        parameters = GaitParameters(speed_time=time)
        metrics = rollout(
            RolloutSpec(task, robot_seed=13, parameters=parameters, engine="mujoco")
        ).metrics
        assert not metrics.fell
        return metrics.speed_x

    held, free = walked(TIME), walked(0.0)
    assert free < 0.188, "without the hold it is too slow"
    assert abs(held - 0.2) < 0.5 * (0.2 - free)
