"""Floor and self-collision in every physics engine."""

import math

import numpy as np
import pinocchio as pin
import pytest

from engine_bench import (
    Bench,
    G,
    changed,
    weightless,
)
from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant
from sim_bridge.world import World


def test_standing_sinks_by_weight_over_stiffness(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=NOMINAL, engine=engine) as world:
        for _ in range(150):
            world.step()
        truth = world.robot.truth()
    points = 8.0
    middle = [
        sole.position + sole.rotation @ np.mean(contact.points, axis=0)
        for sole, contact in zip(truth.soles, world.robot.body.soles, strict=True)
    ]
    depth = 0.005 - float(np.mean([point[2] for point in middle]))
    expected = world.robot.body.mass * G / (points * reference.contact.stiffness)
    assert depth == pytest.approx(expected, rel=0.02)


def test_standing_for_a_second_goes_nowhere(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(robot, reference, robot_seed=NOMINAL, engine=engine) as world:
        for _ in range(50):
            world.step()
        before = world.robot.truth()
        for _ in range(100):
            world.step()
        after = world.robot.truth()
    assert np.abs(after.torso_position - before.torso_position).max() < 2e-4
    tilt = np.degrees(np.linalg.norm(pin.log3(rotation_matrix(after.torso_quaternion))))
    assert tilt < 0.5
    assert after.torque_saturated == 0
    assert not after.legs_touch


def slide(world: World, push: float) -> tuple[float, float, float]:
    """[m] way, [m/s] speed at the end, and tangential over normal force, in half a second."""
    for _ in range(50):
        world.step()
    world.robot.push(np.array([push, 0.0, 0.0]), 0.5)
    start = world.robot.truth().soles[0].position[0]
    for _ in range(49):
        world.step()
    before = world.robot.truth().soles[0].position[0]
    world.step()
    truth, reading = world.robot.truth(), world.robot.read()
    assert reading is not None
    forces = [
        sole.rotation @ wrench[:3]
        for sole, wrench in zip(truth.soles, reading.sole_wrench, strict=True)
    ]
    x, y, z = np.sum(forces, axis=0)
    end = truth.soles[0].position[0]
    return end - start, (end - before) / 0.01, math.hypot(x, y) / z


def test_feet_slide_when_the_force_passes_friction_times_weight(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    friction = 0.1  # so that the robot slides before it tips over
    plant = changed(reference, contact={"friction": friction})
    with World.single(
        robot, plant, NOMINAL, engine=engine, sensor_delay=0.0
    ) as world:
        grip = friction * world.robot.body.mass * G
        way, speed, ratio = slide(world, 0.8 * grip)
        assert abs(way) < 4e-3
        assert abs(speed) < 5e-4
        assert ratio == pytest.approx(0.8 * friction, rel=0.1)
        world.reset()
        way, speed, ratio = slide(world, 1.3 * grip)
        assert way > 0.03
        assert ratio == pytest.approx(friction, rel=0.01)


def test_a_slippery_floor_stays_so_over_a_reset(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with World.single(
        robot, reference, NOMINAL, engine=engine, sensor_delay=0.0
    ) as world:
        world.robot.set_friction(0.05)
        before, *_ = slide(world, 6.0)
        world.reset()
        after, *_ = slide(world, 6.0)
        assert before > 0.05
        assert after == pytest.approx(before, rel=0.1)
        world.robot.set_friction(None)
        world.reset()
        way, *_ = slide(world, 6.0)
        assert way < 0.01


@pytest.mark.parametrize("self_collision", [True, False])
def test_legs_meet_only_with_self_collision(
    engine: str, robot: RobotDescription, reference: Plant, self_collision: bool
) -> None:
    plant = changed(weightless(reference), physics={"self_collision": self_collision})
    bench = Bench(engine, robot, plant)
    assert not bench.float().legs_touch
    bench.set("LHipRoll", -0.35)
    bench.set("RHipRoll", 0.35)
    touched = any(bench.step().legs_touch for _ in range(200))
    rolls = bench.observe().joint_position[
        [robot.index("LHipRoll"), robot.index("RHipRoll")]
    ]
    bench.backend.close()
    assert touched == self_collision
    if not self_collision:
        assert rolls == pytest.approx([-0.35, 0.35], abs=0.01)
    else:
        assert abs(rolls[0]) < 0.34


def test_rigid_floor_does_not_give_way(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    plant = changed(reference, contact={"rigid": True})
    with World.single(robot, plant, robot_seed=NOMINAL, engine=engine) as world:
        for _ in range(100):
            world.step()
        truth = world.robot.truth()
    assert max(abs(sole.position[2]) for sole in truth.soles) < 3e-4
