"""A simulated robot that stands, sways or is pushed, and what came of it in numbers."""

import math

import attrs
import numpy as np
import pinocchio as pin

from nao_lipm_gait.parameters import GaitParameters
from nao_lipm_gait.presets import preset_for
from robot_core.robot import load_robot
from robot_core.types import FloatArray, JointTargets, SensorFrame
from sim_bridge.plant import Plant
from sim_bridge.robot import GroundTruth
from sim_bridge.trials.rollout import RolloutSpec, make_pair
from sim_bridge.trials.tasks import TASKS
from sim_bridge.world import World

MS = 1_000_000
G = 9.81


def with_physics(plant: Plant, **options: object) -> Plant:
    """The plant with some options of its physics replaced."""
    return attrs.evolve(plant, physics=attrs.evolve(plant.physics, **options))


def standing(urdf: str, seed: int, engine: str) -> tuple[World, GaitParameters]:
    """A robot of the plant that stands, and the parameters of its gait."""
    parameters = preset_for(load_robot(urdf), "default")
    spec = RolloutSpec(
        task=TASKS["stand"], robot_seed=seed, noise_seed=seed, parameters=parameters, urdf=urdf,
        engine=engine,
    )  # fmt: skip
    return make_pair(spec)[0], parameters


def targets(world: World, stiffness: float = 1.0, **joints: float) -> JointTargets:
    """The stand pose with some joints elsewhere [rad]."""
    position = np.array(world.robot.description.stand_pose)
    for joint, angle in joints.items():
        position[world.robot.description.index(joint)] = angle
    return JointTargets(world.time, position, stiffness)


def sway(world: World, tick: int) -> JointTargets:
    """Legs in motion."""
    roll = 0.1 * math.sin(0.2 * tick)
    return targets(world, LHipRoll=roll, RHipRoll=roll, LKneePitch=0.7 + roll)


def run(world: World, ticks: int) -> tuple[FloatArray, FloatArray]:
    """(ticks, ...) truth and sensor frames while swaying and being pushed."""
    truths, frames = [], []
    for tick in range(ticks):
        if tick == ticks // 2:
            world.robot.push(np.array([8.0, -5.0, 0.0]), 0.1)
        world.robot.command(sway(world, tick))
        world.step()
        truths.append(flat(world.robot.truth()))
        frame = world.robot.sense()
        if frame is not None:
            frames.append(flat_frame(frame))
    return np.array(truths), np.array(frames)


def flat(truth: GroundTruth) -> FloatArray:
    """Everything but the stamp."""
    return np.concatenate(
        [
            truth.torso_position, truth.torso_quaternion, truth.torso_linear_velocity_in_torso,
            truth.torso_angular_velocity_in_torso, truth.com, truth.sole_force,
            np.nan_to_num(truth.sole_slip, nan=-1.0),
            truth.joint_position, truth.joint_torque, [truth.torque_saturated, truth.legs_touch],
            *(sole.position for sole in truth.soles),
            *(sole.rotation.ravel() for sole in truth.soles),
        ]
    )  # fmt: skip


def flat_frame(frame: SensorFrame) -> FloatArray:
    """Everything but the stamp."""
    return np.concatenate(
        [frame.joint_position, frame.angular_velocity, frame.linear_acceleration]
    )


def tilt(truth: GroundTruth) -> float:
    """[deg] of the torso."""
    return math.degrees(math.acos(pin.Quaternion(truth.torso_quaternion).matrix()[2, 2]))
