"""Weak motors show in the lag of the hips, and begin with short steps."""

import math

import numpy as np
import pytest

from nao_lipm_gait.estimation.hip_lag import STRIDE_MAX, STRIDE_MIN, SWINGS, HipLag
from nao_lipm_gait.walks.lipm.extensions.motor_limit import START, WEAK, MotorLimit
from nao_lipm_gait.walks.lipm.parameters import LipmParameters
from robot_core.robot import RobotDescription
from robot_core.types import LEFT, RIGHT, VelocityCommand
from sim_bridge.trials.trial import Trial, TrialSpec

DT = 0.01
PERIOD = 20
STRIDE = 0.5 * (STRIDE_MIN + STRIDE_MAX)


def walked(
    lag: HipLag,
    robot: RobotDescription,
    swings: float,
    hip: float,
    knee: float,
    stride: float = STRIDE,
    latency: float = 0.0,
) -> None:
    """Swings on sines in which hips and knees lag by times [s], and all joints by a latency."""
    names = robot.joint_names

    def angles(t: float) -> np.ndarray:
        return np.full(len(names), 0.3 * math.sin(math.tau * t / (PERIOD * DT)))

    lag.interrupt()
    for tick in range(round(PERIOD * swings) + 1):
        t = tick * DT
        measured = angles(t - latency)
        for name in (robot.left_leg.hip_pitch, robot.right_leg.hip_pitch):
            measured[names.index(name)] = angles(t - latency - hip)[0]
        for name in (robot.left_leg.knee_pitch, robot.right_leg.knee_pitch):
            measured[names.index(name)] = angles(t - latency - knee)[0]
        support = LEFT if tick // PERIOD % 2 else RIGHT
        lag.update(support, stride, measured, (angles(t - DT), angles(t), angles(t + DT)), DT)


@pytest.mark.parametrize("latency", [0.0, 0.004])
def test_the_lag_is_that_of_the_hips_beyond_the_knees(
    robot: RobotDescription, latency: float
) -> None:
    lag = HipLag(robot)
    walked(lag, robot, SWINGS, hip=0.01, knee=0.004, latency=latency)
    assert lag.mean == pytest.approx(0.006, rel=0.15)


def test_it_takes_some_swings_of_medium_strides(robot: RobotDescription) -> None:
    lag = HipLag(robot)
    walked(lag, robot, SWINGS - 1, hip=0.01, knee=0.004)
    walked(lag, robot, 10, hip=0.01, knee=0.004, stride=STRIDE_MIN - 0.01)
    walked(lag, robot, 10, hip=0.01, knee=0.004, stride=STRIDE_MAX + 0.01)
    assert lag.mean is None
    walked(lag, robot, 1, hip=0.01, knee=0.004)
    assert lag.mean is not None


def test_a_swing_that_is_interrupted_does_not_count(robot: RobotDescription) -> None:
    lag = HipLag(robot)
    for _ in range(2 * SWINGS):
        walked(lag, robot, 0.9, hip=0.01, knee=0.004)
    assert lag.mean is None


def test_strides_grow_to_what_weak_motors_bear_and_further_if_they_are_strong() -> None:
    limit = MotorLimit(0.003)
    assert limit.step_max == START
    for _ in range(1000):
        limit.update(None, DT)
    assert limit.step_max == WEAK
    for _ in range(100):
        limit.update(0.002, DT)
    assert limit.step_max > WEAK + 0.04
    limit.update(0.004, DT)
    assert limit.step_max == WEAK
    limit.begin(0.004)
    assert limit.step_max == START


def test_it_is_off_by_default() -> None:
    limit = MotorLimit(0.0)
    limit.update(1.0, DT)
    assert limit.step_max == math.inf


@pytest.mark.parametrize("weak", [False, True])
def test_robots_with_weak_motors_walk_slower(weak: bool) -> None:
    """Robot 16 falls within two seconds of full speed if its motors are weak."""
    options = (("motor.torque_fraction", 1.0),) if weak else ()
    spec = TrialSpec(
        robot_seed=16,
        parameters=LipmParameters(hip_lag_max=0.003),
        engine="mujoco",
        urdf_effort=weak,
        plant_options=options,
    )
    with Trial(spec) as trial:
        trial.action = VelocityCommand(0.47)
        trial.advance(7.0)
        before = trial.tick.truth.base_footprint[0]
        trial.advance(2.0)
        speed = 0.5 * (trial.tick.truth.base_footprint[0] - before)
        assert trial.stood
    assert (0.2 < speed < 0.36) if weak else speed > 0.42
