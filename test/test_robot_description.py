"""One robot from two files: the shipped NAO, and what is refused, with the place and the remedy."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.resources import find
from nao_lipm_gait.robot_description import RobotDescription, load_robot

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
    assert robot.hip == "shared_yaw_pitch"
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
    assert (robot.lower <= robot.stand_pose).all() and (robot.stand_pose <= robot.upper).all()
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
    assert inner_front[0] > 0.08 < outer_front[0] and inner_rear[0] < -0.03 > outer_rear[0]
    assert inner_front[1] < -0.03 > inner_rear[1] and outer_front[1] > 0.03 < outer_rear[1]
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


# What is refused.

Xml = Callable[[ET.Element], None]


def joint(root: ET.Element, name: str) -> ET.Element:
    element = root.find(f"joint[@name='{name}']")
    assert element is not None
    return element


def edited_urdf(folder: Path, edit: Xml, name: str = "edited.urdf") -> Path:
    root = ET.fromstring(find("urdf", "nao_h21_v33").read_text())
    edit(root)
    path = folder / name
    path.write_text(ET.tostring(root, encoding="unicode"))
    return path


def without_joint(name: str) -> Xml:
    return lambda root: root.remove(joint(root, name))


def without_link(name: str) -> Xml:
    def edit(root: ET.Element) -> None:
        for link in root.findall(f"link[@name='{name}']"):
            root.remove(link)

    return edit


def with_limit(name: str, **values: str | None) -> Xml:
    def edit(root: ET.Element) -> None:
        limit = joint(root, name).find("limit")
        assert limit is not None
        for key, value in values.items():
            if value is None:
                del limit.attrib[key]
            else:
                limit.set(key, value)

    return edit


def without_limit(name: str) -> Xml:
    def edit(root: ET.Element) -> None:
        element = joint(root, name)
        limit = element.find("limit")
        assert limit is not None
        element.remove(limit)

    return edit


def rehung(name: str, parent: str) -> Xml:
    def edit(root: ET.Element) -> None:
        element = joint(root, name).find("parent")
        assert element is not None
        element.set("link", parent)

    return edit


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (without_joint("RKneePitch"), ("joint RKneePitch", "missing")),
        (without_joint("HeadYaw"), ("joint HeadYaw", "missing")),
        (lambda root: joint(root, "LHipRoll").set("name", "l_hip_roll"), ("joint LHipRoll",)),
        (lambda root: joint(root, "LHipRoll").set("type", "fixed"), ("joint LHipRoll", "fixed")),
        (lambda root: joint(root, "LHipRoll").set("name", "HeadYaw"), ("HeadYaw", "twice")),
        (without_limit("LElbowYaw"), ("joint LElbowYaw", "no <limit>")),
        (with_limit("LElbowYaw", velocity=None), ("joint LElbowYaw", "velocity")),
        (with_limit("LElbowYaw", effort="-1"), ("joint LElbowYaw", "'effort': '-1'")),
        (with_limit("LElbowYaw", upper="nan"), ("joint LElbowYaw", "finite")),
        (with_limit("LElbowYaw", upper="inf"), ("joint LElbowYaw", "finite")),
        (with_limit("LElbowYaw", upper="-3"), ("joint LElbowYaw", "lower < upper")),
        (with_limit("LElbowYaw", lower="wide"), ("joint LElbowYaw", "'lower': 'wide'")),
        (with_limit("LKneePitch", upper="0.3"), ("stand_pose of LKneePitch", "0.3 rad")),
        (without_link("r_sole"), ("link r_sole", "missing")),
        (without_link("torso"), ("link torso", "missing")),
        (rehung("RKneePitch", "LThigh"), ("joints from torso to r_sole", "LHipYawPitch")),
        (rehung("LKneePitch", "LTibia"), ("joints from torso to l_sole",)),  # in a circle
        (lambda root: setattr(root, "tag", "robots"), ("<robots>",)),
    ],
)
def test_urdf_refused(tmp_path: Path, edit: Xml, said: tuple[str, ...]) -> None:
    path = edited_urdf(tmp_path, edit)
    with pytest.raises(NaoGaitError) as refused:
        load_robot(path)
    for words in (*said, str(path), "; allowed: "):
        assert words in str(refused.value)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"<robot name='x'><link", "well-formed XML"),
        (b"", "well-formed XML"),
        (b"\xff\xfe\x00bad", "UTF-8"),
        (b"<!DOCTYPE robot [<!ENTITY a 'aaaa'>]><robot name='&a;'/>", "document type"),
    ],
)
def test_what_is_no_urdf_is_refused(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "broken.urdf"
    path.write_bytes(content)
    with pytest.raises(NaoGaitError, match=said) as refused:
        load_robot(path)
    assert str(path) in str(refused.value)


def test_missing_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NaoGaitError, match=r"none\.urdf.*nao_h21_v33"):
        load_robot(tmp_path / "none.urdf")
    with pytest.raises(NaoGaitError, match=r"urdf: got 'nao_h25'.*nao_h21_v33"):
        load_robot("nao_h25")
    with pytest.raises(NaoGaitError, match=r"robots: got 'nao_h25'.*nao_h21"):
        load_robot(robot="nao_h25")


Settings = dict[str, Any]


def put(*keys: str | int, value: object) -> Callable[[Settings], None]:
    """Sets a value of the robot file, by its keys."""

    def edit(settings: Any) -> None:
        for key in keys[:-1]:
            settings = settings[key]
        settings[keys[-1]] = value

    return edit


def drop(*keys: str | int) -> Callable[[Settings], None]:
    def edit(settings: Any) -> None:
        for key in keys[:-1]:
            settings = settings[key]
        del settings[keys[-1]]

    return edit


@pytest.fixture(scope="module")
def settings() -> Settings:
    return dict(yaml.safe_load(find("robots", "nao_h21").read_text()))


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (put("colour", value="red"), "unknown key colour"),
        (drop("motors"), "no motors"),
        (put("name", value=7), "name in "),
        (put("hip", value="ball"), "shared_yaw_pitch, yaw"),
        (put("joints", value="HeadYaw"), "joints in "),
        (put("joints", 3, value="HeadYaw"), "each joint once"),
        (put("joints", 3, value=None), "a list of joint names"),
        (put("left_leg", "knee_pitch", value="LKnee"), "left_leg: knee_pitch"),
        (put("left_leg", "toe", value="LToe"), "unknown key toe"),
        (drop("right_leg", "hip_roll"), "no hip_roll"),
        (put("right_leg", value="legs"), "right_leg in "),
        (put("coupled_joints", value=[["LHipYawPitch"]]), "leader, follower"),
        (put("coupled_joints", value=[["HeadYaw", "HeadYaw"]]), "leader, follower"),
        (put("coupled_joints", value=[["HeadYaw", "Tail"]]), "got 'Tail'"),
        (put("shoulder_pitch", value=["LShoulderPitch"]), "shoulder_pitch in "),
        (put("shoulder_pitch", value=["LShoulderPitch", "Wing"]), "'Wing'"),
        (put("frames", "left_sole", value="l_sole"), "frames: left_sole"),
        (put("frames", "left_sole", value=["l_foot", "l_toe"]), "link l_foot or l_toe"),
        (put("frames", "tail", value=["tail"]), "unknown key tail"),
        (put("stand_pose", "LWristYaw", value=0.1), "got 'LWristYaw'"),
        (put("stand_pose", "LHipRoll", value="straight"), "stand_pose: LHipRoll"),
        (put("stand_pose", "LHipRoll", value=True), "stand_pose: LHipRoll"),
        (put("stand_pose", "LHipRoll", value=float("nan")), "stand_pose: LHipRoll"),
        (put("stand_pose", "LHipRoll", value=1.5), "stand_pose of LHipRoll"),
        (put("sole_outline", value=[[0, 0], [1, 0]]), "at least 3 points"),
        (put("sole_outline", 1, value=[0.0, 0.0, 0.0]), "2 numbers"),
        (put("sole_outline", 1, value=[-0.01, 0.0]), "counter-clockwise"),
        (put("sole_corners", 0, value=[0.2, 0.0]), "four points of sole_outline"),
        (drop("sole_corners", 0), "four points of sole_outline"),
        (put("ankle_limits", value=[]), "at least one row"),
        (put("ankle_limits", 1, value=[-2.0, -0.1, 0.1]), "rising pitch"),
        (put("ankle_limits", 1, value=[-0.9, 0.1, -0.1]), "lowest roll"),
        (put("motors", 0, "stall_torque", value=0.0), "motors: stall_torque"),
        (put("motors", 0, "stall_torque", value="strong"), "motors: stall_torque"),
        (put("motors", 0, "gear", value=1.0), "unknown key gear"),
        (drop("motors", 1), "none for HeadPitch"),
        (put("motors", 1, "joints", value="HeadPitch"), "motors: joints"),
        (put("motors", 1, "joints", 0, value="HeadYaw"), "each joint once"),
        (put("motors", 1, "joints", 0, value="Tail"), "got 'Tail'"),
    ],
)
def test_robot_file_refused(
    tmp_path: Path, settings: Settings, edit: Callable[[Settings], None], said: str
) -> None:
    changed = copy.deepcopy(settings)
    edit(changed)
    path = tmp_path / "changed.yaml"
    path.write_text(yaml.safe_dump(changed))
    with pytest.raises(NaoGaitError) as refused:
        load_robot(robot=path)
    assert said in str(refused.value)
    if "stand_pose of" in said or "link " in said:  # these belong to the URDF as well
        assert "nao_h21_v33.urdf" in str(refused.value)
    else:
        assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name: [unclosed", "readable YAML"),
        ("", "mapping"),
        ("- 1", "mapping"),
        ("!!python/object/apply:os.getcwd []", "readable YAML"),
    ],
)
def test_what_is_no_robot_file_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(NaoGaitError, match=said) as refused:
        load_robot(robot=path)
    assert str(path) in str(refused.value)


# What is taken as it comes.

HAND = """
<robot name="x">
  <link name="LHand"><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="LWristYaw" type="revolute"><parent link="LForeArm"/><child link="LHand"/>
    <origin xyz="0.05 0 0"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="0" effort="0"/></joint>
  <link name="LFinger"/>
  <joint name="LFinger" type="prismatic"><parent link="LHand"/><child link="LFinger"/></joint>
