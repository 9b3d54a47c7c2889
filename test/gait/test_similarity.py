"""Robots of another size: the same walk in other lengths and times, and heavy robots that walk."""

import dataclasses
import re
import xml.etree.ElementTree as ET
from math import sqrt

import attrs
import numpy as np
import pinocchio as pin
import pytest

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.presets import DEFAULT, preset_for
from nao_lipm_gait.similarity import KNEE_LOAD, Size, fitted, image_of, proportions
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel
from nao_lipm_gait.whole_body.com_placement import ComPlacement
from nao_lipm_gait.whole_body.legs import make_legs
from robot_core.geometry import ORIGIN
from robot_core.robot import JointLimit, RobotDescription, load_robot
from robot_core.types import GRAVITY, SensorFrame, VelocityCommand
from sim_bridge.simulation import Simulation

NAO = load_robot()
GIANT = 2.25
PERIOD = 0.01


def enlarged(robot: RobotDescription, length: float) -> RobotDescription:
    """A robot of the same proportions."""
    root = ET.fromstring(robot.urdf)
    for origin in root.iter("origin"):
        words = origin.get("xyz", "0 0 0").split()
        origin.set("xyz", " ".join(repr(length * float(word)) for word in words))
    return dataclasses.replace(
        robot,
        size=length,
        urdf=ET.tostring(root, encoding="unicode"),
        limits={
            name: JointLimit(each.lower, each.upper, each.velocity / sqrt(length), each.effort)
            for name, each in robot.limits.items()
        },
        motors={
            name: attrs.evolve(
                each,
                no_load_speed=each.no_load_speed / sqrt(length),
                stall_torque=length * each.stall_torque,
            )
            for name, each in robot.motors.items()
        },
        sole_outline=tuple((length * x, length * y) for x, y in robot.sole_outline),
        sole_corners=tuple((length * x, length * y) for x, y in robot.sole_corners),
    )


def test_the_nao_is_its_own_image() -> None:
    assert image_of(NAO) is NAO
    parameters = load_preset(DEFAULT)
    assert fitted(parameters, NAO, NAO).as_dict() == pytest.approx(parameters.as_dict())
    assert proportions(enlarged(NAO, GIANT)) == pytest.approx(proportions(NAO))


