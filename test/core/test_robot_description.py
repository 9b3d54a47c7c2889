"""One robot from two files: the shipped NAO."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest

from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.robot import RobotDescription, load_robot

ARM = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
LEG = ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ORDER = (
    "HeadYaw",
    "HeadPitch",
    *(f"L{joint}" for joint in (*ARM, *LEG)),
    *(f"R{joint}" for joint in (*LEG, *ARM)),
)


def test_order_of_the_joints(robot: RobotDescription) -> None:
    assert robot.joint_names == ORDER
    assert [robot.index(joint) for joint in ORDER] == list(range(22))
    with pytest.raises(NaoGaitError, match=r"joint: got 'LWristYaw'; .*RElbowRoll"):
        robot.index("LWristYaw")


def test_roles(robot: RobotDescription) -> None:
    assert robot.left_leg.names == tuple(f"L{joint}" for joint in LEG)
    assert robot.right_leg.names == tuple(f"R{joint}" for joint in LEG)
    assert robot.right_leg.ankle_pitch == "RAnklePitch"
    assert robot.coupled_joints == (("LHipYawPitch", "RHipYawPitch"),)
    assert robot.shoulder_pitch == ("LShoulderPitch", "RShoulderPitch")
    assert robot.base_frame == "base_link"
    assert robot.torso_frame == "torso"
    assert robot.imu_frame == "imu_link"
    assert robot.sole_frames == ("l_sole", "r_sole")


def test_limits_are_those_of_the_urdf(robot: RobotDescription) -> None:
    for element in ET.fromstring(robot.urdf).iter("joint"):
        joint = element.attrib["name"]
        if joint not in robot.limits:
            continue
        limit, index = element.find("limit"), robot.index(joint)
        assert limit is not None
        assert robot.limits[joint].lower == robot.lower[index] == float(limit.attrib["lower"])
        assert robot.limits[joint].upper == robot.upper[index] == float(limit.attrib["upper"])
        velocity = float(limit.attrib["velocity"])
        assert robot.limits[joint].velocity == robot.velocity_limit[index] == velocity
        assert robot.limits[joint].effort == float(limit.attrib["effort"])
    assert len(robot.limits) == 22


def test_every_joint_has_a_motor_as_fast_as_its_limit(robot: RobotDescription) -> None:
    assert set(robot.motors) == set(ORDER)
    for joint, motor in robot.motors.items():
        assert motor.no_load_speed == pytest.approx(robot.limits[joint].velocity, rel=0.01)
        # the models' effort is what a motor can hold for a while, less than its stall torque
        assert robot.limits[joint].effort < motor.stall_torque < 5.0 * robot.limits[joint].effort


def test_arrays_are_read_only(robot: RobotDescription) -> None:
    for array in (robot.stand_pose, robot.lower, robot.upper, robot.velocity_limit):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize(
    ("urdf", "height"), [("nao_h21_v33", 0.262), ("nao_h21_v40", None)], ids=["v33", "v40"]
)
def test_stand_pose(urdf: str, height: float | None) -> None:
    """Soles flat on one plane under an upright torso, and the CoM where the paper has it."""
    robot = load_robot(urdf)
    assert (robot.lower <= robot.stand_pose).all()
    assert (robot.stand_pose <= robot.upper).all()
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    for joint, angle in zip(robot.joint_names, robot.stand_pose, strict=True):
        q[model.joints[model.getJointId(joint)].idx_q] = angle
    com = pin.centerOfMass(model, data, q)
    pin.framesForwardKinematics(model, data, q)
    left, right = (data.oMf[model.getFrameId(sole)] for sole in robot.sole_frames)
    for sole in (left, right):
        assert sole.rotation == pytest.approx(np.eye(3), abs=1e-4)
    assert left.translation == pytest.approx(right.translation * [1.0, -1.0, 1.0], abs=1e-5)
    assert left.translation[1] == pytest.approx(0.05, abs=1e-3)
    above = com - (left.translation + right.translation) / 2.0
    assert abs(above[1]) < 1e-3
    if height is not None:
        assert above[2] == pytest.approx(height, abs=1e-3)
        assert above[0] == pytest.approx(0.010, abs=1e-3)
    elbows = [data.oMf[model.getFrameId(f"{side}ForeArm")].translation[2] for side in "LR"]
    assert max(elbows) < 0.01, "arms hang down"


def test_sole(robot: RobotDescription) -> None:
    xs, ys = np.array(robot.sole_outline).T
    area = 0.5 * float(np.sum(xs * np.roll(ys, -1) - np.roll(xs, -1) * ys))
    assert 0.010 < area < 0.013, "counter-clockwise, and a foot of 15 cm by 9 cm"
    inner_front, outer_front, outer_rear, inner_rear = robot.sole_corners
    assert inner_front[0] > 0.08 < outer_front[0]
    assert inner_rear[0] < -0.03 > outer_rear[0]
    assert inner_front[1] < -0.03 > inner_rear[1]
    assert outer_front[1] > 0.03 < outer_rear[1]
    corners = np.array(robot.sole_corners).T
    inside = 0.5 * abs(
        float(np.sum(corners[0] * np.roll(corners[1], -1) - np.roll(corners[0], -1) * corners[1]))
    )
    assert inside > 0.75 * area


def test_ankle_limits(robot: RobotDescription) -> None:
    left, right = robot.ankle_limits["left"], robot.ankle_limits["right"]
    assert [row[0] for row in left] == sorted(row[0] for row in left)
    for (pitch, low, high), mirrored in zip(left, right, strict=True):
        assert mirrored == (pitch, -high, -low)
    assert left[-1] == (0.922755, 0.0, 0.049916), "a foot bent up can hardly roll"


def test_the_text_is_the_file(robot: RobotDescription) -> None:
    assert robot.urdf_path == find("urdf", "nao_h21_v33")
    assert robot.urdf == robot.urdf_path.read_text()