</robot>
"""


def test_extra_joints_are_left_alone(tmp_path: Path, robot: RobotDescription) -> None:
    path = edited_urdf(tmp_path, lambda root: root.extend(ET.fromstring(HAND)))
    with_hand = load_robot(path)
    assert with_hand.joint_names == robot.joint_names
    assert with_hand.limits == robot.limits
    assert np.array_equal(with_hand.stand_pose, robot.stand_pose)
    assert "LWristYaw" in with_hand.urdf


def test_a_robot_without_base_link_or_imu_link_has_the_torso(tmp_path: Path) -> None:
    """As the public NAO models have it."""

    def edit(root: ET.Element) -> None:
        for name in ("torso", "imu_link"):
            without_link(name)(root)
            without_joint(f"{name}_fixed")(root)
        base = root.find("link[@name='base_link']")
        assert base is not None
        base.set("name", "torso")

    robot = load_robot(edited_urdf(tmp_path, edit))
    assert robot.base_frame == robot.torso_frame == robot.imu_frame == "torso"


def test_a_stand_pose_a_little_outside_is_cut(tmp_path: Path, robot: RobotDescription) -> None:
    """Published models differ in the last digits of their limits."""
    path = edited_urdf(tmp_path, with_limit("LKneePitch", upper="0.68"))
    index = robot.index("LKneePitch")
    assert robot.stand_pose[index] > 0.68
    assert load_robot(path).stand_pose[index] == 0.68
