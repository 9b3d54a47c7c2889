"""The joints of LoLA and those of the gait."""

import numpy as np
import pytest

from lola_bridge.codec import JOINTS
from lola_bridge.joints import JointMap, sitting_pose
from robot_core.errors import NaoGaitError
from robot_core.robot import load_robot

ROBOT = load_robot("nao_v6")
MAP = JointMap(ROBOT)


def test_both_hips_read_one_motor_and_the_leader_commands_it():
    values = [float(index) for index in range(25)]
    gait = dict(zip(ROBOT.joint_names, MAP.to_gait(values), strict=True))
    assert gait["LHipYawPitch"] == gait["RHipYawPitch"] == JOINTS.index("LHipYawPitch")
    for joint in set(ROBOT.joint_names) - {"RHipYawPitch"}:
        assert gait[joint] == JOINTS.index(joint)
    back = MAP.from_gait(MAP.to_gait(values), rest=-1.0)
    unused = {"LWristYaw", "RWristYaw", "LHand", "RHand"}
    assert back == [-1.0 if joint in unused else value
                    for joint, value in zip(JOINTS, values, strict=True)]  # fmt: skip


def test_every_joint_is_measured_once():
    assert set(ROBOT.joint_names) <= set(MAP.names)
    assert len(MAP.names) == len(set(MAP.names)) == 26
    assert MAP.measured([7.0] * 25) == [7.0] * 26


def test_limits_are_those_of_the_robot():
    lower, upper, speed = MAP.limits()
    for joint in set(ROBOT.joint_names) - {"RHipYawPitch"}:
        limit, index = ROBOT.limits[joint], JOINTS.index(joint)
        assert (lower[index], upper[index], speed[index]) == (
            limit.lower, limit.upper, limit.velocity,
        )  # fmt: skip


def test_the_sitting_pose_is_inside_the_limits_and_sits():
    pose = sitting_pose(ROBOT)
    assert (pose >= ROBOT.lower).all()
    assert (pose <= ROBOT.upper).all()
    assert pose[ROBOT.index("LKneePitch")] > 1.5
    assert np.isfinite(pose).all()


def test_a_robot_that_is_no_nao_is_refused():
    with pytest.raises(NaoGaitError, match="robot bruno"):
        JointMap(load_robot("bruno"))
