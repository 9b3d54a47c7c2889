"""A robot that does not stand as its joints say is reported before its first walk."""

import numpy as np
import pytest

from gait_lab.faults.harness import Fault, Harness
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.presets import preset_for
from robot_core.robot import load_robot
from robot_core.types import GaitState, VelocityCommand
from sim_bridge.trials.calibration import Calibrating
from sim_bridge.trials.calibration_procedure import CalibrationError
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.trials.trial import TrialSpec, make_world, run
from sim_bridge.world import World

pytest.importorskip("mujoco")
URDF = "nao_v6"
ROBOT = load_robot(URDF)
PARAMETERS = preset_for(ROBOT, "default")


def turn_zero(world: World, joint: str, zero: float) -> None:
    """Let a joint's zero be off by more [rad]."""
    zeros = world.robot.individual.joint_zero
    zeros.flags.writeable = True
    zeros[ROBOT.index(joint)] += zero


def warning_of(
    seed: int, joint: str = "", zero: float = 0.0, urdf: str = URDF
) -> tuple[str, GaitState]:
    """What is said of a robot that stands for 1.8 s and then is told to walk; its state then."""
    parameters = preset_for(load_robot(urdf), "default")
    spec = RolloutSpec(
        task=TASKS["stand"], robot_seed=seed, noise_seed=seed, parameters=parameters, urdf=urdf,
        engine="mujoco",
    )  # fmt: skip
    world, _ = make_pair(spec)
    with world:
        if joint:
            turn_zero(world, joint, zero)
        fault = Fault(np.random.default_rng(0))
        harness = Harness(world, parameters, fault, VelocityCommand(0.1), walk_start=2.0)
        harness.run(190)
        controller = harness.gaits[0].controller
        said = [each.message for each in controller.reports() if each.name == "sensors"]
        harness.run(60)
    return said[0], controller.state


@pytest.mark.parametrize("seed", range(40, 44))
def test_healthy_robots_raise_no_alarm(seed: int) -> None:
    said, state = warning_of(seed)
    assert "askew" not in said
    assert state is GaitState.WALK


@pytest.mark.parametrize("seed", [106, 114])
def test_a_robot_that_rocks_on_its_soles_is_not_judged(seed: int) -> None:
    assert "askew" not in warning_of(seed, urdf="booster_t1")[0]


@pytest.mark.parametrize("joint", ["LKneePitch", "RKneePitch"])
def test_a_knee_that_is_bent_less_than_it_says_is_reported(joint: str) -> None:
    said, state = warning_of(40, joint, -0.12)
    assert "deg askew by its IMU" in said
    assert state is GaitState.WALK, "a floor that slopes looks the same"


@pytest.mark.parametrize("joint", ["LKneePitch", "RKneePitch"])
def test_a_calibration_says_what_kind_of_joint_has_a_wrong_zero(joint: str) -> None:
    """Of a robot whose knees both show by the pitch; others roll first, one goes unnoticed."""
    spec = TrialSpec(robot_seed=42, noise_seed=42, urdf=URDF, engine="mujoco")
    gait = Gait(ROBOT, PARAMETERS, spec.control_period)
    with make_world(spec) as world:
        turn_zero(world, joint, -0.12)
        with pytest.raises(CalibrationError, match=r"pitched.*hip pitch, knee or ankle pitch"):
            list(run(world, gait, Calibrating(gait)))
