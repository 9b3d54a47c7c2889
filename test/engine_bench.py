"""A nominal robot on each physics engine, and the same robot in Pinocchio."""

import math

import attrs
import numpy as np
import pinocchio as pin

from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from robot_core.types import FloatArray
from sim_bridge.engines import registry as engines
from sim_bridge.engines.backend import Backend, make_robot_model
from sim_bridge.individual import NOMINAL
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import Plant
from sim_bridge.state import StartState, StepInput, TrueState
from sim_bridge.trials.rollout import RolloutSpec, rollout
from sim_bridge.trials.tasks import find_task

G = 9.81
STILL = np.zeros(3)
TUMBLED = np.array([0.3, -0.2, 0.5, math.sqrt(1.0 - 0.38)])
"""A torso rotation without any symmetry."""
HIGH = np.array([0.4, -0.3, 3.0])


def changed(plant: Plant, **sections: dict[str, object]) -> Plant:
    """The plant with some options of some sections replaced."""
    return attrs.evolve(
        plant,
        **{
            name: attrs.evolve(getattr(plant, name), **options)
            for name, options in sections.items()
        },
    )


def weightless(plant: Plant) -> Plant:
    """The plant without gravity."""
    return changed(plant, physics={"gravity": 0.0})


class Bench:
    """A nominal robot on a backend, without setpoint handling, sensors or delay."""

    def __init__(self, engine: str, robot: RobotDescription, plant: Plant, seed: int = NOMINAL):
        model = make_robot_model(robot, plant, seed)
        self.robot, self.plant, self.body = robot, plant, model.body
        self.limits = TorqueLimits(robot, plant, model.individual)
        self.backend: Backend = engines.make_backend(engine, [model])
        self.setpoint = np.array(robot.stand_pose)

    def float(self, rotation: FloatArray = TUMBLED) -> TrueState:
        """High above the floor."""
        self.setpoint = np.array(self.robot.stand_pose)
        self.backend.reset([StartState(HIGH, rotation, self.setpoint)])
        return self.observe()

    def step(self, push: FloatArray = STILL, stiffness: float = 1.0) -> TrueState:
        """One physics step with a push (3,) [N] on the torso."""
        self.backend.step([StepInput(self.setpoint, stiffness, push)])
        return self.observe()

    def observe(self) -> TrueState:
        """The state now."""
        (state,) = self.backend.observe()
        return state

    def set(self, joint: str, angle: float) -> int:
        """Set the setpoint of a joint [rad]; its index."""
        index = self.robot.index(joint)
        self.setpoint[index] = angle
        return index

    def com(self, state: TrueState) -> FloatArray:
        """(3,) [m] centre of mass in the world."""
        rotation = rotation_matrix(state.torso_rotation)
        return self.body.pose(state.torso_position, rotation, state.joint_position).com


def swing(bench: Bench, step: int) -> None:
    """All joints in motion, inside their limits."""
    count = len(bench.setpoint)
    phase = 9.0 * step * bench.plant.physics.step + np.arange(count)
    share = 0.3 * np.sin(phase) * min(1.0, step * bench.plant.physics.step / 0.1)
    for leader, follower in bench.robot.coupled_joints:
        share[bench.robot.index(follower)] = share[bench.robot.index(leader)]
    pose = np.array(bench.robot.stand_pose) + share
    bench.setpoint = np.clip(pose, bench.robot.lower + 0.05, bench.robot.upper - 0.05)


class UrdfModel:
    """The robot by Pinocchio alone; the URDF's root and the torso frame coincide in this robot."""

    def __init__(self, robot: RobotDescription) -> None:
        self.model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        self.columns = [self.model.joints[self.model.getJointId(j)] for j in robot.joint_names]

    def momentum(self, state: TrueState) -> FloatArray:
        """(6,) about the centre of mass, in world axes."""
        q, v = pin.neutral(self.model), np.zeros(self.model.nv)
        rotation = rotation_matrix(state.torso_rotation)
        q[:3], q[3:7] = state.torso_position, state.torso_rotation
        v[:3], v[3:6] = rotation.T @ state.torso_linear_velocity, state.torso_angular_velocity
        for joint, angle, speed in zip(
            self.columns, state.joint_position, state.joint_velocity, strict=True
        ):
            q[joint.idx_q], v[joint.idx_v] = angle, speed
        return np.array(pin.computeCentroidalMomentum(self.model, self.data, q, v))

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(sum(inertia.mass for inertia in self.model.inertias))


def walked(task: str, engine: str, plant: str = "reference", robot: int = 0) -> float:
    """[m/s] in the commanded direction, over 3 s at full command; NaN after a fall."""
    spec = RolloutSpec(find_task(task).lasting(3.0), robot_seed=robot, engine=engine, plant=plant)
    metrics = rollout(spec).metrics
    return math.nan if metrics.fell else math.copysign(1.0, spec.task.asked) * metrics.speed_x
