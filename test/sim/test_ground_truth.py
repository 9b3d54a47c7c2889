"""Ground truth of the world: centre of mass, velocities, slip, motors at their limit."""

import xml.etree.ElementTree as ET

import attrs
import numpy as np
import pinocchio as pin
import pytest

from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant
from sim_bridge.robot import GroundTruth
from sim_bridge.world import World
from simulation_runs import G, sway, tilt, with_physics


def summed_com(world: World, truth: GroundTruth) -> FloatArray:
    """Link by link from the URDF, the masses of this individual and the true pose."""
    robot = world.robot.description
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    q[:3], q[3:7] = truth.torso_position, truth.torso_quaternion
    for joint, angle in zip(robot.joint_names, truth.joint_position, strict=True):
        q[model.joints[model.getJointId(joint)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    mass, moment = 0.0, np.zeros(3)
    for link in ET.fromstring(robot.urdf).iter("link"):
        name = link.attrib["name"]
        value, origin = link.find("inertial/mass"), link.find("inertial/origin")
        assert value is not None
        assert origin is not None
        own = float(value.attrib["value"]) * world.robot.individual.mass_scale.get(name, 0.0)
        local = np.array([float(v) for v in origin.attrib["xyz"].split()])
        frame = data.oMf[model.getFrameId(name, pin.FrameType.BODY)]
        mass, moment = mass + own, moment + own * frame.act(local)
    return moment / mass


def test_the_true_com_is_the_sum_over_the_true_links(
    robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=3) as world:
        for tick in range(25):
            world.robot.command(sway(world, tick))
            world.step()
        truth = world.robot.truth()
        assert truth.com == pytest.approx(summed_com(world, truth), abs=1e-9)


def test_true_velocities_are_the_rates_of_the_true_poses_in_the_torso(
    robot: RobotDescription, reference: Plant
) -> None:
    """Falling over, because an upright torso hides a wrong frame."""
    plant = with_physics(reference, step=0.001)
    with World.single(robot, plant, NOMINAL, control_period=0.001) as world:
        world.robot.push(np.array([60.0, 40.0, 0.0]), 0.1)
        for _ in range(350):
            world.step()
        before = world.robot.truth()
        world.step()
        truth = world.robot.truth()
    rotation = pin.Quaternion(truth.torso_quaternion).matrix()
    earlier = pin.Quaternion(before.torso_quaternion).matrix()
    moved = (truth.torso_position - before.torso_position) / 0.001
    assert tilt(truth) > 20.0
    assert np.linalg.norm(moved) > 0.3
    assert truth.torso_linear_velocity_in_torso == pytest.approx(rotation.T @ moved, abs=0.02)
    turned = pin.log3(earlier.T @ rotation) / 0.001
    assert np.linalg.norm(turned) > 1.0
    assert truth.torso_angular_velocity_in_torso == pytest.approx(turned, abs=0.05)


def test_a_robot_that_stands_does_not_slip(robot: RobotDescription, reference: Plant) -> None:
    with World.single(robot, reference, NOMINAL) as world:
        for _ in range(50):
            world.step()
        truth = world.robot.truth()
        assert truth.sole_slip.max() < 1e-3
        assert truth.sole_force == pytest.approx([world.robot.body.mass * G / 2] * 2, rel=0.05)
        world.robot.push(np.array([0.0, 0.0, 400.0]), 0.1)  # off the floor
        for _ in range(12):
            world.step()
        assert np.isnan(world.robot.truth().sole_slip).all()
        assert not world.robot.truth().sole_force.any()


def test_a_motor_at_its_limit_is_counted(robot: RobotDescription, reference: Plant) -> None:
    motor = attrs.evolve(reference.motor, torque_fraction=0.03)
    with World.single(robot, attrs.evolve(reference, motor=motor), NOMINAL) as world:
        for _ in range(20):
            world.step()
        truth = world.robot.truth()
        standstill = 0.03 * robot.motors["LKneePitch"].stall_torque
        torque = abs(truth.joint_torque[robot.index("LKneePitch")])
        assert torque <= standstill * (1 + 1e-9)
        assert truth.torque_saturated > 0
