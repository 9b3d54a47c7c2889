"""Commands and pushes of a simulated robot, and those that are refused."""

import math

import attrs
import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant, load_plant
from sim_bridge.world import World
from simulation_runs import targets, with_physics


def test_a_push_gives_its_momentum(robot: RobotDescription, ideal: Plant) -> None:
    """Upwards in weightlessness, where the floor gives nothing back."""
    for duration, steps in ((0.1, 50), (0.0301, 15), (0.0001, 1)):
        with World.single(robot, with_physics(ideal, gravity=0.0), NOMINAL) as world:
            force = np.array([3.0, -4.0, 12.0])
            world.robot.push(force, duration)
            for _ in range(30):
                world.step()
            before = world.robot.truth()
            for _ in range(20):
                world.step()
            after = world.robot.truth()
            mass = world.robot.body.mass
        velocity = (after.com - before.com) / (20 * 0.01)
        assert after.sole_force.sum() == 0.0
        assert mass * velocity == pytest.approx(force * steps * 0.002, abs=2e-3)


def test_a_new_push_replaces_the_old_one(robot: RobotDescription, ideal: Plant) -> None:
    with World.single(robot, with_physics(ideal, gravity=0.0), NOMINAL) as world:
        world.robot.push(np.array([0.0, 0.0, 100.0]), 1.0)
        world.robot.push(np.array([0.0, 0.0, 10.0]), 0.01)
        for _ in range(10):
            world.step()
        before = world.robot.truth().com
        world.step()
        speed = (world.robot.truth().com - before)[2] / 0.01
        assert speed * world.robot.body.mass == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize(
    ("force", "duration", "field"),
    [
        ([1.0, 0.0], 0.1, "push force"),
        ([math.nan, 0.0, 0.0], 0.1, "push force"),
        ([math.inf, 0.0, 0.0], 0.1, "push force"),
        ([1.0, 0.0, 0.0], 0.0, "push duration"),
        ([1.0, 0.0, 0.0], -1.0, "push duration"),
        ([1.0, 0.0, 0.0], math.inf, "push duration"),
        ([1.0, 0.0, 0.0], math.nan, "push duration"),
    ],
)
def test_bad_pushes_are_refused(
    robot: RobotDescription, ideal: Plant, force: list[float], duration: float, field: str
) -> None:
    with World.single(robot, ideal) as world, pytest.raises(NaoGaitError, match=field):
        world.robot.push(np.array(force), duration)


def test_without_stiffness_it_sinks(robot: RobotDescription, reference: Plant) -> None:
    heights = {}
    for stiffness in (1.0, 0.0):
        with World.single(robot, reference, NOMINAL) as world:
            for _ in range(100):
                world.robot.command(targets(world, stiffness))
                world.step()
            truth = world.robot.truth()
            heights[stiffness] = float(truth.torso_position[2])
            if stiffness == 0.0:
                assert not truth.joint_torque.any()
                assert truth.torque_saturated == 0
    assert heights[1.0] > 0.31
    assert heights[0.0] < heights[1.0] - 0.1


def test_none_holds_the_last_targets(robot: RobotDescription, ideal: Plant) -> None:
    with World.single(robot, ideal, NOMINAL) as world:
        world.robot.command(targets(world, HeadYaw=0.5))
        world.step()
        for _ in range(20):
            world.step()
        yaw = world.robot.truth().joint_position[robot.index("HeadYaw")]
        assert yaw == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("joint", ["HeadYaw", "LElbowRoll", "RShoulderRoll"])
