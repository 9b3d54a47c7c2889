"""Two engines, one robot: what both do alike, and what an engine refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from engine_bench import (
    changed,
    walked,
)
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import RobotDescription
from nao_lipm_gait.types import FloatArray, JointTargets
from sim_bridge.engines import registry as engines
from sim_bridge.plant import Plant, load_plant
from sim_bridge.world import World


def test_a_frame_comes_late_by_the_delay(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=0, engine=engine) as simulation:
        stamps = []
        for _ in range(8):
            simulation.step()
            frame = simulation.robot.sense()
            stamps.append(None if frame is None else simulation.time - frame.stamp)
    assert stamps[:3] == [None, None, None]
    assert stamps[3:] == [40_000_000] * 5


def walk_blindly(simulation: World) -> FloatArray:
    """(ticks, n + 7) of a robot that swings its legs and is pushed until it falls."""
    rows = []
    robot = simulation.robot.description
    for tick in range(80):
        target = np.array(robot.stand_pose)
        for joint, sign in (("LHipRoll", 1.0), ("RHipRoll", 1.0), ("LKneePitch", 2.0)):
            target[robot.index(joint)] += sign * 0.15 * math.sin(0.12 * tick)
        if tick == 30:
            simulation.robot.push(np.array([15.0, 10.0, 0.0]), 0.1)
        simulation.robot.command(JointTargets(simulation.time, target, 1.0))
        simulation.step()
        truth = simulation.robot.truth()
        rows.append(
            np.concatenate([truth.torso_position, truth.torso_quaternion, truth.joint_position])
        )
    return np.array(rows)


def test_the_same_robot_does_the_same_to_the_last_bit(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=2, engine=engine) as simulation:
        first = walk_blindly(simulation)
        simulation.reset()
        again = walk_blindly(simulation)
    with World.single(robot, reference, robot_seed=2, engine=engine) as simulation:
        fresh = walk_blindly(simulation)
    with World.single(robot, reference, robot_seed=4, engine=engine) as simulation:
        other = walk_blindly(simulation)
    assert np.array_equal(first, again)
    assert np.array_equal(first, fresh)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("stiffness", 150.0),
        ("armature", 1.0),
        ("friction", 0.3),
        ("play", 0.02),
        ("encoder_feedback", True),
    ],
)
def test_pybullet_refuses_what_it_cannot_honour(
    robot: RobotDescription, reference: Plant, option: str, value: float | bool
) -> None:
    plant = changed(reference, motor={option: value})
    with pytest.raises(NaoGaitError, match=rf"motor\.{option}: got {value}; .*pybullet"):
        World.single(robot, plant, engine="pybullet")


def test_pybullet_refuses_the_worn_plant(robot: RobotDescription) -> None:
    with pytest.raises(NaoGaitError, match=r"worn: motor\.\w+: got .* with engine pybullet"):
        World.single(robot, load_plant("worn"), engine="pybullet")


def test_an_unknown_engine_is_refused(robot: RobotDescription, reference: Plant) -> None:
    with pytest.raises(NaoGaitError, match="engine: got 'mojoco'; allowed: pybullet, mujoco"):
        World.single(robot, reference, engine="mojoco")


def test_an_engine_that_is_missing_says_what_to_install(
    robot: RobotDescription, reference: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "installed", lambda engine: engine == "pybullet")
    with pytest.raises(NaoGaitError, match=r"pybullet; or pip install 'mujoco>=4,<5'"):
        World.single(robot, reference, engine="mujoco")


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize("task", ["forward", "back"])
def test_the_walk_does_not_live_off_one_engine(task: str) -> None:
    speed = walked(task, "pybullet")
    assert speed > 0.15
    assert walked(task, "mujoco") == pytest.approx(speed, rel=0.1)
