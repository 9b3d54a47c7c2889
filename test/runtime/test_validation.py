"""Checks of what comes in from outside: velocity commands, joints, IMU, stamps. No ROS needed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot import load_robot
from nao_lipm_gait.runtime.validation import (
    JointReader,
    check_orientation,
    read_vector,
    read_velocity,
    stamp_of,
)
from nao_lipm_gait.types import VelocityCommand

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
POSE = ROBOT.stand_pose.tolist()
ZEROS = [0.0] * len(NAMES)
BAD_NUMBERS = (math.nan, math.inf, -math.inf)


def reader() -> JointReader:
    return JointReader(ROBOT, "joint_states")


def test_planar_part_of_a_twist_is_taken():
    assert read_velocity((0.1, 0.2, 9.0), (1.0, 2.0, 0.3)) == VelocityCommand(0.1, 0.2, 0.3)


@pytest.mark.parametrize("bad", [*BAD_NUMBERS, 1e6, -1e6])
@pytest.mark.parametrize("place", range(6))
def test_bad_twist_is_refused_by_field(bad: float, place: int):
    values = [0.0] * 6
    values[place] = bad
    field = ("linear", "angular")[place // 3] + "." + "xyz"[place % 3]
    with pytest.raises(NaoGaitError, match=rf"cmd_vel {field}: got .*; allowed: a finite number"):
        read_velocity(values[:3], values[3:])


def test_joints_in_order_come_out_as_they_are():
    position, velocity = reader().read(NAMES, POSE, ZEROS)
    np.testing.assert_array_equal(position, POSE)
    np.testing.assert_array_equal(velocity, ZEROS)


@given(st.permutations(range(len(NAMES) + 2)))
def test_order_and_extra_joints_do_not_matter(order: list[int]):
    names = [*NAMES, "LHand", "RHand"]
    position = [*POSE, math.nan, 1e9]
    velocity = [*(0.1 * i for i in range(len(NAMES))), 0.0, 0.0]
    read = reader().read(
        [names[i] for i in order], [position[i] for i in order], [velocity[i] for i in order]
    )
    np.testing.assert_array_equal(read[0], POSE)
    assert read[1] is not None
    np.testing.assert_array_equal(read[1], velocity[:-2])


def test_a_changed_order_is_noticed():
    joints = reader()
    joints.read(NAMES, POSE, ZEROS)
    position, _ = joints.read(NAMES[::-1], POSE[::-1], ZEROS)
    np.testing.assert_array_equal(position, POSE)


def test_missing_joints_are_named():
    with pytest.raises(NaoGaitError, match="joint_states name: got 'no HeadYaw, HeadPitch'"):
        reader().read(NAMES[2:], POSE[2:], ZEROS[2:])


def test_joint_given_twice_is_named():
    with pytest.raises(NaoGaitError, match="LHipRoll more than once"):
        reader().read([*NAMES, "LHipRoll"], [*POSE, 0.0], [*ZEROS, 0.0])


def test_wrong_lengths_are_refused():
    with pytest.raises(NaoGaitError, match=r"joint_states position: got '21 values'"):
        reader().read(NAMES, POSE[:-1], ZEROS)
    with pytest.raises(NaoGaitError, match=r"joint_states velocity: got '21 values'"):
        reader().read(NAMES, POSE, ZEROS[:-1])
    with pytest.raises(NaoGaitError, match=r"joint_states name: got 'no "):
        reader().read([], [], [])


def test_no_velocity_at_all_is_allowed():
    assert reader().read(NAMES, POSE, [])[1] is None


@pytest.mark.parametrize("bad", [*BAD_NUMBERS, 7.0, -1e300])
@pytest.mark.parametrize("joint", ["HeadYaw", "LKneePitch", NAMES[-1]])
def test_bad_position_is_refused_by_joint(bad: float, joint: str):
    position = list(POSE)
    position[NAMES.index(joint)] = bad
    with pytest.raises(NaoGaitError, match=rf"joint_states position\[{joint}\]: got .*; allowed: "):
        reader().read(NAMES, position, ZEROS)


@pytest.mark.parametrize("bad", [*BAD_NUMBERS, 1e4])
def test_bad_velocity_is_refused_by_joint(bad: float):
    velocity = list(ZEROS)
    velocity[NAMES.index("RHipPitch")] = bad
    with pytest.raises(NaoGaitError, match=r"joint_states velocity\[RHipPitch\]: got"):
        reader().read(NAMES, POSE, velocity)


@pytest.mark.parametrize("bad", [*BAD_NUMBERS, 1e9])
def test_bad_vector_is_refused_by_axis(bad: float):
    with pytest.raises(NaoGaitError, match=r"imu/data angular_velocity\.y: got"):
        read_vector((0.0, bad, 0.0), "imu/data angular_velocity", 200.0, "rad/s")


@pytest.mark.parametrize("quaternion", [(0.0,) * 4, (math.nan, 0, 0, 1), (0, 0, 0, 3.0)])
def test_claimed_orientation_must_be_one(quaternion: tuple[float, ...]):
    with pytest.raises(NaoGaitError, match="imu/data orientation: got .*covariance.0. = -1"):
        check_orientation(quaternion, 0.0, "imu/data")
    check_orientation(quaternion, -1.0, "imu/data")  # none claimed, none checked


def test_unit_quaternion_passes():
    check_orientation((0.0, 0.6, 0.0, 0.8), 0.01, "imu/data")


def test_stamp_is_whole_nanoseconds():
    assert stamp_of(2, 30_000_001, "x") == 2_030_000_001
    with pytest.raises(NaoGaitError, match="x.nanosec"):
        stamp_of(0, 1_000_000_000, "x")
    with pytest.raises(NaoGaitError, match="x.sec"):
        stamp_of(-1, 0, "x")
