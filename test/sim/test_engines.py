"""Two engines, one robot: what both do alike, and what an engine refuses."""

import math
import sys

import numpy as np
import pytest

from engine_bench import changed, walked
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray, JointTargets
from sim_bridge.engines import registry as engines
from sim_bridge.plant import Plant, load_plant
from sim_bridge.robot import RobotSpec
from sim_bridge.world import World


def test_a_frame_comes_late_by_the_delay(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=0, engine=engine) as world:
        stamps = []
        for _ in range(8):
            world.step()
            frame = world.robot.sense()
            stamps.append(None if frame is None else world.time - frame.stamp)
    assert stamps[:3] == [None, None, None]
    assert stamps[3:] == [40_000_000] * 5


@pytest.mark.skipif(sys.platform != "linux", reason="a display is named on Linux only")
def test_a_window_without_a_display_is_refused_and_says_what_to_do(
    engine: str, robot: RobotDescription, reference: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(NaoGaitError, match=r"DISPLAY is not set.*nao_gait view"):
        World.single(robot, reference, engine=engine, gui=True)


def walk_blindly(world: World) -> FloatArray:
    """(ticks, n + 7) of a robot that swings its legs and is pushed until it falls."""
    rows = []
    robot = world.robot.description
    for tick in range(80):
        target = np.array(robot.stand_pose)
        for joint, sign in (("LHipRoll", 1.0), ("RHipRoll", 1.0), ("LKneePitch", 2.0)):
            target[robot.index(joint)] += sign * 0.15 * math.sin(0.12 * tick)
        if tick == 30:
            world.robot.push(np.array([15.0, 10.0, 0.0]), 0.1)
        world.robot.command(JointTargets(world.time, target, 1.0))
        world.step()
        truth = world.robot.truth()
        rows.append(
            np.concatenate([truth.torso_position, truth.torso_quaternion, truth.joint_position])
        )
    return np.array(rows)


def test_the_same_robot_does_the_same_to_the_last_bit(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=2, engine=engine) as world:
        first = walk_blindly(world)
        world.reset()
        again = walk_blindly(world)
    with World.single(robot, reference, robot_seed=2, engine=engine) as world:
        fresh = walk_blindly(world)
    with World.single(robot, reference, robot_seed=4, engine=engine) as world:
        other = walk_blindly(world)
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
    refusal = rf"motor\.{option}: got {value}; .*pybullet.*engine:=mujoco"
    with pytest.raises(NaoGaitError, match=refusal):
        World.single(robot, plant, engine="pybullet")


def test_pybullet_refuses_the_worn_plant(robot: RobotDescription) -> None:
    with pytest.raises(NaoGaitError, match=r"worn: motor\.\w+: got .* with engine pybullet"):
        World.single(robot, load_plant("worn"), engine="pybullet")


@pytest.mark.usefixtures("mujoco_only")
def test_mujoco_gives_ideal_motors_the_shortest_lag_that_it_can(
    robot: RobotDescription, ideal: Plant
) -> None:
    shortest = 2.0 * ideal.physics.step
    with pytest.raises(NaoGaitError, match=r"ideal: motor\.lag: got .*0 or .*engine:=pybullet"):
        World.single(robot, changed(ideal, motor={"lag": 0.5 * shortest}), engine="mujoco")
    with World.single(robot, ideal, engine="mujoco") as world:
        moved = walk_blindly(world)
    with World.single(robot, changed(ideal, motor={"lag": shortest}), engine="mujoco") as world:
        np.testing.assert_array_equal(walk_blindly(world), moved)


def test_robots_of_a_world_have_different_names(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    for names, got in ((("", "b"), "'', 'b'"), (("a", "a"), "'a', 'a'")):
        with pytest.raises(NaoGaitError, match=f"robots: got .{got}.; allowed: each name once"):
            World(reference, [RobotSpec(robot, name=name) for name in names], engine=engine)
    with pytest.raises(NaoGaitError, match="got 'no robot'; allowed: at least one"):
        World(reference, [], engine=engine)


def test_an_unknown_engine_is_refused(robot: RobotDescription, reference: Plant) -> None:
    with pytest.raises(NaoGaitError, match=r"engine: got .mojoco.; did you mean mujoco"):
        World.single(robot, reference, engine="mojoco")


def test_an_engine_that_is_missing_says_what_to_install(
    robot: RobotDescription, reference: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "installed", lambda engine: engine == "pybullet")
    allowed = r"pybullet, which is installed; or pip install 'mujoco>=4,<5'"
    with pytest.raises(NaoGaitError, match=allowed):
        World.single(robot, reference, engine="mujoco")


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize("task", ["forward", "back"])
def test_the_walk_does_not_live_off_one_engine(task: str) -> None:
    pybullet, mujoco = (walked(task, engine) for engine in ("pybullet", "mujoco"))
    assert pybullet > 0.15
    assert mujoco == pytest.approx(pybullet, rel=0.1)
