"""Booster K1, Booster T1 and ROBOTIS OP3: their URDF files against their public models."""

import dataclasses
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pinocchio as pin
import pytest
import yaml

from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.robot import load_robot
from robot_core.types import FloatArray
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant
from sim_bridge.world import World

CHECKS = yaml.safe_load(
    (Path(__file__).parents[1] / "data" / "humanoid_checks.yaml").read_text(encoding="utf-8")
)
HALVES = {"booster_k1": 3e-5, "booster_t1": 1e-3, "op3": 1e-6}
"""[m] largest shift of the centre of mass because our halves are mirror images, which those of the
public model are not: T1's right shank is 60 g heavier than its left one."""


class Humanoid:
    """One robot in Pinocchio, with its check values."""

    def __init__(self, name: str) -> None:
        self.checks: dict[str, Any] = CHECKS[name]
        self.com_error = HALVES[name]
        self.model = pin.buildModelFromUrdf(str(find("urdf", name)), pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        self.zero = pin.neutral(self.model)

    def com(self, q: FloatArray) -> FloatArray:
        return np.array(pin.centerOfMass(self.model, self.data, q))


@pytest.fixture(scope="module", params=CHECKS)
def robot(request: pytest.FixtureRequest) -> Humanoid:
    return Humanoid(request.param)


def test_mass_and_centre_of_mass(robot: Humanoid) -> None:
    assert pin.computeTotalMass(robot.model) == pytest.approx(robot.checks["mass"], abs=2e-5)
    assert robot.com(robot.zero) == pytest.approx(robot.checks["com"], abs=robot.com_error)
    q = robot.zero.copy()
    for count, (name, row) in enumerate(sorted(robot.checks["joints"].items())):
        lower, upper = row[6:8]
        q[robot.model.joints[robot.model.getJointId(name)].idx_q] = (
            0.5 * (lower + upper) + 0.3 * (upper - lower) * (1 if count % 2 else -1)
        )
    assert robot.com(q) == pytest.approx(robot.checks["com_bent"], abs=robot.com_error)


def test_joints_have_the_public_names_axes_places_and_limits(robot: Humanoid) -> None:
    model, data = robot.model, robot.data
    assert set(model.names[2:]) == set(robot.checks["joints"])
    pin.computeJointJacobians(model, data, robot.zero)
    for name, row in robot.checks["joints"].items():
        number = model.getJointId(name)
        joint, place = model.joints[number], data.oMi[number]
        axis = pin.getJointJacobian(model, data, number, pin.ReferenceFrame.WORLD)[3:, joint.idx_v]
        assert axis == pytest.approx(row[:3], abs=1e-3), name
        assert place.translation == pytest.approx(row[3:6], abs=1e-6), name
        limits = (
            model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q],
            model.velocityLimit[joint.idx_v], model.effortLimit[joint.idx_v],
        )  # fmt: skip
        assert limits == pytest.approx(row[6:], abs=1e-3), name


@pytest.mark.parametrize("name", CHECKS)
def test_it_stands_in_its_stand_pose(name: str, engine: str, reference: Plant) -> None:
    robot = load_robot(name)
    assert robot.remarks == ()
    if engine == "pybullet":
        with pytest.raises(NaoGaitError, match="gives way"):
            World.single(robot, reference, engine=engine)
    stiff = {  # motors that give way sag, and only MuJoCo has them
        joint: attrs.evolve(motor, stiffness=None, damping=None)
        for joint, motor in robot.motors.items()
    }
    robot = dataclasses.replace(robot, motors=stiff)
    with World.single(robot, reference, engine=engine, robot_seed=NOMINAL) as world:
        world.robot.command(None)
        for _ in range(20):
            world.step()
        before = world.robot.truth()
        for _ in range(100):
            world.step()
        after = world.robot.truth()
    assert after.torso_position == pytest.approx(before.torso_position, abs=2e-3)
    assert after.torso_quaternion == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=5e-3)
    assert after.sole_force.sum() == pytest.approx(9.81 * CHECKS[name]["mass"], rel=0.03)
    sunk = [float(sole.position[2]) for sole in after.soles]
    assert sunk == pytest.approx([0.0, 0.0], abs=1.5e-3)