def test_weak_hips_kick_less_far() -> None:
    def reach(share: float) -> float:
        motors = {
            name: attrs.evolve(each, stall_torque=share * each.stall_torque)
            for name, each in NAO.motors.items()
        }
        weak = dataclasses.replace(NAO, motors=motors)
        return fitted(load_preset(DEFAULT), weak, NAO).kick_reach

    full = load_preset(DEFAULT).kick_reach
    assert reach(1.0) == reach(2.0) == full
    assert 0.1 * full < reach(0.4) < 0.9 * full
    assert reach(0.1) == 0.0


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_weak_knees_bend_less(share: float) -> None:
    """At the CoM height that fits them, the lever of a T1's knee is what its motor can hold."""
    known = load_robot("booster_t1")
    motors = {
        name: attrs.evolve(each, stall_torque=share * each.stall_torque)
        for name, each in known.motors.items()
    }
    weak = dataclasses.replace(known, motors=motors)
    p = fitted(load_preset(DEFAULT), weak, NAO)
    assert p.com_height == p.pendulum_height > load_preset(DEFAULT).com_height
    body = BodyModel(weak)
    placement = ComPlacement(weak, body, make_legs(weak))
    half = 0.5 * weak.size * p.foot_spacing
    soles = SoleTarget(0.0, half, 0.0, 0.0), SoleTarget(0.0, -half, 0.0, 0.0)
    com = weak.size * p.foot_reference_x, 0.0, weak.size * p.com_height
    for _ in range(6):
        position = placement.place(BodyTargets(com, *soles, 0.0, ORIGIN)).position
    model = pin.buildModelFromXML(weak.urdf)
    data, q = model.createData(), pin.neutral(model)
    for name, angle in zip(weak.joint_names, position, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.forwardKinematics(model, data, q)
    leg = weak.left_leg
    hip, knee, ankle = (
        data.oMi[model.getJointId(name)].translation
        for name in (leg.hip_pitch, leg.knee_pitch, leg.ankle_pitch)
    )
    line = (ankle - hip) / np.linalg.norm(ankle - hip)
    lever = np.linalg.norm(np.cross(knee - hip, line))
    weight = GRAVITY * sum(inertia.mass for inertia in model.inertias)
    load = weight * lever / weak.motors[leg.knee_pitch].stall_torque
    assert load == pytest.approx(KNEE_LOAD, rel=0.15)


def test_lighter_arms_swing_more() -> None:
    """The yaw momentum of an arm with half the mass is half as large."""
    root = ET.fromstring(NAO.urdf)
    for link in root.iter("link"):
        if re.search(r"Shoulder|Bicep|Elbow|ForeArm|Hand|Wrist|Finger|Thumb", link.get("name", "")):
            for value in link.iter("mass"):
                value.set("value", repr(0.5 * float(value.get("value", "0"))))
            for inertia in link.iter("inertia"):
                for key, value in inertia.attrib.items():
                    inertia.set(key, repr(0.5 * float(value)))
    light = dataclasses.replace(NAO, urdf=ET.tostring(root, encoding="unicode"))
    swing, other = (fitted(load_preset(DEFAULT), each, NAO).arm_swing for each in (light, NAO))
    assert swing == pytest.approx(2.0 * other, rel=0.02)


def test_a_giant_walks_as_its_image_does() -> None:
    size, giant = Size(GIANT), enlarged(NAO, GIANT)
    # The ground, which the levelling of the soles expects, does not grow with the robot.
    parameters = load_preset(DEFAULT).replace(level_soles=False)
    slower = parameters.replace(feedback_delay=size.time * parameters.feedback_delay)
    small, large = Gait(NAO, parameters, PERIOD), Gait(giant, slower, size.time * PERIOD)
    rng = np.random.default_rng(7)
    position = np.array(NAO.stand_pose)
    up = np.array((0.0, 0.0, 9.81))
    for tick in range(500):
        rate = rng.normal(0.0, 0.02, 3)
        speed = 0.2 if tick > 100 else 0.0
        targets = small.step(
            SensorFrame(round(tick * PERIOD * 1e9), position, rate, up),
            VelocityCommand(speed, 0.05, 0.3 if tick > 200 else 0.0),
        )
        same = large.step(
            SensorFrame(round(tick * size.time * PERIOD * 1e9), position, rate / size.time, up),
            VelocityCommand(
                speed * GIANT / size.time, 0.05 * GIANT / size.time,
                (0.3 if tick > 200 else 0.0) / size.time,
            ),
        )  # fmt: skip
        np.testing.assert_allclose(same.position, targets.position, atol=1e-6)
        position = targets.position
    assert small.status.step_count == large.status.step_count > 5
    near, far = small.status, large.status
    assert np.array(far.base_footprint_in_odom[:2]) == pytest.approx(
        GIANT * np.array(near.base_footprint_in_odom[:2]), abs=1e-4
    )
    assert np.array(far.velocity[:2]) == pytest.approx(
        GIANT / size.time * np.array(near.velocity[:2]), abs=1e-4
    )
    assert large.torso_pose[2] == pytest.approx(GIANT * small.torso_pose[2], abs=1e-6)


@pytest.mark.parametrize("name", ["booster_t1", "booster_k1"])
def test_a_heavy_robot_walks_by_its_description_alone(name: str) -> None:
    gait = Gait(name, preset_for(load_robot(name), DEFAULT))
    with Simulation(name, engine="mujoco", seed=40) as sim:
        obs, targets = sim.reset(), None
        for tick in range(1000):
            obs = sim.step(targets)
            if obs.frame:
                speed = 0.2 * min(max((0.01 * tick - 3.0) / 2.0, 0.0), 1.0)
                targets = gait.step(obs.frame, VelocityCommand(speed))
        ahead, aside, _ = obs.truth.base_footprint
    assert gait.status.state == "walk"
    assert ahead > 0.6
    assert abs(aside) < 0.3
    assert gait.status.base_footprint_in_odom[0] == pytest.approx(ahead, rel=0.2)
