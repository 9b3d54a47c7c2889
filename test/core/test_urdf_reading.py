"""What of a URDF is refused, with the place and the remedy, and what is taken as it comes."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from robot_core.errors import NaoGaitError
from robot_core.resources import share
from robot_core.robot import RobotDescription, load_robot
from urdf_edits import (
    Xml,
    edited_urdf,
    joint,
    rehung,
    with_limit,
    without_joint,
    without_limit,
    without_link,
)


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
        (without_link("r_sole"), ("child: got 'r_sole'",)),
        (without_link("torso"), ("got 'torso'", "a link of this URDF")),
        (rehung("RKneePitch", "LThigh"), ("joints from torso to r_sole", "LHipYawPitch")),
        (rehung("LKneePitch", "LTibia"), ("part of a loop",)),
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
    with pytest.raises(NaoGaitError, match=r"robot: got 'nao_h25'.*nao_h21_v33"):
        load_robot("nao_h25")
    with pytest.raises(NaoGaitError, match=r"robot file: got 'none\.xml'.*MJCF"):
        load_robot("none.xml")
    with pytest.raises(NaoGaitError, match=r"robot: got 'nao_h25'.*nao_h21"):
        load_robot(robot="nao_h25")


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


def test_a_urdf_with_hints_for_mujoco_is_no_mjcf(tmp_path: Path) -> None:
    text = share("urdf", "op3.urdf").read_text(encoding="utf-8")
    hints = '<mujoco><compiler meshdir="meshes"/></mujoco>'
    path = tmp_path / "hinted.urdf"
    path.write_text(text.replace("<link", hints + "<link", 1), encoding="utf-8")
    assert load_robot(path).joint_names == load_robot("op3").joint_names


def test_a_urdf_that_begins_with_many_comments_is_read_at_once(tmp_path: Path) -> None:
    """As xacro writes them; a search that tries each split of the comments would never end."""
    path = tmp_path / "commented.urdf"
    text = (share() / "urdf/nao_h21_v33.urdf").read_text()
    _, _, body = text.rpartition("?>")
    path.write_text("<?xml version='1.0'?>\n" + 200 * "<!-- === | by xacro | === -->\n" + body)
    assert load_robot(path).name == "nao_h21"
