"""A jump of the gyro's bias, seen in how the estimated vertical drifts from sole and force."""

import math

import pytest

from nao_lipm_gait.estimation.gyro_bias_jump import DEADBAND, GyroBiasJump
from nao_lipm_gait.presets import preset_for
from robot_core.types import DOWN, STANDSTILL, UPRIGHT, VelocityCommand
from sim_bridge.trials.trial import (
    CONTROL_PERIOD,
    Push,
    TimedCommands,
    TrialSpec,
    loaded_robot,
    make_gait,
    make_world,
    run,
)

DT = 0.01
STEADY = (0.2, 0.0, 0.0)
TIME = 2.0
"""[s] in which sole and force together pull the estimated vertical to theirs."""
AGAIN = 13.0
"""[s] at which a robot that was pushed over walks again."""


def vertical_errors(
    jump: GyroBiasJump, bias: tuple[float, float], seconds: float
) -> list[tuple[float, float]]:
    """Horizontal part of the estimated vertical of an upright robot that sways while it walks."""
    x = y = 0.0
    errors = []
    for tick in range(round(seconds / DT)):
        roll, pitch = bias if tick * DT > 5.0 else (0.0, 0.0)
        # du/dt = u x w, with what the correction leaves of the bias
        x -= DT * (pitch - jump.rate[1] + x / TIME)
        y += DT * (roll - jump.rate[0] - y / TIME)
        sway = 0.05 * math.sin(2.0 * math.pi * tick * DT / 0.5)
        sole, force = (0.02 - x, sway - y), (0.5 * sway - x, 2.0 * sway - y)
        jump.update(sole, force, STEADY, DT, after_loss=False)
        errors.append((x, y))
    return errors


def test_an_intact_gyro_is_not_touched() -> None:
    jump = GyroBiasJump()
    vertical_errors(jump, (0.0, 0.0), 20.0)
    assert jump.rate == (0.0, 0.0)


@pytest.mark.parametrize("bias", [(0.1, 0.0), (-0.08, 0.0), (0.0, 0.1), (0.06, -0.09)])
def test_a_jump_is_found_and_the_vertical_returns(bias: tuple[float, float]) -> None:
    jump = GyroBiasJump()
    errors = vertical_errors(jump, bias, 10.0)
    without = max(map(abs, bias)) * TIME
    assert max(abs(each) for error in errors[-100:] for each in error) < DEADBAND + 0.01
    assert max(abs(each) for error in errors for each in error) < 0.6 * without
    assert jump.rate == pytest.approx(bias, abs=0.025)


def test_a_sole_that_tilts_without_the_torso_is_no_bias() -> None:
    jump = GyroBiasJump()
    for tick in range(1000):
        jump.update((0.0 if tick < 300 else 0.2, 0.0), (-0.001, 0.0), STEADY, DT, after_loss=False)
    assert jump.rate == (0.0, 0.0)


@pytest.mark.parametrize("every", [None, 4])
def test_what_lost_samples_let_drift_is_no_bias(every: int | None) -> None:
    """The vertical wanders by 3 deg, which is a bias only of a gyro that loses no samples."""
    jump = GyroBiasJump()
    for tick in range(2000):
        drift = 0.055 * math.sin(2.0 * math.pi * tick * DT / 5.0)
        after_loss = every is not None and tick % every == 0
        jump.update((drift, 0.0), (drift, 0.0), STEADY, DT, after_loss=after_loss)
    assert (jump.rate == (0.0, 0.0)) == (every is not None)


def test_what_another_walk_leans_is_no_bias() -> None:
    """A walk that turns about leans otherwise, with sole and specific force alike."""
    jump = GyroBiasJump()
    turn = 0.0
    for tick in range(2000):
        wanted = 1.8 if tick % 800 < 400 else -0.7
        turn += DT / 0.5 * (wanted - turn)
        lean = 0.02 * turn
        jump.update((lean, 0.0), (lean, 0.0), (0.1, 0.0, turn), DT, after_loss=False)
    assert jump.rate == (0.0, 0.0)


@pytest.mark.parametrize(
    ("robot", "impulse", "direction"), [(-1, 4.0, -math.pi / 2.0), (3, 3.0, math.pi / 2.0)]
)
def test_a_robot_that_was_pushed_over_walks_again(
    robot: int, impulse: float, direction: float
) -> None:
    """Sole and force drift away from the vertical in a fall too: this is no bias."""
    pytest.importorskip("mujoco")
    gets_up = preset_for(loaded_robot("nao_h21_v33"), "default").replace(get_up=True)
    spec = TrialSpec(robot_seed=robot, engine="mujoco", parameters=gets_up)

    def command_at(time: float) -> VelocityCommand:
        walks = 1.0 < time < 3.45 or time > AGAIN
        return VelocityCommand(0.15) if walks else STANDSTILL

    policy = TimedCommands(command_at, [Push(3.0, impulse, direction)])
    states = []
    with make_world(spec) as world:
        for tick in run(world, make_gait(spec), policy, past_falls=True):
            if tick.status is not None:
                states.append(tick.status.state)
            if tick.truth.stamp > (AGAIN + 2.5) * 1e9:
                break
    start = round((AGAIN - 0.2) / CONTROL_PERIOD)
    assert states[start] in UPRIGHT
    assert not any(state in DOWN for state in states[start:])
