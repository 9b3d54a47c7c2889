"""Joints and torques in every physics engine."""

import math

import numpy as np
import pinocchio as pin
import pytest

from engine_bench import (
    Bench,
    changed,
    weightless,
)
from robot_core.robot import RobotDescription
from robot_core.types import JointTargets
from sim_bridge.plant import Plant
from sim_bridge.world import World


@pytest.mark.parametrize("joint", ["HeadYaw", "LElbowRoll", "RKneePitch", "LAnkleRoll"])
def test_a_joint_follows_a_step_with_the_lag_of_the_plant(floating: Bench, joint: str) -> None:
    floating.float()
    before = floating.robot.stand_pose[floating.robot.index(joint)]
    way = -0.05 if joint == "LElbowRoll" else 0.05
    index = floating.set(joint, before + way)
    step, shares = floating.plant.physics.step, [0.0]
    for _ in range(60):
        shares.append((floating.step().joint_position[index] - before) / way)
    reached = 1.0 - math.exp(-1.0)
    late = next(i for i, share in enumerate(shares) if share >= reached)
    time = (late - (shares[late] - reached) / (shares[late] - shares[late - 1])) * step
    assert time == pytest.approx(floating.plant.motor.lag, abs=0.004)
    assert max(shares) < 1.08
    assert shares[-1] == pytest.approx(1.0, abs=0.02)


def test_torque_reaches_its_cap_and_never_passes_it(floating: Bench) -> None:
    """The knee runs into its end stop: from standstill to its top speed, and stopped by force."""
    floating.float()
    index = floating.set("RKneePitch", 3.0)
    cap = 0.7 * floating.robot.motors["RKneePitch"].stall_torque
    state, torques, excess = floating.observe(), [], 0.0
    for _ in range(400):
        velocity = state.joint_velocity
        state = floating.step()
        torques.append(state.joint_torque[index])
        driving = state.joint_torque * velocity > 0.0
        limit = np.where(driving, floating.limits.driving(velocity), floating.limits.standstill)
        excess = max(excess, float((np.abs(state.joint_torque) - limit).max()))
    assert state.joint_position[index] > floating.robot.upper[index] - 0.02
    assert excess < 0.01 * cap  # at top speed PyBullet may drive where it is about to brake
    assert max(torques) == pytest.approx(cap, rel=1e-6)


def test_the_cap_is_what_really_moves_the_joint(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    """Reported torques prove nothing: engines have limits of their own that act later."""
    plant = changed(weightless(reference), motor={"torque_speed_line": False})
    bench = Bench(engine, robot, plant)
    bench.float()
    index = bench.set("HeadYaw", 2.0)
    steps = 5
    for _ in range(steps):
        state = bench.step()
    bench.backend.close()
    motor = robot.motors["HeadYaw"]
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    pin.crba(model, data, pin.neutral(model))
    joint = model.joints[model.getJointId("HeadYaw")].idx_v
    rotor = motor.reflected_inertia if engine == "mujoco" else 0.0
    inertia = data.M[joint, joint] + rotor
    expected = 0.7 * motor.stall_torque * steps * plant.physics.step / inertia
    relative = state.joint_velocity[index]
    assert relative == pytest.approx(expected, rel=0.1)


def test_a_relaxed_motor_puts_out_nothing(floating: Bench) -> None:
    floating.float()
    index = floating.set("LElbowRoll", -1.0)
    for _ in range(50):
        state = floating.step(stiffness=0.0)
    assert state.joint_torque == pytest.approx(np.zeros(len(state.joint_torque)), abs=1e-9)
    assert abs(state.joint_position[index] - floating.robot.stand_pose[index]) < 0.01


def test_one_motor_turns_both_hips(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    (leader, follower), = robot.coupled_joints
    first, second = robot.index(leader), robot.index(follower)
    with World.single(robot, reference, robot_seed=0, engine=engine) as world:
        target = np.array(robot.stand_pose)
        apart, torque = 0.0, 0.0
        for tick in range(150):
            target[first] = -0.4 * min(1.0, tick / 50.0)
            target[second] = 0.3  # this target is ignored
            world.robot.command(JointTargets(world.time, target, 1.0))
            world.step()
            truth = world.robot.truth()
            apart = max(apart, abs(truth.joint_position[first] - truth.joint_position[second]))
            torque = max(torque, abs(truth.joint_torque[second]))
        assert apart < math.radians(0.1)
        assert torque == 0.0
        zero = world.robot.individual.joint_zero[first]
        assert truth.joint_position[second] - zero == pytest.approx(-0.4, abs=0.02)
