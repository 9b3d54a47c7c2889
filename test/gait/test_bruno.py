"""The second robot: its URDF against what the paper states, and the robot file that finds it."""

import xml.etree.ElementTree as ET
from collections import Counter

import numpy as np
import pinocchio as pin
import pytest
import yaml

from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import RobotDescription, load_robot
from sim_bridge.plant import load_plant, with_sensors_of

FACTS = yaml.safe_load(share("urdf", "bruno_facts.yaml").read_text(encoding="utf-8"))
PAPER = FACTS["paper"]


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("bruno")


@pytest.fixture(scope="module")
def model(robot: RobotDescription) -> pin.Model:
    return pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())


@pytest.fixture(scope="module")
def data(model: pin.Model) -> pin.Data:
    """Kinematics of the zero pose."""
    data = model.createData()
    pin.centerOfMass(model, data, pin.neutral(model))
    pin.updateFramePlacements(model, data)
    return data


def frame(model: pin.Model, data: pin.Data, name: str) -> pin.SE3:
    return data.oMf[model.getFrameId(name, pin.FrameType.BODY)]


def test_mass_joints_and_centre_of_mass_are_the_published_ones(
    robot: RobotDescription, model: pin.Model, data: pin.Data
) -> None:
    assert pin.computeTotalMass(model) == pytest.approx(PAPER["mass"], abs=1e-9)
    assert model.njoints - 2 == len(robot.joint_names) == PAPER["joints"]
    ground = frame(model, data, "l_sole").translation[2]
    assert data.com[0][2] - ground == pytest.approx(PAPER["com_height"], abs=1e-5)
    assert frame(model, data, "r_sole").translation[2] == pytest.approx(ground)


def test_height_and_sole_are_the_published_ones(
    robot: RobotDescription, model: pin.Model, data: pin.Data
) -> None:
    ground = frame(model, data, "l_sole").translation[2]
    top = max(
        frame(model, data, link).translation[2] + shape["at"][2] + shape["box"][2] / 2.0
        for link, shapes in FACTS["visuals"].items()
        if link == "Head"
        for shape in shapes
        if "box" in shape
    )
    assert top - ground == pytest.approx(PAPER["height"], abs=1e-6)
    x, y = np.array(robot.sole_outline).T
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    assert area == pytest.approx(PAPER["foot_area"])


def test_axes_stand_in_the_published_order(robot: RobotDescription, model: pin.Model) -> None:
    joints = ET.fromstring(robot.urdf).iter("joint")
    axes = {joint.get("name"): joint.find("axis") for joint in joints}
    for leg in (robot.left_leg, robot.right_leg):
        got = [axes[name].attrib["xyz"] for name in leg.names]  # type: ignore[union-attr]
        kinds = [[abs(float(number)) for number in text.split()].index(1.0) for text in got]
        assert kinds == [2, 0, 1, 1, 1, 0]  # turn uppermost, roll, three pitches, roll
    assert robot.waist_pitch == "WaistPitch"
    assert model.parents[model.getJointId("LHipYaw")] == 1, "the waist does not move the legs"


def test_every_row_says_where_it_comes_from() -> None:
    for table in ("links", "joints", "frames"):
        for name, row in FACTS[table].items():
            assert row["from"] in ("paper", "servo", "chosen"), name


def test_links_weigh_more_than_the_motors_in_them() -> None:
    """Each link at least as heavy as the motors and batteries that its comment names."""
    servo = PAPER["motor_mass"]["dx117"]
    motors = {
        "base_link": 3, "torso": 3, "Head": 1, "LShoulder": 1, "LUpperArm": 1, "LHip": 2,
        "LAnklePitch": 1, "l_ankle": 1,
    }  # fmt: skip
    sides = Counter({name: 2 if name[0] in "Ll" else 1 for name in motors})
    assert sum(motors[name] * sides[name] for name in motors) == 19
    for name, count in motors.items():
        assert FACTS["links"][name]["mass"] >= count * servo, name
    assert FACTS["links"]["LThigh"]["mass"] > PAPER["motor_mass"]["rx64"]


def test_motors_are_the_published_ones(robot: RobotDescription) -> None:
    for name, motor in robot.motors.items():
        torque = 6.57 if name.endswith("KneePitch") else 3.334
        assert motor.stall_torque == torque == robot.limits[name].effort
        assert motor.no_load_speed == robot.limits[name].velocity


def test_robot_files_are_found_by_the_joints_of_the_urdf() -> None:
    assert load_robot("bruno").name == "bruno"
    for urdf in ("nao_h21_v33", "nao_h21_v40"):
        assert load_robot(urdf).name == "nao_h21"
        assert load_robot(urdf).waist_pitch is None
    with pytest.raises(NaoGaitError, match="LElbowYaw"):
        load_robot("bruno", "nao_h21")


def test_standing_the_weight_is_over_the_feet(robot: RobotDescription, model: pin.Model) -> None:
    data, q = model.createData(), pin.neutral(model)
    for name, angle in zip(robot.joint_names, robot.stand_pose, strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    com = pin.centerOfMass(model, data, q)
    pin.updateFramePlacements(model, data)
    sole = frame(model, data, "l_sole")
    assert sole.rotation == pytest.approx(np.eye(3), abs=1e-9)
    front, back = robot.sole_corners[0][0], robot.sole_corners[2][0]
    ahead = float(com[0] - sole.translation[0])
    assert back + 0.04 < ahead < front - 0.04


def test_its_own_sensors_replace_those_of_the_plant(robot: RobotDescription) -> None:
    plant = load_plant("reference")
    fitted = with_sensors_of(plant, robot).sensors
    assert (fitted.gyro_axes, fitted.encoder_bits) == (3, 10)
    assert with_sensors_of(plant, load_robot()) == plant
    assert with_sensors_of(load_plant("ideal"), robot).sensors.encoder_bits == 0, "exact"
