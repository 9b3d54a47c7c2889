"""Masses, momentum and frames in every physics engine.

Black box wherever possible: masses, inertias and torques are judged by how the robot moves, against
Pinocchio on the same URDF, not by the parameters that the engine reports.
"""

import dataclasses

import attrs
import numpy as np
import pinocchio as pin
import pytest

from engine_bench import (
    HIGH,
    Bench,
    G,
    UrdfModel,
    swing,
)
from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant, load_plant
from sim_bridge.world import World


def test_standing_weight_and_centre_of_pressure_are_those_of_the_urdf(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(
        robot, reference, NOMINAL, engine=engine, sensor_delay=0.0
    ) as world:
        for _ in range(150):
            world.step()
        reading, truth = world.robot.read(), world.robot.truth()
        assert truth.sole_force.sum() == pytest.approx(UrdfModel(robot).mass * G, rel=1e-3)
        assert reading is not None
        pressure, total = np.zeros(2), 0.0
        for sole, wrench in zip(truth.soles, reading.sole_wrench, strict=True):
            force = sole.rotation @ wrench[:3]
            torque = sole.rotation @ wrench[3:] + np.cross(sole.position, force)
            pressure += (-torque[1], torque[0])
            total += force[2]
        assert pressure / total == pytest.approx(truth.com[:2], abs=1e-3)


def test_joints_swinging_in_free_fall_leave_the_centre_of_mass_on_its_parabola(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    """Wrong masses or centres of mass of any link would make it wobble."""
    bench = Bench(engine, robot, reference, seed=3)
    state = bench.float()
    start, step, steps = bench.com(state), reference.physics.step, 150
    wobble = travel = 0.0
    for count in range(1, steps + 1):
        swing(bench, count)
        state = bench.step()
        # semi-implicit Euler falls by g t (t + dt) / 2
        fall = G * step * step * count * (count + 1) / 2.0
        wobble = max(wobble, float(np.linalg.norm(bench.com(state) + (0.0, 0.0, fall) - start)))
        travel = max(travel, float(np.linalg.norm(state.joint_position - robot.stand_pose)))
    bench.backend.close()
    assert travel > 0.5
    assert wobble < 5e-4


def test_swinging_in_free_fall_conserves_angular_momentum(floating: Bench) -> None:
    """Wrong inertias of any link would show."""
    state, model = floating.float(), UrdfModel(floating.robot)
    largest = moved = 0.0
    for count in range(1, 101):
        swing(floating, count)
        state = floating.step()
        momentum = model.momentum(state)[3:]
        largest = max(largest, float(np.linalg.norm(momentum)))
        moved = max(moved, float(np.abs(state.joint_velocity).max()))
    assert moved > 2.0
    assert largest < 5e-3


def test_velocities_are_the_rates_of_the_poses_in_their_frames(floating: Bench) -> None:
    """Linear in the world, angular in the torso: engines mix these conventions up."""
    state = floating.float()
    step = floating.plant.physics.step
    spin = 0.0
    for count in range(1, 81):
        before = state
        swing(floating, count)
        state = floating.step(push=np.array([20.0, -10.0, 5.0]))
        moved = (state.torso_position - before.torso_position) / step
        assert state.torso_linear_velocity == pytest.approx(moved, abs=0.01)
        turn = rotation_matrix(before.torso_rotation).T @ rotation_matrix(state.torso_rotation)
        rate = pin.log3(turn) / step
        assert state.torso_angular_velocity == pytest.approx(rate, abs=0.02)
        speed = (state.joint_position - before.joint_position) / step
        assert state.joint_velocity == pytest.approx(speed, abs=0.02)
        spin = max(spin, float(np.abs(rate).max()))
    assert spin > 0.5


def test_a_push_acts_on_the_centre_of_the_torso_and_ends(floating: Bench) -> None:
    floating.float()
    force, steps = np.array([0.0, 25.0, 0.0]), 10
    before = floating.com(floating.observe())
    for _ in range(steps):
        state = floating.step(push=force)
    pushed = floating.com(state)
    for _ in range(50):
        state = floating.step()
    speed = (floating.com(state) - pushed) / (50 * floating.plant.physics.step)
    impulse = force * steps * floating.plant.physics.step
    assert speed == pytest.approx(impulse / floating.body.mass, abs=1e-3)
    assert np.linalg.norm(pushed - before) < 0.01


def test_accelerometer_reads_gravity_at_rest_and_nothing_in_free_fall(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    exact = attrs.evolve(reference, sensors=load_plant("ideal").sensors)
    with World.single(robot, exact, robot_seed=NOMINAL, engine=engine) as world:
        for _ in range(100):
            world.step()
        frame = world.robot.sense()
        assert frame is not None
        assert frame.linear_acceleration == pytest.approx([0.0, 0.0, G], abs=0.1)
        assert frame.angular_velocity == pytest.approx(np.zeros(3), abs=0.01)
        world.robot.start = dataclasses.replace(world.robot.start, torso_position=HIGH)
        world.reset()
        for _ in range(10):
            world.step()
        frame = world.robot.sense()
        assert frame is not None
        assert frame.linear_acceleration == pytest.approx(np.zeros(3), abs=0.1)
