"""Sensor validation: what is refused, what is replaced, and by what."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nao_lipm_gait.runtime.diagnostics import SENSORS, Diagnostics
from nao_lipm_gait.runtime.inputs import ImuInput, JointInput
from nao_lipm_gait.runtime.validation import (
    IMU_REPEATS,
    SPIKE_SAMPLES,
    JointReader,
    SensorValidation,
)
from robot_core.errors import NaoGaitError
from robot_core.message_checks import stamp_of
from robot_core.robot import load_robot
from robot_core.types import FloatArray, JointTargets

ROBOT = load_robot()
NAMES = list(ROBOT.joint_names)
POSE = ROBOT.stand_pose.tolist()
ZEROS = [0.0] * len(NAMES)
KNEE = ROBOT.index("LKneePitch")
BAD_NUMBERS = (math.nan, math.inf, -math.inf)
MS = 1_000_000
REST = (0.0, 0.0, 9.81)


def read(names: Sequence[str], position: Sequence[float]) -> FloatArray:
    return JointReader(ROBOT).read(JointInput(0, 0, names, position))


class Sensors:
    """Feeds a validation with samples every 10 ms."""

    def __init__(self) -> None:
        self.diagnostics = Diagnostics(lambda: 0.0)
        self.validation = SensorValidation(ROBOT, 0.01, self.diagnostics)
        self.stamp = 0

    def joints(
        self,
        position: FloatArray | list[float],
        walking: bool = False,
        ms: int = 10,
        commanded: FloatArray | None = None,
    ) -> FloatArray:
        """The validated position, `ms` after the last; commanded: targets for this frame."""
        self.stamp += ms * MS
        message = JointInput(0, 0, NAMES, list(position))
        if self.stamp == ms * MS:
            sample = self.validation.read_joints(message, self.stamp)
            self.validation.restart(sample, steady=True)
        else:
            sample = self.validation.next_joints(
                message, self.stamp, delay=10 * MS, walking=walking
            )
        if commanded is not None:
            self.validation.sent(JointTargets(self.stamp, commanded))
        return sample.position

    def imu(
        self, rate: tuple[float, float, float], force: tuple[float, float, float] = REST
    ) -> FloatArray:
        message = ImuInput(*divmod(self.stamp, 10**9), rate, force)
        return self.validation.imu(message).angular_velocity

    def said(self) -> list[str]:
        return [remark.text for remark in self.diagnostics.take_remarks()[SENSORS]]


# -- fields ----------------------------------------------------------------------------------------


def test_joints_in_order_come_out_as_they_are():
    np.testing.assert_array_equal(read(NAMES, POSE), POSE)


@given(st.permutations(range(len(NAMES) + 2)))
def test_order_and_extra_joints_do_not_matter(order: list[int]):
    names = [*NAMES, "LHand", "RHand"]
    position = [*POSE, math.nan, 1e9]
    found = read([names[i] for i in order], [position[i] for i in order])
    np.testing.assert_array_equal(found, POSE)


def test_a_changed_order_is_noticed():
    joints = JointReader(ROBOT)
    joints.read(JointInput(0, 0, NAMES, POSE))
    position = joints.read(JointInput(0, 0, NAMES[::-1], POSE[::-1]))
    np.testing.assert_array_equal(position, POSE)


def test_missing_joints_are_named():
    with pytest.raises(NaoGaitError, match="joint_states name: got 'no HeadYaw, HeadPitch'"):
        read(NAMES[2:], POSE[2:])


def test_only_the_first_of_many_missing_joints_are_named():
    with pytest.raises(NaoGaitError, match=r"'no HeadYaw, .* and 17 more'; allowed: all 22 joints"):
        read([], [])


def test_joint_given_twice_is_named():
    with pytest.raises(NaoGaitError, match="LHipRoll more than once"):
        read([*NAMES, "LHipRoll"], [*POSE, 0.0])


def test_wrong_lengths_are_refused():
    with pytest.raises(NaoGaitError, match=r"joint_states position: got '21 values'"):
        read(NAMES, POSE[:-1])


@pytest.mark.parametrize("bad", [*BAD_NUMBERS, 7.0, -1e300])
@pytest.mark.parametrize("joint", ["HeadYaw", "LKneePitch", NAMES[-1]])
def test_bad_position_is_refused_by_joint(bad: float, joint: str):
    position = list(POSE)
    position[NAMES.index(joint)] = bad
    with pytest.raises(NaoGaitError, match=rf"joint_states position\[{joint}\]: got .*; allowed: "):
        read(NAMES, position)


@pytest.mark.parametrize("bad", [math.nan, 0.8])
@pytest.mark.parametrize("count", [1, 3])
def test_after_bad_values_an_arm_away_from_its_target_is_measured_again(bad: float, count: int):
    """Held 0.5 rad from where it is commanded, for NaN (refused) and a spike (replaced)."""
    sensors, arm = Sensors(), NAMES.index("LShoulderPitch")
    measured = np.array(POSE)
    commanded, broken = measured.copy(), measured.copy()
    commanded[arm] += 0.5
    broken[arm] = bad
    for tick in range(40):
        wrong = 20 <= tick < 20 + count
        position = sensors.joints(broken if wrong else measured, commanded=commanded)
        assert position[arm] == pytest.approx((commanded if wrong else measured)[arm])
    assert sensors.validation.unread_since is None


@pytest.mark.parametrize("bad", [*BAD_NUMBERS, 1e9])
@pytest.mark.parametrize("field", ["angular_velocity", "linear_acceleration"])
def test_bad_imu_vector_is_refused_by_axis(bad: float, field: str):
    vectors = {"angular_velocity": (0.0, 0.0, 0.0), "linear_acceleration": REST}
    vectors[field] = (0.0, bad, 0.0)
    message = ImuInput(1, 0, vectors["angular_velocity"], vectors["linear_acceleration"])
    with pytest.raises(NaoGaitError, match=rf"imu/data {field}\.y: got"):
        Sensors().validation.imu(message)


def test_an_imu_without_a_field_that_the_gait_needs_is_refused():
    message = ImuInput(1, 0, (0.0, 0.0, 0.0), REST, angular_velocity_covariance=-1.0)
    with pytest.raises(NaoGaitError, match=r"angular_velocity_covariance\[0\]: got -1.0"):
        Sensors().validation.imu(message)


@pytest.mark.parametrize(
    "quaternion", [(0.0,) * 4, (math.nan, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 3.0)]
)
def test_a_claimed_orientation_that_is_none_is_reported_and_not_refused(
    quaternion: tuple[float, float, float, float],
):
    sensors = Sensors()
    sensors.validation.imu(ImuInput(1, 0, (0.0, 0.0, 0.0), REST, quaternion, 0.01))
    (text,) = sensors.said()
    assert text.startswith("imu/data orientation: got ")
    assert "covariance[0] = -1" in text
    sensors.validation.imu(ImuInput(1, 0, (0.0, 0.0, 0.0), REST, quaternion, -1.0))
    assert sensors.said() == []


def test_stamp_is_whole_nanoseconds():
    assert stamp_of(2, 30_000_001, "x") == 2_030_000_001
    with pytest.raises(NaoGaitError, match=r"x\.nanosec"):
        stamp_of(0, 1_000_000_000, "x")
    with pytest.raises(NaoGaitError, match=r"x\.sec"):
        stamp_of(-1, 0, "x")


# -- spikes ----------------------------------------------------------------------------------------


def test_a_spike_is_held_and_a_new_position_is_accepted_in_the_end():
    sensors = Sensors()
    off = ROBOT.stand_pose.copy()
    off[KNEE] += 0.5
    measured = (POSE, off, POSE, off, off, off, off, off)
    used = [sensors.joints(q)[KNEE] - POSE[KNEE] for q in measured]
    assert [float(each) for each in used] == [0, 0, 0, 0, 0, 0, 0.5, 0.5]
    said = sensors.said()
    assert len(said) == 1 + SPIKE_SAMPLES
    assert all("joint_states position[LKneePitch]" in text for text in said)


def test_what_a_joint_can_do_is_no_spike():
    sensors = Sensors()
    q = ROBOT.stand_pose.copy()
    for _ in range(20):
        np.testing.assert_array_equal(sensors.joints(q), q)
        q = np.clip(q + 2.0 * 0.01 * np.asarray(ROBOT.velocity_limit), ROBOT.lower, ROBOT.upper)
    farther = q - 0.4
    np.testing.assert_array_equal(sensors.joints(farther, ms=50), farther), "after lost frames"
    assert sensors.said() == []


def test_a_spike_of_the_gyro_is_held():
    sensors = Sensors()
    for rate in ((0.0, 0.0, 0.0), (1.0, -1.0, 0.0)):
        np.testing.assert_array_equal(sensors.imu(rate), rate)
    np.testing.assert_array_equal(sensors.imu((3.0, -1.0, 0.0)), (1.0, -1.0, 0.0))
    np.testing.assert_array_equal(sensors.imu((1.2, -1.2, 0.0)), (1.2, -1.2, 0.0))
    assert any("angular_velocity.x: got 3" in text for text in sensors.said())


def test_a_foot_that_lands_in_a_turn_is_no_spike_of_the_gyro():
    sensors = Sensors()
    for rate in ((0.0, 0.0, 1.8), (0.0, 0.0, 3.6), (0.0, 0.0, 1.8)):
        np.testing.assert_array_equal(sensors.imu(rate), rate)
    assert sensors.said() == []


def test_a_jump_of_the_gyro_that_the_next_sample_confirms_is_real():
    sensors = Sensors()
    jump = (0.0, 3.0, 0.0)
    used = [sensors.imu(rate)[1] for rate in ((0.0, 0.0, 0.0), jump, jump, jump)]
    assert used == [0.0, 0.0, 3.0, 3.0]
    assert sensors.said() == []


def later(sensors: Sensors, rate: float, force: float = 9.81) -> str:
    """What is said against a sample that comes 10 ms later; empty if it is used."""
    sensors.stamp += 10 * MS
    try:
        used = sensors.imu((rate, 0.0, 0.0), (0.0, 0.0, force))
    except NaoGaitError as error:
        return str(error)
    assert used[0] in (rate, 0.1)
    return ""


@pytest.mark.parametrize("fast", [12.0, 5.0])
def test_a_gyro_that_no_robot_moves_like_is_not_used_until_it_has_been_slow(fast):
    sensors = Sensors()
    assert later(sensors, 0.1) == ""
    spike = [later(sensors, fast) for _ in range(SPIKE_SAMPLES)]
    assert not any(spike), "so many may be a spike"
    said = [later(sensors, rate) for rate in (fast, *[0.2] * 40)]
    assert all("deg/s instead of rad/s" in each for each in said[:30])
    assert not any(said[31:])


@pytest.mark.parametrize(("unit", "guess"), [(9.81, "g instead"), (0.1, "unit or scale")])
def test_an_accelerometer_that_changes_its_unit_is_not_used(unit, guess):
    sensors = Sensors()
    assert not any(later(sensors, 0.0) for _ in range(120))
    assert guess in [later(sensors, 0.0, 9.81 / unit) for _ in range(100)][-1]
    assert later(sensors, 0.0)
    assert not [later(sensors, 0.0) for _ in range(200)][-1]


def test_free_fall_and_impact_are_no_wrong_unit():
    sensors = Sensors()
    forces = (*[9.81] * 120, *[0.0] * 40, *[60.0] * 6, *[9.81] * 30)
    assert not any(later(sensors, 0.0, size) for size in forces)


def test_the_accelerometer_of_a_spike_of_the_gyro_is_not_used():
    sensors = Sensors()
    sensors.imu((0.0, 0.0, 0.0))
    sample = sensors.validation.imu(
        ImuInput(*divmod(sensors.stamp, 10**9), (0.0, 2.0, 0.0), (40.0, 0.0, 50.0))
    )
    assert sample.linear_acceleration.tolist() == [0.0, 0.0, 9.81]


def test_the_gyro_before_a_pause_says_nothing_about_the_one_after_it():
    sensors = Sensors()
    for force in (REST, (0.0, 0.0, -9.81)):
        sensors.imu((0.0, 8.0, 0.0), force)
    sensors.stamp += 600 * MS
    sample = sensors.validation.imu(
        ImuInput(*divmod(sensors.stamp, 10**9), (0.0, 0.0, 0.0), REST)
    )
    assert sample.angular_velocity.tolist() == [0.0, 0.0, 0.0]
    assert sample.linear_acceleration.tolist() == list(REST)
    assert not sensors.said()


# -- joints that cannot be read --------------------------------------------------------------------


def test_joints_that_cannot_be_read_are_where_they_were_commanded_to_be():
    sensors = Sensors()
    commanded = ROBOT.stand_pose + 0.001
    sensors.joints(POSE, commanded=commanded)
    unreadable = [math.nan] * len(NAMES)
    np.testing.assert_array_equal(sensors.joints(unreadable), commanded)
    assert sensors.validation.unread_since == sensors.stamp
    assert sensors.diagnostics.rejected["joint_states"] == 1
    sensors.joints(POSE, commanded=commanded)
    assert sensors.validation.unread_since is None


def test_joints_that_cannot_be_read_without_a_recent_command_are_refused():
    sensors = Sensors()
    unreadable = [math.nan] * len(NAMES)
    sensors.joints(POSE, commanded=ROBOT.stand_pose)
    for _ in range(30):
        sensors.joints(unreadable)
    with pytest.raises(NaoGaitError, match=r"position\[HeadYaw\]: got nan"):
        sensors.joints(unreadable), "the command is too old"
    relaxed = Sensors()
    relaxed.joints(POSE)
    relaxed.validation.sent(JointTargets(relaxed.stamp, ROBOT.stand_pose, stiffness=0.0))
    with pytest.raises(NaoGaitError, match="got nan"):
        relaxed.joints(unreadable), "relaxed joints may be anywhere"


# -- stuck sensors ---------------------------------------------------------------------------------


def test_joints_of_a_walking_robot_that_do_not_move_are_stuck():
    sensors = Sensors()
    commanded = ROBOT.stand_pose + 0.1
    used = [sensors.joints(POSE, walking=True, commanded=commanded)[KNEE] for _ in range(10)]
    assert used[0] == POSE[KNEE]
    assert used[-1] == commanded[KNEE]
    assert any("stuck while the robot walks" in text for text in sensors.said())


def test_joints_of_a_standing_robot_need_not_move():
    sensors = Sensors()
    commanded = ROBOT.stand_pose + 0.1
    for _ in range(50):
        np.testing.assert_array_equal(sensors.joints(POSE, commanded=commanded), POSE)
    assert sensors.said() == []


def test_an_imu_that_repeats_itself_while_joints_move_is_stuck():
    sensors = Sensors()
    q = ROBOT.stand_pose.copy()
    for _ in range(IMU_REPEATS):
        q = q + 0.01
        sensors.joints(q)
        sensors.imu((0.1, 0.0, 0.0))
    sensors.joints(q + 0.01)
    with pytest.raises(NaoGaitError, match="the same numbers while joints move"):
        sensors.imu((0.1, 0.0, 0.0))
    sensors.imu((0.1, 0.0, 0.001))


def test_the_imu_of_a_resting_robot_may_repeat_itself():
    sensors = Sensors()
    for _ in range(100):
        sensors.joints(POSE)
        sensors.imu((0.0, 0.0, 0.0))


def test_a_coupled_joint_that_is_not_sent_follows_its_leader() -> None:
    pairs = [(name, 0.1) for name in NAMES if name not in ("RHipYawPitch", "LHipYawPitch")]
    names = [*(name for name, _ in pairs), "LHipYawPitch"]
    found = read(names, [*(value for _, value in pairs), -0.3])
    assert found[ROBOT.index("RHipYawPitch")] == found[ROBOT.index("LHipYawPitch")] == -0.3