def test_targets_are_cut_at_limits_and_speeds(
    robot: RobotDescription, reference: Plant, joint: str
) -> None:
    index = robot.index(joint)
    for target, end in ((10.0, robot.upper[index]), (-10.0, robot.lower[index])):
        with World.single(robot, reference, NOMINAL) as world:
            limit = robot.velocity_limit[index]
            start = before = world.robot.truth().joint_position[index]
            fastest, ticks = 0.0, 0
            while abs(before - end) > 0.01 and ticks < 200:
                world.robot.command(targets(world, **{joint: target}))
                world.step()
                now = world.robot.truth().joint_position[index]
                fastest = max(fastest, abs(now - before) / 0.01)
                before, ticks = now, ticks + 1
            for _ in range(20):
                world.step()
            assert world.robot.truth().joint_position[index] == pytest.approx(end, abs=1e-3)
        # a motor that fell behind its setpoint may catch up, up to its no-load speed
        assert fastest <= 1.01 * limit
        quickest = abs(end - start) / limit / 0.01
        assert quickest - 1 < ticks < 1.6 * quickest + 10


def test_encoder_offsets_cancel_in_the_readings(robot: RobotDescription, ideal: Plant) -> None:
    """With the target 0.5 the joint goes to 0.5 + offset, and its encoder reads 0.5."""
    variation = attrs.evolve(ideal.variation, joint_zero_std=0.01, joint_zero_cut=0.02)
    plant = attrs.evolve(ideal, variation=variation)
    with World.single(robot, plant, robot_seed=2) as world:
        for _ in range(50):
            world.robot.command(targets(world, HeadYaw=0.5))
            world.step()
        index = robot.index("HeadYaw")
        zero = world.robot.individual.joint_zero[index]
        frame = world.robot.sense()
        assert frame is not None
        assert abs(zero) > 1e-3
        assert world.robot.truth().joint_position[index] == pytest.approx(0.5 + zero, abs=5e-4)
        assert frame.joint_position[index] == pytest.approx(0.5, abs=5e-4)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"position": np.zeros(21)}, "targets.position"),
        ({"position": np.zeros((22, 1))}, "targets.position"),
        ({"position": np.full(22, math.nan)}, "targets.position"),
        ({"position": np.array([math.inf, *[0.0] * 21])}, "targets.position"),
        ({"stiffness": 1.5}, "targets.stiffness"),
        ({"stiffness": -0.1}, "targets.stiffness"),
        ({"stiffness": math.nan}, "targets.stiffness"),
    ],
)
def test_bad_targets_are_refused_and_change_nothing(
    robot: RobotDescription, ideal: Plant, change: dict[str, object], field: str
) -> None:
    with World.single(robot, ideal, NOMINAL) as world:
        good = targets(world, HeadYaw=0.5)
        bad = good._replace(**change)
        with pytest.raises(NaoGaitError, match=field):
            world.robot.command(bad)
        world.step()
        assert world.robot.truth().joint_position == pytest.approx(robot.stand_pose, abs=0.02)


def test_targets_are_copied(robot: RobotDescription, ideal: Plant) -> None:
    with World.single(robot, ideal, NOMINAL) as world:
        given = targets(world, HeadYaw=10.0, RHipYawPitch=-0.1)
        copy = given.position.copy()
        world.robot.command(given)
        world.step()
        assert np.array_equal(given.position, copy)
        given.position[:] = 0.0  # a later change has no effect
        for _ in range(100):
            world.step()
        yaw = world.robot.truth().joint_position[robot.index("HeadYaw")]
        assert yaw == pytest.approx(robot.upper[robot.index("HeadYaw")], abs=2e-3)


def test_unstable_physics_is_an_error(robot: RobotDescription) -> None:
    pytest.importorskip("mujoco")
    with World.single(robot, load_plant("reference"), 0, engine="mujoco") as world:
        world.robot.push(np.array((1.0, 0.0, 0.0)), 0.1)
        world.robot._push_force *= 1e8  # no push that is allowed does it

        def go_on() -> None:
            for _ in range(20):
                world.step()

        with pytest.raises(NaoGaitError, match="physics"):
            go_on()
        world.reset()
        world.step()
        assert abs(world.robot.truth().torso_position[0]) < 0.01
